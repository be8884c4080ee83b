"""What of a motion's joints has limits on its size: speed, acceleration, jerk, and the torques of the motors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import casadi as ca
import numpy as np

from problems import Trajectory
from problems.base.matrix import FloatArray, as_array
from problems.robots.robot import Robot

STILL = 1e-9  # of a joint's limit of speed: at less it stands still, and Coulomb friction does not act


def torques_of(robot: Robot, trajectory: Trajectory, times: FloatArray) -> FloatArray | None:
    """Torques at times (n,) in s, gravity and friction included: (n, dof), N m or N; None where masses are not known.

    At the ends of a motion rounding would decide on the sign of Coulomb friction; a joint that stands still has none.
    """
    if robot.rigid_chain is None:
        return None
    theta, speed, acceleration = (trajectory.at(times, order) for order in range(3))
    speed = np.where(np.abs(speed) > STILL * np.array(robot.limits.speed), speed, 0.0)
    return as_array(robot.inverse_dynamics(*map(ca.DM, (theta, speed, acceleration))))


def _derivative(order: int) -> Callable[[Robot, Trajectory, FloatArray], FloatArray]:
    return lambda robot, trajectory, times: trajectory.at(times, order)


QUANTITIES: dict[str, Callable[[Robot, Trajectory, FloatArray], FloatArray | None]] = {
    "speed": _derivative(1),
    "acceleration": _derivative(2),
    "jerk": _derivative(3),
    "torque": torques_of,
}  # by the names that :class:`JointLimits` has for their limits; at times (n,): (n, dof)


def shares_of_limits(robot: Robot, trajectory: Trajectory, times: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """The quantities that the robot limits, at times (n,) in s, over their limits: names, and (n, dof), signed."""
    for name, quantity in QUANTITIES.items():
        limit = getattr(robot.limits, name)
        values = None if limit is None else quantity(robot, trajectory, times)
        if values is not None:
            yield name, values / np.array(limit)


def alternatives(units: Sequence[str]) -> str:
    """The units of joints as a label says them, those of turning joints first."""
    return " or ".join(sorted(set(units), reverse=True))
