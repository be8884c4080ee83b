"""The least time along a path that Python code or a file gives, with a proof."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from problems import InvalidProblem, LimitKind, Robot
from problems.assembly.joint_path import joint_following
from problems.base.matrix import FloatArray
from problems.motions.joint_path import JointPath
from problems.scene.obstacle import Obstacle
from problems.tasks.checks import check_choice
from problems.tasks.paths.joint_path import JointFollowing
from tpbso_casadi.planning.given_path import motion_along
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.tasks.joint_path import PATHS
from tpbso_casadi.scenario.tasks.joint_rows import LARGEST_ANGLE, read_joint_rows
from tpbso_casadi.storage.stored_run import path_of, read_run


def retime(
    path: FloatArray | JointPath | str | Path,
    robot: Robot,
    *,
    interpolation: str = "spline",
    tolerance: float | None = None,
    start_speed: float = 0.0,
    goal_speed: float = 0.0,
    obstacles: Sequence[Obstacle] = (),
    limits: Sequence[LimitKind] = (),
) -> Motion:
    """Run a path as fast as a robot's limits allow, proven for all t.

    Args:
        path: waypoints (n, k) in rad; a path; a CSV file with the header ``q1..qk`` or ``t,q1..qk``; or a run folder.
        robot: that moves, with k joints.
        interpolation: of waypoints: ``spline``, or ``blend``: straight lines with rounded corners.
        tolerance: how far a blend may leave the lines, rad.
        start_speed: |dq/dt| at the start, along the path, rad/s.
        goal_speed: at the end.
        obstacles: by which the motion is judged; it does not avoid them.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Returns:
        The motion: its ``trajectory``, ``verdicts``, ``status`` and ``objective``, the duration.

    Raises:
        InvalidProblem: there is no motion along it.
        ScenarioError: a file cannot be read.
        InvalidRun: a folder is no run.
    """
    given = _path_of(path, interpolation, tolerance)
    task = JointFollowing(robot, given, tuple(obstacles), start_speed, goal_speed)
    return motion_along(joint_following(task, limits))


def _path_of(path: FloatArray | JointPath | str | Path, interpolation: str, tolerance: float | None) -> JointPath:
    if isinstance(path, JointPath):
        return path
    if isinstance(path, (str, Path)):
        file = Path(path)
        if file.is_dir():
            return path_of(read_run(file))
        path = np.array(read_joint_rows(InputFolder(file.parent, outside_allowed=True), file.name))
    check_choice("interpolation", interpolation, PATHS)
    return PATHS[interpolation](_waypoints(path), tolerance)


def _waypoints(path: Any) -> FloatArray:
    try:
        if np.iscomplexobj(path):
            raise TypeError("complex numbers")
        waypoints = np.asarray(path, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidProblem("path", f"waypoints (n, k), a path, or a file or folder is needed: {error}") from error
    if (np.abs(waypoints) > LARGEST_ANGLE).any():
        raise InvalidProblem("path", f"an angle is larger than {LARGEST_ANGLE:g} rad")
    return waypoints
