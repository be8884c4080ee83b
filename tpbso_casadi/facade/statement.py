"""The scenario that arguments state."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import numpy as np

from problems import InvalidProblem, Obstacle, Place, Robot
from problems import Path as PathOfPoints
from problems.base import shown_value
from problems.tasks import Pose, Task
from tpbso_casadi.facade.arguments import (
    AnySolverChoice,
    in_words_of_python,
    solver_table,
    sorted_into_tables,
    whole_or_not,
)
from tpbso_casadi.facade.frames import frames_of
from tpbso_casadi.facade.own import constraints_table, objective_table
from tpbso_casadi.facade.robots import AnyRobot, StatedRobot, robot
from tpbso_casadi.scenario import (
    FRAMES,
    STATED,
    TITLES,
    InputFolder,
    NamedSolver,
    Scenario,
    ScenarioError,
    as_scenario_errors,
    load,
    overridden,
    parse_scenario,
    plain,
    points_table,
    read_scene,
    stated_scenario,
    task_tables,
)

SCENE = ".scene"  # the ending of MoveIt's files
What: TypeAlias = Scenario | Task | AnyRobot


class HasScenario(Protocol):
    """An object with a scenario: a plan, a step, a run that was read."""

    @property
    def scenario(self) -> Scenario:
        """Robot, task, limits and solver."""


POINT_TO_POINT, PATH = "point-to-point", "path"  # kinds of tasks; the argument path states one of the second


def scenario_of(
    what: What | HasScenario,
    solver: AnySolverChoice | NamedSolver | None = None,
    polish: bool | int | None = None,
    **keys: Any,
) -> Scenario:
    """The scenario that a call of :func:`plan` states, without planning it.

    Args:
        what: a scenario, or what has one, as a plan; the path of a scenario file; a built-in name; a task as an object,
            such as :class:`PointToPoint`; or a robot, for which the keys state a task.
        solver: name of a solver, its class, or a solver with its settings.
        polish: whether IPOPT refines the best candidate; or how many candidates it starts from.
        keys: of the tables [task], [model] and [solver]; ``obstacles``, ``carried``, ``may_touch``, ``frames``, and
            ``path`` for points to trace.

    Raises:
        ScenarioError: naming the first wrong argument.
        TypeError: a keyword that no table has.
    """
    check_plannable("what", what)
    given = given_scenario(what) if keys.get(FRAMES) is None else _with_frames(what, keys[FRAMES])
    if given is not None:
        keys.pop(FRAMES, None)
        return _overridden(given, solver, polish, keys)
    with in_words_of_python():
        return _overridden(None, solver, polish, keys, what)


def check_plannable(name: str, what: Any, also: str = "") -> None:
    """Refuse a value that cannot be planned, as far as its kind tells.

    Args:
        name: of the argument.
        what: its value.
        also: what else it may be, for the message.

    Raises:
        ScenarioError: it cannot.
    """
    kinds = (str, Path, StatedRobot, Robot, Sequence, np.ndarray)
    if isinstance(what, kinds) or type(what) in STATED or given_scenario(what) is not None:
        return
    known = "a scenario, its file (.toml) or its name, a task such as tp.Move(...), or a robot, tp.robot(...)"
    raise ScenarioError(f"{name}: {f'{also}, ' if also else ''}{known}, is needed, not {shown_value(what)}")


def _overridden(
    given: Scenario | None,
    solver: AnySolverChoice | NamedSolver | None,
    polish: bool | int | None,
    keys: Any,
    what: Any = None,
) -> Scenario:
    """The scenario with the arguments in place of its own; a new one of a robot or a task where there is none."""
    stated = {key: value for key, value in keys.items() if value is not None}
    around = {key: read(stated.pop(key)) for key, read in AROUND.items() if key in stated}
    tables = sorted_into_tables(stated, None if given is None else given.task)
    tables["solver"] |= solver_table(solver, None if given is None else given.solver)
    if polish is not None:
        tables["solver"]["polish_starts"] = whole_or_not("polish", polish)
    if given is None and type(what) in STATED:
        given = task_scenario(what)
    if given is None:
        arm = robot(what).based_in(around.get(FRAMES, ()))
        state_own(tables, None, lambda: arm.model)
        given, around = new_scenario(arm, tables, around), {}
        tables["task"], tables["model"] = {}, {}
        table = given.robot_table
    else:
        with as_scenario_errors():
            table = (given.with_postures() if given.frames else given).robot_table
        state_own(tables, given, table.build)
    task = _task_keys(tables["task"], table.build)
    return overridden(given, task=task, model=tables["model"], solver=tables["solver"], around=around)


def _with_frames(what: Any, frames: Any) -> Scenario | None:
    """The given scenario as it is stated, with frames in place of its own of the same names; None where none is given.

    Raises:
        ScenarioError: one is no frame; or nothing of the scenario is stated in frames any more.
    """
    is_file = isinstance(what, str | Path) and Path(what).suffix == ".toml"
    given = stated_scenario(what, outside_allowed=True) if is_file else what
    if given_scenario(given) is None:
        return None
    with in_words_of_python():
        if not is_file and not (isinstance(given, Scenario) and given.frames):
            reason = "this scenario is in the world already; give its file, or tp.stated_scenario(...)"
            raise ScenarioError(f"{FRAMES}: {reason}")
        known = {frame.name: frame for frame in (*given.frames, *frames_of(frames))}
        with as_scenario_errors():
            return given.with_keys({FRAMES: [*known.values()]})


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


def given_scenario(what: Any) -> Scenario | None:
    """The scenario in the world that is given by itself, its plan, file or name; None where a task or a robot is."""
    scenario = getattr(what, "scenario", what)
    if isinstance(scenario, Scenario):
        with as_scenario_errors():
            return scenario.with_postures() if scenario.frames else scenario
    if isinstance(what, str | Path) and (what in TITLES or Path(what).suffix == ".toml"):
        return load(str(what), outside_allowed=True)
    return None


def new_scenario(arm: StatedRobot, tables: dict[str, dict[str, Any]], around: dict[str, Any]) -> Scenario:
    """A scenario of a robot and a task.

    Args:
        arm: the robot.
        tables: keys by table, of [task] and [model].
        around: [[obstacles]], [[carried]], ``may_touch``.
    """
    task, stated = tables["task"], arm.tables
    task = {"kind": PATH if PATH in task else POINT_TO_POINT, **_task_keys(task, lambda: arm.model)}
    content = stated | {"model": stated["model"] | tables["model"], "task": task} | around
    return parse_scenario(content, InputFolder(Path(), outside_allowed=True))


def task_scenario(task: Task) -> Scenario:
    """A scenario of a task that is given as an object."""
    (stated, model), content = task_tables(task), robot(task.robot).tables
    model = content["model"] | model
    return parse_scenario(content | {"model": model, "task": stated, "obstacles": obstacles_of(task.obstacles)})


def _task_keys(task: dict[str, Any], model: Callable[[], Robot]) -> dict[str, Any]:
    """Arguments as keys of [task]: places, which a robot is made for, and points to trace."""
    readers: dict[str, Callable[[Any, int, int, str], Any]] = {
        "start": place_of, "goal": goals_of, "via": places_of
    }  # fmt: skip
    table = dict(task)
    places = readers.keys() & task.keys()
    if places:
        arm = model()
        table |= {key: readers[key](task[key], arm.dof, arm.dim, key) for key in task if key in places}
    path = table.pop("path", None)
    if path is not None:
        table |= points_table(path) if isinstance(path, PathOfPoints) else {"points": path}
    return dict(plain(table))


def obstacles_of(obstacles: Any) -> list[Any] | None:
    """The [[obstacles]] of anything that lists obstacles, or of a scene file; None where nothing is said of them.

    Raises:
        ScenarioError: it is no list, or an entry is none.
    """
    if obstacles is None:
        return None
    if isinstance(obstacles, str | Path) and Path(obstacles).suffix == SCENE:
        return list(read_scene(str(obstacles), InputFolder(Path(), outside_allowed=True)))
    if isinstance(obstacles, str | Mapping) or not isinstance(obstacles, Iterable):
        raise ScenarioError("obstacles: a list is needed, [tp.Box(...)]")
    return [obstacle_of(each) for each in obstacles]


def _carried(carried: Any) -> list[Any]:
    if isinstance(carried, str | Mapping) or not isinstance(carried, Iterable):
        raise ScenarioError("carried: a list is needed, [tp.Box(...)] or tables with a shape and a mass")
    return [obstacle_of(each) for each in carried]


AROUND: dict[str, Callable[[Any], Any]] = {  # keys beside the tables
    FRAMES: frames_of, "obstacles": obstacles_of, "carried": _carried, "may_touch": plain,
}  # fmt: skip


def obstacle_of(obstacle: Obstacle | Mapping[str, Any], name: str = "obstacles") -> Any:
    """An obstacle as one of the [[obstacles]]; a table is one already.

    Raises:
        ScenarioError: it is none; the message begins with the name of the argument.
    """
    if isinstance(obstacle, Obstacle):
        return obstacle
    if isinstance(obstacle, dict):
        return dict(plain(obstacle))
    raise ScenarioError(f"{name}: {shown_value(obstacle)} is none; say tp.Box(...) and the like, or a dict")


def place_of(place: Any, dof: int, dim: int, name: str) -> Any:
    """A place that an argument states.

    Args:
        place: :class:`Joints`, :class:`Position`, :class:`Pose`, a table, the name of a posture, a homogeneous matrix
            (4, 4), or numbers: a point where there are as many as the space has dimensions, joint values where there
            are as many as joints.
        dof: how many joints the robot has.
        dim: of its space.
        name: of the argument, for messages.

    Raises:
        ScenarioError: it is none of these.
    """
    if isinstance(place, Place | str):
        return place
    given = plain(place)
    if isinstance(given, dict):
        return given if {*given} & {"joints", "position"} else {key: _of_an_arm(place[key], key, name) for key in place}
    if _is_matrix(place):
        return _pose(place, name)
    if not isinstance(given, list) or not all(map(_is_number, given)):
        raise ScenarioError(f"{name}: {shown_value(given)} is no place; {_forms(dof, dim)}")
    if len(given) == dim == dof and dim > 2:
        raise ScenarioError(f"{name}: {given} may be a point or joint values: say tp.Pose(...) or tp.Joints(...)")
    if len(given) == dim:
        return given if dim == 2 else {"position": given}
    if len(given) != dof:
        raise ScenarioError(f"{name}: {len(given)} numbers; {_forms(dof, dim)}")
    return {"joints": given}


def _of_an_arm(place: Any, arm: str, name: str) -> Any:
    """The place of one arm of several; numbers are the values of its joints."""
    if isinstance(place, Place | str | dict):
        return place
    if _is_matrix(place):
        return _pose(place, f"{name}.{arm}")
    given = plain(place)
    if not isinstance(given, list) or not all(map(_is_number, given)):
        raise ScenarioError(f"{name}.{arm}: {shown_value(given)} is no place; joint values are needed, or a pose")
    return {"joints": given}


def _forms(dof: int, dim: int) -> str:
    pose = ", or a pose" if dim == 3 else ""
    return f"{dof} joint values are needed, or {dim} coordinates of a point{pose}"


def _pose(matrix: Any, name: str) -> Pose:
    try:
        return Pose.from_matrix(np.asarray(matrix))
    except InvalidProblem as error:
        raise ScenarioError(f"{name}: {error.reason}") from error


def goals_of(goal: Any, dof: int, dim: int, name: str) -> Any:
    """A goal, or a list of goals of which any will do."""
    listed = isinstance(goal, list | tuple) or (isinstance(goal, np.ndarray) and goal.ndim > 1)
    several = listed and len(goal) > 0 and not _is_matrix(goal) and not _is_number(goal[0])
    return places_of(goal, dof, dim, name) if several else place_of(goal, dof, dim, name)


def places_of(places: Any, dof: int, dim: int, name: str) -> list[Any]:
    """A list of places; each may be anything that a place may be.

    Raises:
        ScenarioError: it is no list, or one of them is no place.
    """
    listed = isinstance(places, list | tuple | np.ndarray)
    if not listed or _is_matrix(places) or (len(places) and _is_number(places[0])):
        raise ScenarioError(f"{name}: a list of places is needed, not {shown_value(plain(places))}")
    return [place_of(place, dof, dim, f"{name}[{number}]") for number, place in enumerate(places)]


def _is_matrix(value: Any) -> bool:
    """Whether it is a homogeneous matrix rather than a list of places: an array (4, 4)."""
    return isinstance(value, np.ndarray) and value.shape == (4, 4)


def _is_number(value: Any) -> bool:
    return isinstance(plain(value), int | float) and not isinstance(value, bool)
