"""Objects as tables of a scenario: obstacles, places, tasks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from typing import Any

import numpy as np

from problems import (
    InvalidProblem,
    Joints,
    Move,
    PathFollowing,
    Place,
    PlanarArm,
    PointToPoint,
    Position,
    Robot,
)
from problems import Path as PathOfPoints
from problems.base import FloatArray
from problems.tasks import JointFollowing, PathTracing, Pose, SpaceTracing, Task
from tpbso_casadi.scenario import (
    ARM_KEYS,
    ScenarioError,
    path_of,
    pieces_table,
    plain,
    shown,
)

OF_THE_MODEL = ("margin", "self_collision")  # fields of a robot that a scenario states in [model]


def arm_table(arm: PlanarArm) -> dict[str, Any]:
    """The [arm] table of a planar arm."""
    table = {ARM_KEYS.get(key, key): value for key, value in _stated(arm).items()}
    table["base"] = [*arm.base_point, arm.base_angle]
    if arm.payload is not None:
        payload = arm.payload
        table["payload"] = {"mass": payload.mass, "center": payload.center[:2], "inertia": payload.matrix[2][2]}
    return dict(plain(table))


def settings_table(robot: Robot) -> dict[str, Any]:
    """The [robot] table of a robot of any class, by its path."""
    return {"model": path_of(type(robot)), "settings": plain(_stated(robot))}


def place_table(place: Any, dof: int, dim: int, name: str) -> Any:
    """A place of a [task] table.

    Args:
        place: :class:`Joints`, :class:`Position`, :class:`Pose`, a table, a homogeneous matrix (4, 4), or numbers: a
            point where there are as many as the space has dimensions, joint values where there are as many as joints.
        dof: how many joints the robot has.
        dim: of its space.
        name: of the argument, for messages.

    Raises:
        ScenarioError: it is none of these.
    """
    if isinstance(place, Place):
        return _stated_place(place, name)
    given = plain(place)
    if isinstance(given, dict):
        return given
    if _is_matrix(place):
        return _stated_place(_pose(place, name), name)
    if not isinstance(given, list) or not all(map(_is_number, given)):
        raise ScenarioError(f"{name}: {shown(given)} is no place; {_forms(dof, dim)}")
    if len(given) == dim == dof and dim > 2:
        raise ScenarioError(f"{name}: {given} may be a point or joint values: say tp.Pose(...) or tp.Joints(...)")
    if len(given) == dim:
        return given if dim == 2 else {"position": given}
    if len(given) != dof:
        raise ScenarioError(f"{name}: {len(given)} numbers; {_forms(dof, dim)}")
    return {"joints": given}


def _stated_place(place: Place, name: str) -> dict[str, Any]:
    state = PLACE_TABLES.get(type(place))
    if state is None:
        raise ScenarioError(f"{name}: no table states {type(place).__name__}")
    return {key: plain(value) for key, value in state(place).items() if value is not None}


PLACE_TABLES: dict[type[Place], Callable[[Any], dict[str, Any]]] = {
    Joints: lambda place: {"joints": place.values},
    Position: lambda place: {"position": place.point},
    Pose: lambda place: {"position": place.point, "quaternion": place.quaternion},
}


def _forms(dof: int, dim: int) -> str:
    pose = ", or a pose" if dim == 3 else ""
    return f"{dof} joint values are needed, or {dim} coordinates of a point{pose}"


def _pose(matrix: Any, name: str) -> Pose:
    try:
        return Pose.from_matrix(np.asarray(matrix))
    except InvalidProblem as error:
        raise ScenarioError(f"{name}: {error.reason}") from error


def goals_table(goal: Any, dof: int, dim: int, name: str) -> Any:
    """A goal, or a list of goals of which any will do."""
    listed = isinstance(goal, list | tuple) or (isinstance(goal, np.ndarray) and goal.ndim > 1)
    several = listed and len(goal) > 0 and not _is_matrix(goal) and not _is_number(goal[0])
    return places_table(goal, dof, dim, name) if several else place_table(goal, dof, dim, name)


def places_table(places: Any, dof: int, dim: int, name: str) -> list[Any]:
    """A list of places; each may be anything that a place may be.

    Raises:
        ScenarioError: it is no list, or one of them is no place.
    """
    listed = isinstance(places, list | tuple | np.ndarray)
    if not listed or _is_matrix(places) or (len(places) and _is_number(places[0])):
        raise ScenarioError(f"{name}: a list of places is needed, not {shown(plain(places))}")
    return [place_table(place, dof, dim, f"{name}[{number}]") for number, place in enumerate(places)]


def _is_matrix(value: Any) -> bool:
    """Whether it is a homogeneous matrix rather than a list of places: an array (4, 4)."""
    return isinstance(value, np.ndarray) and value.shape == (4, 4)


def _is_number(value: Any) -> bool:
    return isinstance(plain(value), int | float) and not isinstance(value, bool)


def _stated(thing: Any) -> dict[str, Any]:
    """The fields of a dataclass that a table states: those that are not None, and of no other table."""
    values = {field.name: getattr(thing, field.name) for field in fields(thing) if field.init}
    derived = {"base_point", "base_angle", "payload", *OF_THE_MODEL}
    return {key: value for key, value in values.items() if value is not None and key not in derived}


Tables = dict[str, dict[str, Any]]


def tables_of(task: Task) -> Tables:
    """The tables [task] and [model] that state a task; its robot and its obstacles have tables of their own.

    Raises:
        ScenarioError: no table states such a task.
    """
    state = STATEMENTS.get(type(task))
    if state is None:
        known = ", ".join(kind.__name__ for kind in STATEMENTS)
        raise ScenarioError(f"no table states a {type(task).__name__}; there are {known}, or a scenario with its kind")
    tables = state(task)
    return {name: {key: plain(value) for key, value in _kept(table)} for name, table in tables.items()}


def path_table(path: PathOfPoints) -> dict[str, Any]:
    """The keys of a [task] table that state points, with the tool's orientation where the path gives it.

    Raises:
        ScenarioError: its corners are others than those that its points have.
    """
    rows: FloatArray = np.hstack([path.array, np.array(path.quaternions)]) if path.quaternions else path.array
    if PathOfPoints.through(rows).corners != path.corners:
        raise ScenarioError("path: its corners have to be where it turns by 45 degrees or more; say Path.through(...)")
    return {"points": rows}


def _kept(table: dict[str, Any]) -> list[tuple[str, Any]]:
    """What is stated of a table: neither left out nor empty."""
    return [(key, value) for key, value in table.items() if value is not None and np.size(value)]


def _point_to_point(task: PointToPoint) -> Tables:
    keys = ("start", "goal", "elbow", "segment_time")
    return {"task": {"kind": "point-to-point", **_fields(task, *keys)}, "model": {"motion": "paper"}}


def _move(task: Move) -> Tables:
    dof, dim = task.robot.dof, task.robot.dim
    places = {
        "start": place_table(task.start, dof, dim, "start"),
        "goal": goals_table(task.goals if len(task.goals) > 1 else task.goals[0], dof, dim, "goal"),
        "via": places_table(task.vias, dof, dim, "via") or None,
    }
    keys = ("elbow", "start_velocity", "goal_velocity", "start_acceleration", "total_time")
    table = {"kind": "point-to-point", **places, **_fields(task, *keys), "stay": task.stay or None}
    return {"task": table, "model": {"motion": "spline"}}


def _path_following(task: PathFollowing) -> Tables:
    table = {"kind": "path", **path_table(task.path), **_fields(task, "accuracy", "elbow", "total_time")}
    return {"task": table, "model": {"motion": "paper", **_fields(task, "knots", "knot_redundancy")}}


def _path_tracing(task: PathTracing) -> Tables:
    table = {"kind": "path", **path_table(task.path), **_fields(task, "accuracy", "elbow", "total_time")}
    return {"task": table, "model": {"motion": "spline"}}


def _space_tracing(task: SpaceTracing) -> Tables:
    table = {"kind": "path", **path_table(task.path), **_fields(task, "accuracy", "angular_accuracy", "total_time")}
    return {"task": table, "model": {"motion": "spline"}}


def _joint_following(task: JointFollowing) -> Tables:
    return {"task": pieces_table(task.path) | _fields(task, "start_speed", "goal_speed", "total_time"), "model": {}}


def _fields(task: Task, *names: str) -> dict[str, Any]:
    return {name: getattr(task, name) for name in names}


STATEMENTS: dict[type[Task], Callable[[Any], Tables]] = {
    PointToPoint: _point_to_point,
    Move: _move,
    PathFollowing: _path_following,
    PathTracing: _path_tracing,
    SpaceTracing: _space_tracing,
    JointFollowing: _joint_following,
}
