"""Scenarios by name or file, with the options that replace keys."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from problems.base import at
from tpbso_casadi.plain import visible
from tpbso_casadi.scenario.cases import TITLES, builtin
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.reading import read_scenario, with_files_read
from tpbso_casadi.scenario.robots import AnyRobotTable
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.solver_section import SolverSection
from tpbso_casadi.scenario.tasks import task_with_keys
from tpbso_casadi.scenario.validation import ScenarioError, as_scenario_errors

Table = Mapping[str, Any]
NOTHING: Table = {}


def overridden(
    scenario: Scenario,
    *,
    task: Table = NOTHING,
    model: Table = NOTHING,
    solver: Table = NOTHING,
    around: Table = NOTHING,
) -> Scenario:
    """The scenario with given values in place of its own, and a solver where it names none; validated anew.

    Args:
        scenario: to start from.
        task: keys of [task].
        model: keys of [model].
        solver: keys of [solver]; another solver's name drops the settings of the one before.
        around: all [[obstacles]], all [[carried]], ``may_touch``, where one of them is to be another; their files lie
            in the working directory.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    tables: dict[str, Any] = dict(around)
    with as_scenario_errors():
        if task:
            with at("task"):
                tables["task"] = task_with_keys(scenario.task, task)
        if model:
            with at("model"):
                tables["model"] = scenario.model.with_keys(model)
        stated = scenario.with_keys(tables) if tables else scenario
        if around:
            stated = with_files_read(stated, InputFolder(Path(), outside_allowed=True))
        with at("solver"):
            stated = stated.replaced(solver=_solver(stated, solver))
        changed = stated.with_postures()
        changed.check()
    return changed


def _solver(scenario: Scenario, keys: Table) -> SolverSection:
    """The solver of a scenario with some keys stated anew; where none is named, the usual one of the robot."""
    before = scenario.solver
    if keys.get("name", before.name) != before.name:
        keys = {"settings": {}, **keys}
    table = before.with_keys(keys)
    if not scenario.task.has_solver or "name" in table.stated_keys:
        return table
    own = bool(scenario.model.constraints or scenario.task.own_objectives)
    return table.with_keys(usual_solver(table, scenario.robot_table, own))


def usual_solver(stated: SolverSection, robot: AnyRobotTable, own: bool) -> Table:
    """Keys of [solver] where no solver is named: the robot's usual one, polished unless the table says otherwise.

    Args:
        stated: keys that the table states.
        robot: the table of the robot.
        own: whether there are constraints or objectives of a user's own.
    """
    polished_anyway = stated.polish_starts or stated.within is not None or "polish_starts" in stated.stated_keys
    starts = {} if polished_anyway else {"polish_starts": robot.usual_descents or int(own)}
    return {"name": robot.usual_solver, **starts}


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
