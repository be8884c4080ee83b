"""``tp.retime``."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from problems import Limit, Obstacle, Trajectory
from problems.base import FloatArray, shown_value
from problems.motions import JointPath
from tpbso_casadi.facade.arguments import in_words_of_python, several
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.robots import AnyRobot
from tpbso_casadi.facade.statement import obstacles_of
from tpbso_casadi.facade.surroundings import Content, given_keys, scenario_around
from tpbso_casadi.planning import plan as plan_scenario
from tpbso_casadi.scenario import (
    LARGEST_ANGLE,
    OF_A_FILE,
    InputFolder,
    Scenario,
    ScenarioError,
    named,
    pieces_table,
    plain,
    read_joint_rows,
    reading_of,
)
from tpbso_casadi.storage import path_table, read_run

AnyPath: TypeAlias = FloatArray | JointPath | Trajectory | Plan | str | Path
SPEEDS = ("start_speed", "goal_speed")  # of a run, which another robot does not take over


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
    columns: str | None = None,
    prefix: str | None = None,
    unit: str | None = None,
    start: Sequence[float] | None = None,
    topic: str | None = None,
    message: int | None = None,
) -> Plan:
    """Run a path as fast as a robot's limits allow, proven for all t.

    Args:
        path: waypoints (n, k) in rad; a file of rows as of :func:`certify`, whose times are not used, or a table with
            the header ``q1..qk``; a plan, or the folder of a run; a :class:`Trajectory` or a path with polynomial
            pieces.
        robot: that moves, with k joints, as for :func:`plan`; or a TOML file with an [arm] or a [robot] table, whose
            obstacles and margin are judged too and whose unit is that of waypoints, tolerance and speeds. That of the
            plan, where the path is one; another one begins and ends at rest, unless speeds are stated.
        interpolation: of waypoints: ``spline``; ``blend``, straight lines with rounded corners; or ``fit``, for
            recordings, a smooth path near the lines between them, in which noise is evened out.
        tolerance: how far a blend or a fitted path may leave the lines, rad; with 0 the corners of a blend are stops.
        start_speed: ``|dq/dt|`` at the start, along the path, rad/s; 0, or that of the plan.
        goal_speed: at the end.
        total_time: bounds of T, (shortest, longest), s.
        obstacles: by which the motion is judged; it does not avoid them. Those of the plan, where the path is one.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.
        margin: what the robot keeps from obstacles, m.
        self_collision: whether its own bodies must not touch.
        columns: of a table, and what they hold, as ``actual_q_*=q*``; none where it says so itself.
        prefix: of names of joints: those that begin with it are read, without it.
        unit: of the rows, ``rad`` or ``deg``, of joints that turn, where it is not that of the robot's file.
        start: where the joints stand before the first row, in the unit of the rows.
        topic: of a bag of ROS, the one that is read.
        message: which trajectory of a bag, from 1 on; None of one that holds one.

    Raises:
        ScenarioError: there is no motion along it, a file cannot be read, or an argument is wrong.
        InvalidRun: a folder is no run.
    """
    with in_words_of_python():
        task = {
            "interpolation": interpolation, "tolerance": tolerance, "start_speed": start_speed,
            "goal_speed": goal_speed, "total_time": total_time, "columns": columns, "prefix": prefix, "unit": unit,
            "start": start, "topic": topic, "message": message,
        }  # fmt: skip
        further = None if limits is None else several("limits", limits, "kinds of limits")
        model = {"margin": margin, "self_collision": self_collision, "limits": further}
        around = None if obstacles is None else obstacles_of(obstacles)
        return Plan(plan_scenario(retimed_scenario(path, robot, task, model, around)))


def retimed_scenario(
    path: AnyPath,
    robot: AnyRobot | None,
    task: Content,
    model: Content | None = None,
    obstacles: list[Any] | None = None,
    payload: float | None = None,
) -> Scenario:
    """The scenario of a path that a robot runs as fast as its limits allow.

    Args:
        path: as of :func:`retime`.
        robot: likewise.
        task: keys of [task]; None of what is not stated, as of the other tables.
        model: keys of [model].
        obstacles: [[obstacles]] instead of those of the robot's file or of the plan.
        payload: what the tool carries, a mass at its own origin, kg; 0 for none.

    Raises:
        ScenarioError: naming the first wrong key.
        InvalidRun: a folder is no run.
    """
    stated = given_keys(task)
    given, around = content_of(path, {key: stated[key] for key in SHAPE if key in stated})
    if robot is not None:
        given = {key: value for key, value in given.items() if key not in SPEEDS}
    beside = {"obstacles": obstacles}
    given |= {key: value for key, value in stated.items() if key not in OF_A_FILE}
    return scenario_around(given, around, robot, model=model, beside=beside, payload=payload)


SHAPE = ("interpolation", "tolerance", "unit", "start", *OF_A_FILE)  # of waypoints


def content_of(path: AnyPath, shape: Content) -> tuple[Content, Scenario | None]:
    """The [task] table that a path states, and of a plan what is around it.

    Args:
        path: as of :func:`retime`.
        shape: keys of [task] that say how waypoints are read and joined.

    Raises:
        ScenarioError: it is no path, or complete without them.
    """
    if isinstance(path, str | Path) and not Path(path).is_dir():
        file = Path(path)
        rows = read_joint_rows(InputFolder(file.parent, outside_allowed=True), file.name, reading_of(shape))
        return {
            "kind": "joint-path",
            "joints": rows.positions,
            "joint_names": rows.joint_names,
            "notes": rows.notes,
        }, None
    of_a_file = next((key for key in OF_A_FILE if key in shape), None)
    if of_a_file is not None:
        raise ScenarioError(f"{of_a_file}: says how a file is read; this is none")
    if not isinstance(path, str | Path | Plan | JointPath | Trajectory):
        return {"kind": "joint-path", "joints": plain(_waypoints(path))}, None
    if shape:
        raise ScenarioError(f"{next(iter(shape))}: the path is complete; it is for waypoints")
    if isinstance(path, JointPath | Trajectory):
        return pieces_table(path if isinstance(path, JointPath) else JointPath.of(path)), None
    plan = path.planned if isinstance(path, Plan) else read_run(Path(path))
    with named("path" if isinstance(path, Plan) else path):
        task = path_table(plan)
    return task, plan.scenario


def _waypoints(path: Any) -> FloatArray:
    try:
        if np.iscomplexobj(path):
            raise TypeError("complex numbers")
        waypoints = np.asarray(path, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        reason = f"waypoints (n, k), a path, a plan, a file or a folder is needed: {error}"
        raise ScenarioError(f"path: {reason}") from error
    if waypoints.ndim != 2 or len(waypoints) < 2:
        raise ScenarioError(f"path: waypoints (n, k), two at least, are needed, not {shown_value(plain(path))}")
    if not (np.abs(waypoints) <= LARGEST_ANGLE).all():
        raise ScenarioError(f"path: an angle is not finite, or larger than {LARGEST_ANGLE:g} rad")
    return waypoints
