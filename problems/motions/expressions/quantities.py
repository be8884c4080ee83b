"""What is known of a motion at one instant, by name: what an expression of a user's own may be made of."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca

from problems.base.errors import InvalidProblem
from problems.base.matrix import Matrix
from problems.motions.samples import Samples
from problems.robots.robot import Robot
from problems.robots.spatial.spatial_arm import SpatialArm

FRAME = re.compile(r"frame_(\d{1,4})")
ROTATION_ENTRIES = 9


@dataclass(frozen=True)
class Quantity:
    """One of them.

    Attributes:
        width: how many numbers it is for a robot.
        of: its values, (n, width), or (1, width) where it is the same at all times.
    """

    width: Callable[[Robot], int]
    of: Callable[[Samples], Matrix]


def quantity_named(name: str) -> Quantity:
    """The quantity of a name.

    Raises:
        KeyError: there is none.
    """
    frame = FRAME.fullmatch(name)
    return QUANTITIES[name] if frame is None else _frame(int(frame[1]))


def _derivative(order: int) -> Quantity:
    def of(samples: Samples) -> Matrix:
        if order >= len(samples.derivatives):
            raise InvalidProblem("constraints", f"this family of motions has no derivative {order} to sample")
        return samples.derivative(order)

    return Quantity(lambda robot: robot.dof, of)


def _frame(number: int) -> Quantity:
    def width(robot: Robot) -> int:
        frames = len(robot.positions(ca.DM.zeros(1, robot.dof)))
        return robot.dim if number < frames else 0

    return Quantity(width, lambda samples: samples.positions[number])


def _tool_velocity(samples: Samples) -> Matrix:
    """The velocity of the tool, (n, dim), m/s."""
    robot = samples.moving
    theta, speed = ca.SX.sym("theta", robot.dof), ca.SX.sym("speed", robot.dof)
    velocity = ca.jtimes(robot.tool(theta.T).T, theta, speed)
    of_state = ca.Function("tool_velocity", [theta, speed], [velocity], {"allow_free": True, "cse": True})
    return of_state(samples.theta.T, samples.speed.T).T


def _rotation(samples: Samples) -> Matrix:
    """The rotation matrix of the tool row by row, (n, 9)."""
    robot = samples.moving
    assert isinstance(robot, SpatialArm)
    return robot.tool_pose(samples.theta)[1]


def _times(samples: Samples) -> Matrix:
    if samples.times is None:
        raise InvalidProblem("constraints", "this family of motions does not say the time of its samples")
    return samples.times


QUANTITIES: dict[str, Quantity] = {
    "q": _derivative(0),
    "speed": _derivative(1),
    "acceleration": _derivative(2),
    "jerk": _derivative(3),
    "torque": Quantity(lambda robot: 0 if robot.rigid_chain is None else robot.dof, lambda samples: samples.torque),
    "tool": Quantity(lambda robot: robot.dim, lambda samples: samples.tool),
    "tool_velocity": Quantity(lambda robot: robot.dim, _tool_velocity),
    "rotation": Quantity(lambda robot: ROTATION_ENTRIES if isinstance(robot, SpatialArm) else 0, _rotation),
    "time": Quantity(lambda robot: 1, _times),
    "duration": Quantity(lambda robot: 1, lambda samples: ca.vec(samples.duration)),
}
