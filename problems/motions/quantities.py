"""What an expression of one instant may speak of."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca

from problems.base import InvalidProblem, Matrix
from problems.motions.samples import Samples
from problems.robots import Robot, SpatialArm

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


MISSING = {  # why a robot has none of it
    "torque": "torques need masses, and those of this robot are not known",
    "rotation": "the rotation of the tool is known of robots in space only",
}


@dataclass(frozen=True, eq=False)
class MotionView:
    """One instant of a motion, as CasADi's symbols: columns that are indexed from 0.

    ``m.tool[1]`` is the height y of the tool of an arm in the plane; ``ca.sumsqr(m.speed)`` the sum of the squares of
    all joint speeds.

    Args:
        robot: that moves.
        value: the column (width, 1) of a quantity by its name.
    """

    robot: Robot
    value: Callable[[str], ca.SX] = field(repr=False)

    @property
    def q(self) -> ca.SX:
        """Joint positions, (dof, 1), rad (m where a joint slides)."""
        return self._of("q")

    @property
    def theta(self) -> ca.SX:
        """The same by the paper's name."""
        return self.q

    @property
    def speed(self) -> ca.SX:
        """Joint speeds, (dof, 1), rad/s."""
        return self._of("speed")

    @property
    def acceleration(self) -> ca.SX:
        """Joint accelerations, (dof, 1), rad/s^2."""
        return self._of("acceleration")

    @property
    def jerk(self) -> ca.SX:
        """Joint jerks, (dof, 1), rad/s^3."""
        return self._of("jerk")

    @property
    def torque(self) -> ca.SX:
        """What the motors give, (dof, 1), N m; of robots whose masses are known."""
        return self._of("torque")

    @property
    def tool(self) -> ca.SX:
        """Where the tool is, (2, 1) or (3, 1), m."""
        return self._of("tool")

    @property
    def tool_velocity(self) -> ca.SX:
        """How fast it moves, (2, 1) or (3, 1), m/s."""
        return self._of("tool_velocity")

    @property
    def rotation(self) -> ca.SX:
        """How the tool of a robot in space is turned: its rotation matrix, (3, 3); ``m.rotation[:, 2]`` is its z."""
        return ca.reshape(self._of("rotation"), 3, 3).T

    @property
    def positions(self) -> tuple[ca.SX, ...]:
        """Where the frames are, base first and tool last, each (2, 1) or (3, 1), m."""
        count = len(self.robot.positions(ca.DM.zeros(1, self.robot.dof)))
        return tuple(self._of(f"frame_{number}") for number in range(count))

    @property
    def time(self) -> ca.SX:
        """The time since the start, s."""
        return self._of("time")

    @property
    def duration(self) -> ca.SX:
        """How long the whole motion takes, s."""
        return self._of("duration")

    def _of(self, name: str) -> ca.SX:
        if not quantity_named(name).width(self.robot):
            raise InvalidProblem(name, MISSING.get(name, "the robot has none"))
        return self.value(name)
