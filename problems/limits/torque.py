"""Torque limits, in motion and at rest.

Running a motion more slowly takes away what inertia and viscous friction ask for, but not gravity and Coulomb friction:
a posture in which these take more than there is cannot be passed at any speed at which inertia does not help. That is
:class:`StaticTorque`, which stays to be kept where the rest is restored by time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem, Matrix, as_array, largest
from problems.limits.limit import Constraint, Limit, PenaltyKind
from problems.motions import LEAST_ROOM, Samples
from problems.robots import Robot, time_scales
from problems.scene import Obstacle


@dataclass(frozen=True)
class TorqueLimit(Limit):
    """``|tau_i(t)| <= max_torque_i`` for every joint i, with tau = M(q) a + C(q, v) v + g(q) + friction.

    Args:
        robot: whose masses are known.
    """

    name: ClassVar[str] = "torque"

    robot: Robot

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
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

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The limit at each sample; no margin, as running more slowly makes up for what lies between."""
        formula = "|tau_i(t_j)| <= max_torque_i, at every sample t_j"
        return [_within(self, samples.torque, ca.horzcat(*self.bounds), formula)]

    @property
    def scales_with_time(self) -> bool:
        """Wherever the motors can hold the arm: what inertia takes falls with the square of the duration."""
        return True

    @property
    def kept_by_scan(self) -> bool:
        """Where there is no viscous friction, which is not linear in (du/dt)^2."""
        return not self.robot.massive.has_damping

    @property
    def static_limits(self) -> tuple[Limit, ...]:
        """That the motors can hold the arm."""
        return (StaticTorque(self.robot),)

    def magnitudes(self, samples: Samples) -> Matrix:
        """By what factor each sample has to be run more slowly for each joint, (n, dof); below 1 where faster will do.

        Run s times slower, torques are inertial / s^2 + viscous / s + held, so that with what gravity and Coulomb
        friction leave of the limit, s is the larger root of a quadratic equation.
        """
        chain, bound = samples.moving.massive, ca.repmat(ca.horzcat(*self.bounds), samples.count, 1)
        theta, speed, acceleration = (samples.derivative_or_zero(order) for order in range(3))
        inertial = chain.inertial(theta, speed, acceleration)
        viscous = chain.viscous(speed)
        held = chain.gravitational(theta) + chain.coulomb(speed)
        above = time_scales(inertial, viscous, ca.fmax(bound - held, LEAST_ROOM * bound))
        below = time_scales(-inertial, -viscous, ca.fmax(bound + held, LEAST_ROOM * bound))
        return ca.fmax(above, below)

    def time_scale(self, peaks: Matrix) -> Matrix:
        """The largest of the factors."""
        return largest(peaks)


@dataclass(frozen=True)
class StaticTorque(Limit):
    """``|g_i(q) + friction_i sign(v_i)| <= (1 - share) max_torque_i``: a motion can be run slowly enough.

    Args:
        robot: whose masses are known and whose torques are limited.
    """

    name: ClassVar[str] = "static torque"

    robot: Robot

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The limit at each sample, with so much left that the motion need not be slowed down endlessly."""
        chain = samples.moving.massive
        held = chain.gravitational(samples.derivative_or_zero(0))
        if chain.has_friction:
            held = held + chain.coulomb(samples.speed)
        room = (1.0 - LEAST_ROOM) * ca.horzcat(*TorqueLimit(self.robot).bounds)
        return [_within(self, held, room, "|g_i(theta(t_j)) + friction| <= max_torque_i, at every sample t_j")]


def _within(limit: TorqueLimit | StaticTorque, torques: Matrix, bound: Matrix, formula: str) -> Constraint:
    """Torques (n, dof) no larger than bounds (1, dof)."""
    return Constraint(
        name=limit.name,
        unit="N m",
        expression=torques,
        lower=-bound,
        upper=bound,
        symmetric=True,
        columns=limit.robot.joint_names,
        scale=bound,
        penalty=PenaltyKind.MAGNITUDE,
        formula=formula,
    )


def holding_torques(robot: Robot, theta: FloatArray) -> FloatArray | None:
    """What holds postures (n, dof) where they are, (n, dof), N m; None for a robot without torque limits."""
    if robot.limits.torque is None or robot.rigid_chain is None:
        return None
    return as_array(robot.rigid_chain.gravitational(ca.DM(theta)))


def can_hold(robot: Robot, theta: FloatArray) -> NDArray[np.bool_]:
    """Which postures (n, dof) the motors can hold, (n,)."""
    torques = holding_torques(robot, theta)
    if torques is None:
        return np.ones(len(theta), dtype=bool)
    return np.asarray((np.abs(torques) <= np.array(robot.limits.torque)).all(axis=1))
