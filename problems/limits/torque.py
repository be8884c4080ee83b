"""The limit of what the motors give: ours, the paper has no dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca

from problems.base.errors import InvalidProblem
from problems.base.matrix import Matrix, largest
from problems.limits.constraint import Constraint, PenaltyKind
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle

LEAST_ROOM = 1e-6  # of a limit: what is left of it counts as at least this where gravity takes all of it


@dataclass(frozen=True)
class TorqueLimit(Limit):
    """``|tau_i(t)| <= max_torque_i`` for every joint i, with tau = M(q) a + C(q, v) v + g(q) + friction.

    Args:
        robot: whose masses are known.
    """

    name: ClassVar[str] = "torque"

    robot: Robot

    @classmethod
    def holding(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit, where the robot has one.

        Raises:
            InvalidProblem: it has one, but its masses are not known.
        """
        if robot.limits.torque is None:
            return None
        if robot.rigid_chain is None:
            raise InvalidProblem("max_torque", "torques can be limited only where masses are known")
        return cls(robot)

    @property
    def bounds(self) -> tuple[float, ...]:
        """The robot's largest torques, N m."""
        assert self.robot.limits.torque is not None
        return self.robot.limits.torque

    def at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The limit at each sample; no margin, as running more slowly makes up for what lies between."""
        bound = ca.horzcat(*self.bounds)
        return [
            Constraint(
                name=self.name,
                unit="N m",
                expression=samples.torque,
                lower=-bound,
                upper=bound,
                symmetric=True,
                columns=self.robot.joint_names,
                scale=bound,
                penalty=PenaltyKind.MAGNITUDE,
                formula="|tau_i(t_j)| <= max_torque_i, at every sample t_j",
            )
        ]

    @property
    def scales_with_time(self) -> bool:
        """Wherever the motors can hold the arm: what inertia takes falls with the square of the duration."""
        return True

    def magnitudes(self, samples: Samples) -> Matrix:
        """By what factor each sample has to be run more slowly for each joint, (n, dof); below 1 where faster will do.

        Run s times slower, torques are inertial / s^2 + viscous / s + held, so that with what gravity and Coulomb
        friction leave of the limit, s is the larger root of a quadratic equation.
        """
        chain, bound = samples.moving.massive, ca.repmat(ca.horzcat(*self.bounds), samples.count, 1)
        inertial = chain.inertial(samples.theta, samples.speed, samples.acceleration)
        viscous = chain.viscous(samples.speed)
        held = chain.gravitational(samples.theta) + chain.coulomb(samples.speed)
        above = _slower(inertial, viscous, ca.fmax(bound - held, LEAST_ROOM * bound))
        below = _slower(-inertial, -viscous, ca.fmax(bound + held, LEAST_ROOM * bound))
        return ca.fmax(above, below)

    def time_scale(self, peaks: Matrix) -> Matrix:
        """The largest of the factors."""
        return largest(peaks)


def _slower(inertial: Matrix, viscous: Matrix, room: Matrix) -> Matrix:
    """The least s with ``inertial / s'^2 + viscous / s' <= room`` for all s' >= s; 0 where there is none."""
    square = viscous * viscous + 4.0 * inertial * room
    return ca.fmax(0.0, (viscous + ca.sqrt(ca.fmax(0.0, square))) / (2.0 * room)) * (square >= 0.0)
