"""Tasks given as objects, as the tables of a scenario file that state them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from problems import Move, PathFollowing, PointToPoint
from problems import Path as PathOfPoints
from problems.base.matrix import FloatArray
from problems.tasks.paths.joint_path import JointFollowing
from problems.tasks.paths.path_tracing import PathTracing
from problems.tasks.paths.space_tracing import SpaceTracing
from problems.tasks.task import Task
from tpbso_casadi.facade.plain_data import plain
from tpbso_casadi.facade.tables import goals_table, place_table, places_table
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.scenario.tasks.joint_path import pieces_table

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
