"""Scenarios by name or file, with the options that replace keys."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tpbso_casadi.plain import visible
from tpbso_casadi.scenario.cases import TITLES, builtin
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.scenario import Scenario, parse_scenario, read_scenario
from tpbso_casadi.scenario.validation import ScenarioError

Table = Mapping[str, Any]
NOTHING: Table = {}


def overridden(
    scenario: Scenario,
    *,
    arm: Table | None = None,
    task: Table = NOTHING,
    model: Table = NOTHING,
    solver: Table = NOTHING,
    polish: bool = False,
    around: Table = NOTHING,
) -> Scenario:
    """The scenario with given values in place of its own, and a solver where it names none; validated anew.

    Args:
        scenario: to start from.
        arm: the whole [arm] table; None to leave it.
        task: keys of [task].
        model: keys of [model].
        solver: keys of [solver]; another solver's name drops the settings of the one before.
        polish: whether the best candidate is refined at least once.
        around: all [[obstacles]], all [[carried]], ``may_touch``, where one of them is to be another; their files lie
            in the working directory.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    content = scenario.table()
    content["model"] = scenario.model.stated() | dict(model)
    content["task"] |= task
    if arm is not None:
        content["arm"] = dict(arm)
    content |= around
    if polish and not content["solver"]["polish_starts"]:
        content["solver"]["polish_starts"] = 1
    if solver.get("name", scenario.solver.name) != scenario.solver.name:
        content["solver"]["settings"] = {}
    content["solver"] |= solver
    named = {*scenario.solver.stated_keys, *solver}
    if scenario.task.has_solver and "name" not in named:
        own = bool(content["model"].get("constraints") or content["task"].get("objectives"))
        table = scenario.robot_table
        content["solver"] = with_default(content["solver"], named, table.usual_solver, table.usual_descents or int(own))
    return parse_scenario(content, InputFolder(Path(), outside_allowed=True) if around else None)


def with_default(solver: dict[str, Any], stated: set[str], usual: str, descents: int) -> dict[str, Any]:
    """The [solver] table of a scenario that names no solver: the usual one, polished unless it says otherwise."""
    polished_anyway = solver["polish_starts"] or solver["within"] is not None or "polish_starts" in stated
    return solver | {"name": usual} | ({} if polished_anyway else {"polish_starts": descents})


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
