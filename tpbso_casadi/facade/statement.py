"""A scenario from the arguments of a call."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeAlias

from problems import Obstacle, Robot
from problems import Path as PathOfPoints
from solvers import AnySolver
from solvers.registry import GRADIENT_SOLVERS, SOLVERS
from tpbso_casadi.facade.own import constraints_table, objective_table
from tpbso_casadi.facade.plain_data import plain
from tpbso_casadi.facade.robots import AnyRobot, StatedRobot, robot
from tpbso_casadi.facade.tables import goals_table, obstacle_table, path_of, place_table, places_table
from tpbso_casadi.scenario.cases.builtin import TITLES
from tpbso_casadi.scenario.loading import load
from tpbso_casadi.scenario.overriding import overridden
from tpbso_casadi.scenario.scenario import Scenario, SolverSection, parse_scenario
from tpbso_casadi.scenario.section import Section
from tpbso_casadi.scenario.task import ModelSection
from tpbso_casadi.scenario.tasks.path import PointsTask
from tpbso_casadi.scenario.tasks.point_to_point import PointToPointTask
from tpbso_casadi.storage.plain import settings_of

What: TypeAlias = Scenario | AnyRobot
AnySolverChoice: TypeAlias = str | AnySolver | type[AnySolver]
POINT_TO_POINT, PATH = "point-to-point", "path"
TABLES: dict[str, tuple[type[Section], ...]] = {
    "task": (PointToPointTask, PointsTask),
    "model": (ModelSection,),
    "solver": (SolverSection,),
}


def scenario_of(what: What, solver: AnySolverChoice | None = None, polish: bool | None = None, **keys: Any) -> Scenario:
    """The scenario that a call states.

    Args:
        what: a scenario, the path of a scenario file, a built-in name; or a robot, for which the keys state a task.
        solver: name of a solver, or a solver with its settings.
        polish: whether the best candidate is refined by IPOPT.
        keys: of the tables [task], [model] and [solver]; ``obstacles``, and ``path`` for points to trace.

    Raises:
        ScenarioError: naming the first wrong key.
        TypeError: a keyword that no table has.
    """
    stated = {key: value for key, value in keys.items() if value is not None}
    obstacles = stated.pop("obstacles", ())
    tables = sorted_into_tables(stated)
    tables["solver"] |= solver_table(solver)
    if polish is not None:
        tables["solver"]["polish_starts"] = int(polish)
    given = given_scenario(what)
    state_own(tables, given, lambda: given.robot_table.build() if given is not None else robot(what).model)  # type: ignore[arg-type]
    if given is None:
        given = new_scenario(robot(what), tables.pop("task"), obstacles)  # type: ignore[arg-type]
        tables["task"] = {}
    elif len(obstacles):
        given = parse_scenario(given.model_dump() | {"obstacles": [obstacle_table(each) for each in obstacles]})
    return overridden(given, task=tables["task"], model=tables["model"], solver=tables["solver"])


def state_own(tables: dict[str, dict[str, Any]], given: Scenario | None, model: Callable[[], Robot]) -> None:
    """Put what a user states of constraints and objectives as a scenario states it.

    Args:
        tables: keys by table, which are changed.
        given: the scenario to begin with, where there is one.
        model: makes the robot, where it is needed.
    """
    if "constraints" in tables["model"]:
        own = constraints_table(tables["model"]["constraints"], model())
        before = [] if given is None else given.model.limits
        tables["model"] |= own | {"limits": [*tables["model"].get("limits", before), *own["limits"]]}
    if "objective" in tables["task"]:
        tables["task"] |= objective_table(tables["task"]["objective"], model)
    tables["model"] = plain(tables["model"])


def given_scenario(what: What) -> Scenario | None:
    """The scenario that is given by itself, its file or its name; None where a robot is given."""
    if isinstance(what, Scenario):
        return what
    if isinstance(what, str | Path) and (what in TITLES or Path(what).suffix == ".toml"):
        return load(str(what), outside_allowed=True)
    return None


def new_scenario(arm: StatedRobot, task: dict[str, Any], obstacles: Iterable[Obstacle | dict[str, Any]]) -> Scenario:
    """A scenario of a robot and a task."""
    dof, dim = arm.dof, arm.model.dim
    table = {"kind": POINT_TO_POINT, **task}
    path = table.pop("path", None)
    if path is not None:
        table |= {"kind": PATH, "points": path.points if isinstance(path, PathOfPoints) else path}
    readers: dict[str, Callable[[Any, int, int], Any]] = {
        "start": place_table, "goal": goals_table, "via": places_table
    }  # fmt: skip
    table |= {key: read(table[key], dof, dim) for key, read in readers.items() if key in table}
    tables = {"task": plain(table), "obstacles": [obstacle_table(each) for each in obstacles]}
    return parse_scenario(arm.content | tables)


def solver_table(solver: AnySolverChoice | None) -> dict[str, Any]:
    """The keys of [solver] that name a solver and its settings."""
    if solver is None:
        return {}
    if isinstance(solver, str):
        return {"name": solver}
    kind = solver if isinstance(solver, type) else type(solver)
    registered: dict[str, type[AnySolver]] = {**SOLVERS, **GRADIENT_SOLVERS}
    name = next((name for name, known in registered.items() if known is kind), path_of(kind))
    settings = {} if isinstance(solver, type) else settings_of(solver)
    return {"name": name, "settings": {key: value for key, value in settings.items() if value is not None}}


def sorted_into_tables(keys: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Keywords by the table that has such a key.

    Raises:
        TypeError: none has, with the nearest that one has.
    """
    known = {name: {key for section in sections for key in section.model_fields} for name, sections in TABLES.items()}
    known["task"].add("path")
    found: dict[str, dict[str, Any]] = {name: {} for name in TABLES}
    for key, value in keys.items():
        table = next((name for name in TABLES if key in known[name]), None)
        if table is None:
            near = difflib.get_close_matches(key, sorted(set().union(*known.values(), {"obstacles"})), n=1)
            raise TypeError(f"there is no keyword {key!r}" + (f"; did you mean {near[0]!r}?" if near else ""))
        found[table][key] = plain(value) if table == "solver" else value
    return found
