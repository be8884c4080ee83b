"""Postures that a traced path may begin in."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
from scipy.linalg import qr

from problems.base import FloatArray, InvalidProblem, as_array
from problems.limits import can_hold, proximity_limits
from problems.motions import Samples
from problems.robots import postures, tool_jacobian
from problems.tasks import PathKnots, SpaceTracing, overloaded

SEED = 0  # of the random postures from which inverse kinematics starts: the same for every search
MOST_FOLLOWED = 64  # postures that are led along the path
MOST_STARTS = 8  # among which a search chooses
NULL_SINGULAR_VALUE = 1e-6  # relative: less moves nothing
IDLE = 1e-6  # m or rad per rad, by which a joint moves the tool that does not

Follower = Callable[[FloatArray], FloatArray]  # from postures (n, dof) to those at all knots, (n, M, dof)


def clear_postures(task: SpaceTracing, knots: PathKnots) -> FloatArray:
    """Postures with the tool at the first knot that touch nothing and that the motors can hold, (n, dof).

    Raises:
        InvalidProblem: inverse kinematics finds none, or every one touches something or cannot be held.
    """
    rotation = None if knots.rotations is None else knots.rotations[0]
    found = postures(task.robot, knots.points[0], rotation, np.random.default_rng(SEED))
    if not len(found):
        what = "point" if rotation is None else "pose"
        raise InvalidProblem("points", f"points[0]: inverse kinematics finds no posture with the tool at this {what}")
    times = ca.DM.zeros(len(found), 1)
    samples = Samples(robot=task.robot, derivatives=(ca.DM(found),), duration=ca.DM(1.0), times=times)
    clear = np.ones(len(found), dtype=bool)
    for limit in proximity_limits(task.robot, task.obstacles):
        clear &= (as_array(limit.clearances(samples)) >= task.robot.margin).all(axis=1)
    if not clear.any():
        raise InvalidProblem("points", f"points[0]: each of {len(found)} postures there touches something")
    held = can_hold(task.robot, found) & clear
    if not held.any():
        reason = overloaded(task.robot, found[clear][0])
        raise InvalidProblem("points", f"points[0]: none of {clear.sum()} clear postures there can be held; {reason}")
    return spread(found[held], MOST_FOLLOWED)


def spread(theta: FloatArray, most: int) -> FloatArray:
    """At most so many of the postures (n, dof), each as far as can be from those before it."""
    chosen = [0]
    away = np.abs(theta - theta[0]).max(axis=1)
    while len(chosen) < min(most, len(theta)):
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.abs(theta - theta[chosen[-1]]).max(axis=1))
    return np.asarray(theta[chosen])


def best_starts(task: SpaceTracing, knots: PathKnots, theta: FloatArray, follow: Follower) -> FloatArray:
    """The few starts (m, dof) from which the path is followed farthest, and among those with the least turning.

    Args:
        task: whose robot.
        knots: of the path.
        theta: starts, (n, dof).
        follow: leads starts along the path.
    """
    followed = follow(theta)
    count, knots_count, dof = followed.shape
    tool = task.robot.tool_at(followed.reshape(-1, dof))[0].reshape(count, knots_count, -1)
    missed = (np.linalg.norm(tool - knots.points, axis=2) > task.accuracy).sum(axis=1)
    turning = np.abs(np.diff(followed, axis=1) / task.robot.limits.speed).max(axis=2).sum(axis=1)
    return np.asarray(theta[np.lexsort((turning, missed))[:MOST_STARTS]])


def wandering_joints(task: SpaceTracing, theta: FloatArray) -> tuple[int, ...]:
    """Joints that can wander off while the tool stays: as many as there are such motions, those that take part most.

    Args:
        task: whose robot.
        theta: postures, (n, dof).
    """
    rows = 3 if task.angular_accuracy is None else 6
    jacobians = [as_array(tool_jacobian(task.robot, ca.DM(posture).T))[:rows] for posture in theta]
    moving = np.abs(jacobians).max(axis=(0, 1)) > IDLE
    free, count = np.zeros((task.robot.dof,) * 2), 0
    for jacobian in jacobians:
        own = jacobian[:, moving]
        _, values, right = np.linalg.svd(own)
        rank = int((values > NULL_SINGULAR_VALUE * values[0]).sum())
        null = right[rank:]
        count = max(count, len(own[0]) - rank)
        free[np.ix_(moving, moving)] += null.T @ null
    _, _, order = qr(free, pivoting=True)
    return tuple(sorted(int(joint) for joint in order[:count]))
