"""Scenarios by their names on a command line."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tpbso_casadi.scenario.builtin import TITLES, builtin
from tpbso_casadi.scenario.scenario import Scenario, read_scenario
from tpbso_casadi.scenario.section import ScenarioError


def load(name: str) -> Scenario:
    """A built-in scenario, or that of a file.

    Raises:
        ScenarioError: it is neither, or the file is not a scenario.
    """
    if name in TITLES:
        return builtin(name)
    path = Path(name)
    if not path.suffix and not path.exists():
        raise ScenarioError(f"{name}: neither a file nor a built-in scenario; solve --list shows those")
    return read_scenario(path)


def load_all(names: Sequence[str]) -> dict[str, Scenario]:
    """Scenarios by their labels in tables: a built-in name, a file's stem, or its path where two stems are the same.

    Raises:
        ScenarioError: one does not exist, is not a scenario, or is stated twice.
    """
    stems = [Path(name).stem for name in names]
    scenarios: dict[str, Scenario] = {}
    for name, stem in zip(names, stems, strict=True):
        label = stem if stems.count(stem) == 1 else name
        if label in scenarios:
            raise ScenarioError(f"{name}: is there twice")
        scenarios[label] = load(name)
    return scenarios
