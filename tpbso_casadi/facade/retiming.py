"""``tp.retime``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from problems import Limit, Obstacle, Trajectory
from problems.base import FloatArray
from problems.motions import JointPath
from tpbso_casadi.facade.arguments import in_words_of_python, several
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.planning import read_run
from tpbso_casadi.facade.robots import AnyRobot
from tpbso_casadi.facade.robots import robot as robot_of
from tpbso_casadi.facade.statement import obstacle_tables
from tpbso_casadi.planning import plan as plan_scenario
from tpbso_casadi.scenario import (
    LARGEST_ANGLE,
    InputFolder,
    ScenarioError,
    parse_scenario,
    pieces_table,
    plain,
    read_joint_rows,
    shown,
)
from tpbso_casadi.storage import path_table

AnyPath: TypeAlias = FloatArray | JointPath | Trajectory | Plan | str | Path
Content: TypeAlias = dict[str, Any]
SURROUNDINGS = ("arm", "robot", "obstacles")  # tables of a plan that its path brings along
MODEL_KEYS = ("limits", "margin", "self_collision")


def retime(
    path: AnyPath,
    robot: AnyRobot | None = None,
    *,
    interpolation: str | None = None,
    tolerance: float | None = None,
    start_speed: float | None = None,
    goal_speed: float | None = None,
    total_time: tuple[float, float] | None = None,
    obstacles: Iterable[Obstacle | dict[str, Any]] | None = None,
    limits: Iterable[str | type[Limit]] | None = None,
    margin: float | None = None,
    self_collision: bool | None = None,
) -> Plan:
    """Run a path as fast as a robot's limits allow, proven for all t.

    Args:
        path: waypoints (n, k) in rad; a CSV file with the header ``q1..qk`` or ``t,q1..qk``; a plan, or the folder of a
            run; a :class:`Trajectory` or a path with polynomial pieces.
        robot: that moves, with k joints, as for :func:`plan`; that of the plan, where the path is one.
        interpolation: of waypoints: ``spline``, or ``blend``: straight lines with rounded corners.
        tolerance: how far a blend may leave the lines, rad; with 0 the corners are stops.
        start_speed: ``|dq/dt|`` at the start, along the path, rad/s; 0, or that of the plan.
        goal_speed: at the end.
        total_time: bounds of T, (shortest, longest), s.
        obstacles: by which the motion is judged; it does not avoid them. Those of the plan, where the path is one.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.
        margin: what the robot keeps from obstacles, m.
        self_collision: whether its own bodies must not touch.

    Raises:
        ScenarioError: there is no motion along it, a file cannot be read, or an argument is wrong.
        InvalidRun: a folder is no run.
    """
    with in_words_of_python():
        content = content_of(path, interpolation, tolerance)
        if robot is not None:
            stated = robot_of(robot).content
            model = content.get("model", {}) | stated["model"]
            content = {**_without_robot(content), **stated, "model": model}
        elif not any(key in content for key in ("arm", "robot")):
            raise ScenarioError("robot: missing; say which robot runs the path, robot=tp.robot(...)")
        speeds = {"start_speed": start_speed, "goal_speed": goal_speed, "total_time": total_time}
        content["task"] |= _given(speeds)
        content["model"] = content.get("model", {}) | _given(
            {
                "margin": margin,
                "self_collision": self_collision,
                "limits": None if limits is None else several("limits", limits, "kinds of limits"),
            }
        )
        if obstacles is not None:
            content["obstacles"] = obstacle_tables(obstacles)
        return Plan(plan_scenario(parse_scenario(content)))


def _given(keys: Content) -> Content:
    return {key: plain(value) for key, value in keys.items() if value is not None}


def _without_robot(content: Content) -> Content:
    return {key: value for key, value in content.items() if key not in ("arm", "robot")}


def content_of(path: AnyPath, interpolation: str | None, tolerance: float | None) -> Content:
    """The tables of a scenario that a path states: [task], and of a plan what is around it.

    Raises:
        ScenarioError: it is no path.
    """
    shape = _given({"interpolation": interpolation, "tolerance": tolerance})
    if isinstance(path, str | Path) and not Path(path).is_dir():
        file = Path(path)
        return _of_rows(read_joint_rows(InputFolder(file.parent, outside_allowed=True), file.name), shape)
    if isinstance(path, str | Path):
        path = read_run(path)
    if not isinstance(path, Plan | JointPath | Trajectory):
        return _of_rows(plain(_waypoints(path)), shape)
    if shape:
        raise ScenarioError(f"{next(iter(shape))}: the path is complete; it is for waypoints")
    if isinstance(path, Plan):
        return _of_plan(path)
    return {"task": pieces_table(path if isinstance(path, JointPath) else JointPath.of(path))}


def _of_rows(rows: Any, shape: Content) -> Content:
    return {"task": {"kind": "joint-path", "joints": rows, **shape}}


def _of_plan(plan: Plan) -> Content:
    """The path of a plan, of the lowest degree that is known of it, and what the plan says of its surroundings."""
    try:
        task = path_table(plan.as_run())
    except ScenarioError as error:
        raise ScenarioError(f"path: {error}") from error
    content = plan.scenario.model_dump()
    model = {key: content["model"][key] for key in MODEL_KEYS}
    return {key: content[key] for key in SURROUNDINGS} | {"model": model, "task": task}


def _waypoints(path: Any) -> FloatArray:
    try:
        if np.iscomplexobj(path):
            raise TypeError("complex numbers")
        waypoints = np.asarray(path, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        reason = f"waypoints (n, k), a path, a plan, a file or a folder is needed: {error}"
        raise ScenarioError(f"path: {reason}") from error
    if waypoints.ndim != 2 or len(waypoints) < 2:
        raise ScenarioError(f"path: waypoints (n, k), two at least, are needed, not {shown(plain(path))}")
    if not (np.abs(waypoints) <= LARGEST_ANGLE).all():
        raise ScenarioError(f"path: an angle is not finite, or larger than {LARGEST_ANGLE:g} rad")
    return waypoints
