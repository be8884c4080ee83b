"""One instant of a motion as a function of a user's own sees it: ``lambda m: m.tool[1]``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca

from problems.base.errors import InvalidProblem
from problems.motions.expressions.quantities import quantity_named
from problems.robots.robot import Robot

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
