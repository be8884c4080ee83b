"""Stored motions: of the right make, smooth, and one the timing of the other."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems import Problem
from problems.motions.joint_path import JointPath
from problems.motions.trajectory import CONTINUOUS_ORDERS, SMOOTH_ORDERS, Trajectory
from problems.timing.following import departure
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.recomputation.agreement import TOLERANCE, Contradiction

MOST_COEFFICIENTS = 50  # of a piece: a path of degree 5 timed twice has 21
SAME_PATH = 1e-9  # rad, for angles up to 1 rad, and of larger ones


def check_trajectory(key: str, motion: Motion, problem: Problem[Any] | None) -> None:
    """Pieces one after the other from t = 0, as smooth as they have to be, with the velocities of the task at the ends.

    Args:
        key: of the motion in the result, for messages.
        motion: that is stored.
        problem: that has been searched; its motions have a fixed number of pieces unless they are timed path by path.

    Raises:
        Contradiction: they are not.
    """
    if problem is None or motion.free_timing:
        _check_shape(key, motion)
    else:
        lower, upper = problem.bounds
        _check_same_shape(key, motion.trajectory, problem.trajectory((lower + upper) / 2.0))
    trajectory, criteria = motion.trajectory, motion.criteria
    if trajectory.breakpoints.size != trajectory.coefficients.shape[1] + 1 or not _increase(trajectory):
        raise Contradiction(f"{key}.breakpoints: increasing times are needed, one more than pieces")
    orders = CONTINUOUS_ORDERS if motion.free_timing else SMOOTH_ORDERS
    jump = trajectory.largest_jump(criteria.task.end_velocities, orders, criteria.task.end_accelerations)
    if not jump <= TOLERANCE:
        how = "at rest" if not criteria.task.end_velocities.any() else "at the velocities of the task"
        raise Contradiction(f"{key}.coefficients: the pieces do not join smoothly, or not {how} (by {jump:.2g})")


def _increase(trajectory: Trajectory) -> bool:
    return bool((np.diff(trajectory.breakpoints) > 0.0).all())


def _check_shape(key: str, motion: Motion) -> None:
    order, _, joints = motion.trajectory.coefficients.shape
    if order > MOST_COEFFICIENTS or joints != motion.problem.robot.dof or motion.trajectory.breakpoints[0] != 0.0:
        dof = motion.problem.robot.dof
        raise Contradiction(f"{key}: at most {MOST_COEFFICIENTS} coefficients of {dof} joints from t = 0 are needed")


def _check_same_shape(key: str, trajectory: Trajectory, expected: Trajectory) -> None:
    if trajectory.coefficients.shape != expected.coefficients.shape or trajectory.breakpoints[0] != 0.0:
        order, pieces, joints = expected.coefficients.shape
        raise Contradiction(f"{key}: {order} coefficients of {pieces} pieces and {joints} joints from t = 0 are needed")


def check_follows(key: str, path: JointPath, trajectory: Trajectory) -> None:
    """A motion runs a path, for all t, whatever its timing.

    Raises:
        Contradiction: it leaves it, or that it does not cannot be proven.
    """
    away = departure(path, trajectory)
    if not away <= SAME_PATH * max(1.0, float(np.abs(path.at(path.breakpoints)).max())):
        raise Contradiction(f"{key}: leaves its path, by up to {away:.2g} rad")
