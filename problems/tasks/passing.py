"""When a motion passes places in a given order: the times that miss them least."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, as_array
from problems.motions.order import increasing_choice
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot
from problems.tasks.place import Place

SEARCHED_TIMES = 2001  # at which places are looked for, besides the breakpoints
NEWTON_STEPS = 12  # towards the exact time


def passing_times(robot: Robot, trajectory: Trajectory, places: Sequence[Place]) -> FloatArray:
    """The times that miss the places least, in their order, (places,), s.

    Of all increasing choices among many times the one with the smallest sum of squared distances (in units of each
    place's tolerance), found by dynamic programming; then Newton steps to where the distance is stationary.
    """
    if not places:
        return np.empty(0)
    times = np.unique(np.concatenate([trajectory.times(SEARCHED_TIMES), trajectory.breakpoints]))
    theta = ca.DM(trajectory.at(times))
    chosen = increasing_choice(np.array([_squared_miss(robot, place, theta) for place in places]))
    return np.array([_refined(robot, trajectory, place, times, i) for place, i in zip(places, chosen, strict=True)])


def _squared_miss(robot: Robot, place: Place, theta: ca.DM) -> FloatArray:
    missed = as_array(place.miss(robot, theta)) / place.tolerance(robot)
    return np.asarray(np.square(missed).sum(axis=1))


def _refined(robot: Robot, trajectory: Trajectory, place: Place, times: FloatArray, index: int) -> float:
    """The nearest time at which the distance is stationary, if it is smaller there."""
    low, high = times[max(index - 1, 0)], times[min(index + 1, times.size - 1)]
    q, t = ca.SX.sym("q", 1, robot.dof), float(times[index])
    miss = ca.Function("miss", [q], [place.miss(robot, q), ca.jacobian(place.miss(robot, q), q)])

    def distance(at: float) -> tuple[float, float, float]:
        residual, jacobian = (as_array(part) for part in miss(ca.DM(trajectory.at(np.array([at])))))
        slope = jacobian @ trajectory.at(np.array([at]), 1)[0]
        return float((residual**2).sum()), float(residual.ravel() @ slope), float(slope @ slope)

    best = t
    for _ in range(NEWTON_STEPS):
        _, gradient, curvature = distance(t)
        if curvature == 0.0:
            break
        t = float(np.clip(t - gradient / curvature, low, high))
        if distance(t)[0] < distance(best)[0]:
            best = t
    return best
