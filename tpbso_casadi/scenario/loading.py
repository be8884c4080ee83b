"""Scenarios by their names on a command line."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from tpbso_casadi.scenario.cases.builtin import TITLES, builtin
from tpbso_casadi.scenario.scenario import Scenario, read_scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.plain import visible


def load(name: str, outside_allowed: bool = False) -> Scenario:
    """A built-in scenario, or that of a file.

    Args:
        name: of a built-in scenario, or the path of a file.
        outside_allowed: whether the file may name files that lie outside its own folder.

    Raises:
        ScenarioError: it is neither, or the file is not a scenario.
    """
    if name in TITLES:
        return builtin(name)
    path = Path(name)
    if not path.suffix and not os.path.lexists(name):
        raise ScenarioError(f"{name or repr(name)}: neither a file nor a built-in scenario; solve --list shows those")
    return read_scenario(path, outside_allowed)


def load_all(names: Sequence[str], outside_allowed: bool = False) -> dict[str, Scenario]:
    """Scenarios by their labels in tables: a built-in name, a file's stem, or its path where two stems are the same.

    Raises:
        ScenarioError: one does not exist, is not a scenario, or is stated twice.
    """
    stems = [Path(name).stem for name in names]
    scenarios: dict[str, Scenario] = {}
    for name, stem in zip(names, stems, strict=True):
        label = visible(stem if stems.count(stem) == 1 else name)
        if label in scenarios:
            raise ScenarioError(f"{name}: is there twice")
        scenarios[label] = load(name, outside_allowed)
    return scenarios
