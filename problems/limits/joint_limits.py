"""Limits of single joints: derivatives, range, torque; and bounds of the duration of a motion.

Running a motion more slowly takes away what inertia and viscous friction ask for, but not gravity and Coulomb friction:
a posture in which these take more than there is cannot be passed at any speed at which inertia does not help. That is
:class:`StaticTorque`, which stays to be kept where the rest is restored by time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Self

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import (
    FloatArray,
    InvalidProblem,
    Matrix,
    Operand,
    Parametric,
    Relaxation,
    as_array,
    entry_changed,
    largest,
)
from problems.core import Dynamics
from problems.limits.limit import Constraint, Limit, PenaltyKind
from problems.motions import LEAST_TORQUE_SHARE, Samples
from problems.robots import Robot, time_scales
from problems.scene import Obstacle


@dataclass(frozen=True)
class DerivativeLimit(Limit):
    """The limit ``|d^n theta_i / dt^n| <= bound_i`` for every joint i.

    A kind states its order; its name is that of the bounds in the robot's record. All else is derived.

    Args:
        robot: whose joints.
    """

    robot: Robot

    order: ClassVar[int]
    unit: ClassVar[str]
    equation: ClassVar[str]

    @property
    def symbol(self) -> str:
        """The symbol of the derivative, as in the paper: dtheta_i, d2theta_i."""
        return f"d{self.order if self.order > 1 else ''}theta_i"

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        return None if cls(robot).bounds is None else cls(robot)

    @property
    def bounds(self) -> tuple[float, ...] | None:
        """The robot's bound of each joint, in ``unit``; None where it has none."""
        bounds: tuple[float, ...] | None = getattr(self.robot.limits, self.name)
        return bounds

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The limit at each sample; no margin, as time scaling makes up for what lies between."""
        assert self.bounds is not None
        formula = f"|{self.symbol}(t_j)| <= max_{self.name}_i, at every sample t_j"
        within = _within(self, samples.derivative(self.order), ca.horzcat(*self.bounds), self.unit, formula)
        return [replace(within, equation=self.equation)]

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        return _of_joints(self, self.unit)

    @property
    def scales_with_time(self) -> bool:
        """Always true, as any shape can be run slowly enough."""
        return True

    def magnitudes(self, samples: Samples) -> Matrix:
        """Absolute values, (n, dof)."""
        return ca.fabs(samples.derivative(self.order))

    def time_scale(self, peaks: Matrix) -> Matrix:
        assert self.bounds is not None
        ratio = largest(peaks / ca.horzcat(*self.bounds))
        roots = {1: ratio, 2: ca.sqrt(ratio)}
        return roots[self.order] if self.order in roots else ratio ** (1.0 / self.order)


@dataclass(frozen=True)
class SpeedLimit(DerivativeLimit):
    """The limit on speeds (11), (21): |dtheta_i(t)| <= dtheta_max."""

    name: ClassVar[str] = "speed"
    order: ClassVar[int] = 1
    unit: ClassVar[str] = "rad/s"
    equation: ClassVar[str] = "(11), (16)"


@dataclass(frozen=True)
class AccelerationLimit(DerivativeLimit):
    """The limit on accelerations (12), (22): |d2theta_i(t)| <= d2theta_max."""

    name: ClassVar[str] = "acceleration"
    order: ClassVar[int] = 2
    unit: ClassVar[str] = "rad/s^2"
    equation: ClassVar[str] = "(12), (17)"


@dataclass(frozen=True)
class JerkLimit(DerivativeLimit):
    """The limit on jerks |d3theta_i(t)| <= d3theta_max: ours, the paper has none."""

    name: ClassVar[str] = "jerk"
    order: ClassVar[int] = 3
    unit: ClassVar[str] = "rad/s^3"
    equation: ClassVar[str] = "-"


@dataclass(frozen=True)
class JointRange(Limit):
    """The limit ``lowest_i <= theta_i <= highest_i`` for every joint i.

    Args:
        robot: whose joints; it has position limits.
    """

    name: ClassVar[str] = "joint range"
    order: ClassVar[int | None] = 0
    within_tracking: ClassVar[bool] = True

    robot: Robot

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        return None if robot.limits.position is None else cls(robot)

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The ranges, kept by a share ``margin`` of each."""
        ranges = self.robot.limits.position
        assert ranges is not None
        lowest, highest = (ca.horzcat(*bound) for bound in zip(*ranges, strict=True))
        spare = margin * (highest - lowest)
        return [
            Constraint(
                name=self.name,
                unit="rad",
                expression=samples.theta,
                lower=lowest + spare,
                upper=highest - spare,
                columns=self.robot.joints.names,
                formula="lowest_i <= theta_i(t_j) <= highest_i, at every sample t_j",
            )
        ]

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        field = self.robot.range_field
        ranges: tuple[tuple[float, float], ...] = getattr(self.robot, field, None) or ()

        def wider(joint: int, by: float) -> dict[str, object]:
            low, high = ranges[joint]
            return {field: entry_changed(ranges, joint, (low - by, high + by))}

        units, names = self.robot.joints.units, self.robot.joints.names
        return tuple(
            Relaxation(
                limit=self.name, of=names[joint], statement=self.robot, values=partial(wider, joint),
                size=high - low, unit=units[joint],
            )
            for joint, (low, high) in enumerate(ranges)
        )  # fmt: skip


@dataclass(frozen=True)
class TorqueLimit(Limit):
    """The limit ``|tau_i(t)| <= max_torque_i``, with tau = M(q) a + C(q, v) v + g(q) + friction.

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
        return [_within(self, samples.torque, ca.horzcat(*self.bounds), "N m", formula)]

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        return _of_joints(self, "N m")

    @property
    def scales_with_time(self) -> bool:
        """Whether the motors can hold the arm: the torque of inertia falls with the square of the duration."""
        return True

    @property
    def ensured_by_scan(self) -> bool:
        """Whether there is no viscous friction, which is not linear in (du/dt)^2."""
        return not self.robot.dynamics.has_damping

    @property
    def static_limits(self) -> tuple[Limit, ...]:
        return (StaticTorque(self.robot),)

    def magnitudes(self, samples: Samples) -> Matrix:
        """The least factors by which samples must run more slowly for each joint, (n, dof); below 1 if faster will do.

        Run s times slower, torques are inertial / s^2 + viscous / s + held, so that with what gravity and Coulomb
        friction leave of the limit, s is the larger root of a quadratic equation.
        """
        chain, bound = samples.moving.dynamics, ca.repmat(ca.horzcat(*self.bounds), samples.count, 1)
        theta, speed, acceleration = (samples.derivative_or_zero(order) for order in range(3))
        inertial = chain.inertial(theta, speed, acceleration)
        viscous = chain.viscous(speed)
        held = chain.gravitational(theta) + chain.coulomb(speed)
        above = time_scales(inertial, viscous, ca.fmax(bound - held, LEAST_TORQUE_SHARE * bound))
        below = time_scales(-inertial, -viscous, ca.fmax(bound + held, LEAST_TORQUE_SHARE * bound))
        return ca.fmax(above, below)

    def time_scale(self, peaks: Matrix) -> Matrix:
        return largest(peaks)


@dataclass(frozen=True)
class StaticTorque(Limit):
    """The limit ``|g_i(q) + friction_i sign(v_i)| <= (1 - share) max_torque_i``, kept at any slow speed.

    Args:
        robot: whose masses are known and whose torques are limited.
    """

    name: ClassVar[str] = "static torque"

    robot: Robot

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The limit at each sample, with so much left that the motion need not be slowed down endlessly."""
        chain = samples.moving.dynamics
        held = chain.gravitational(samples.derivative_or_zero(0))
        if chain.has_friction:
            held = held + chain.coulomb(samples.speed)
        room = (1.0 - LEAST_TORQUE_SHARE) * ca.horzcat(*TorqueLimit(self.robot).bounds)
        formula = "|g_i(theta(t_j)) + friction| <= max_torque_i, at every sample t_j"
        return [_within(self, held, room, "N m", formula)]


def _within(
    limit: DerivativeLimit | TorqueLimit | StaticTorque, values: Matrix, bound: Matrix, unit: str, formula: str
) -> Constraint:
    """Values (n, dof) whose sizes are no larger than bounds (1, dof)."""
    return Constraint(
        name=limit.name,
        unit=unit,
        expression=values,
        lower=-bound,
        upper=bound,
        symmetric=True,
        columns=limit.robot.joints.names,
        scale=bound,
        penalty=PenaltyKind.MAGNITUDE,
        formula=formula,
    )


def _of_joints(limit: DerivativeLimit | TorqueLimit, unit: str) -> tuple[Relaxation, ...]:
    """The bounds of the joints one by one, where the robot states them in a field of that name."""
    robot, field = limit.robot, f"max_{limit.name}"
    bounds: tuple[float, ...] = getattr(robot, field, None) or ()

    def looser(joint: int, by: float) -> dict[str, object]:
        return {field: entry_changed(bounds, joint, bounds[joint] + by)}

    units_by_joint = (unit if turning == "rad" else _of_sliding(unit) for turning in robot.joints.units)
    each = zip(bounds, robot.joints.names, units_by_joint, strict=False)
    return tuple(
        Relaxation(
            limit=limit.name, of=name, statement=robot, values=partial(looser, joint), size=bound, unit=joint_unit
        )
        for joint, (bound, name, joint_unit) in enumerate(each)
    )


def _of_sliding(unit: str) -> str:
    """The unit of a joint that slides: m for rad, N for N m."""
    return unit.replace("rad", "m").replace("N m", "N")


def holding_torques(robot: Robot, theta: FloatArray) -> FloatArray | None:
    """Torques that hold postures (n, dof), (n, dof), N m; None for a robot without torque limits."""
    if robot.limits.torque is None or robot.rigid_chain is None:
        return None
    core = Dynamics.of(robot)
    if core is None:
        return as_array(robot.rigid_chain.gravitational(ca.DM(theta)))
    return core.torques(np.pad(theta, ((0, 0), (0, 2 * robot.dof))))[1]


def can_hold(robot: Robot, theta: FloatArray) -> NDArray[np.bool_]:
    """Whether the motors can hold each of the postures (n, dof), (n,)."""
    torques = holding_torques(robot, theta)
    if torques is None:
        return np.ones(len(theta), dtype=bool)
    return np.asarray((np.abs(torques) <= np.array(robot.limits.torque)).all(axis=1))


@dataclass(frozen=True)
class DurationBounds(Parametric):
    """The limit ``shortest <= t_i <= longest`` for every duration t_i of a finished motion, after time scaling.

    Args:
        name: of the constraint.
        symbol: of a duration; ``{}`` stands for its number where there are several.
        shortest: s.
        longest: s.
    """

    numbers: ClassVar[tuple[str, ...]] = ("shortest", "longest")

    name: str
    symbol: str
    shortest: float
    longest: float

    def at(self, durations: Matrix, margin: float = 0.0, spare: float = 0.0) -> Constraint:
        """The bounds of durations (1, n), s.

        Args:
            durations: of the motion or of its segments.
            margin: to keep below the longest, as a share of it: limits that a motion breaks between its samples
                slow it down afterwards.
            spare: to keep above the shortest, as a share of it: of a motion that cannot be slowed down afterwards.
        """
        count = int(durations.shape[1])
        symbols = tuple(self.symbol.format(number) for number in range(1, count + 1))
        return Constraint(
            name=self.name,
            unit="s",
            expression=durations,
            lower=ca.repmat(ca.horzcat(self.shortest * (1.0 + spare)), 1, count),
            upper=ca.repmat(ca.horzcat(self.with_margin(margin)), 1, count),
            columns=symbols,
            scale=ca.repmat(ca.horzcat(self.longest), 1, count),
            formula=f"shortest <= {', '.join(symbols)} <= longest, of the finished motion",
        )

    def with_margin(self, margin: float) -> Operand:
        """The longest duration less a margin, but never less than half-way from the shortest, s."""
        if margin == 0.0:
            return self.longest
        return ca.fmax(self.longest * (1.0 - margin), (self.shortest + self.longest) / 2.0)

    def search_box(self, margin: float) -> tuple[float, float]:
        """Bounds of a duration that is a decision variable, s."""
        return self.shortest, float(self.with_margin(margin))

    def time_scale(self, durations: FloatArray) -> float:
        """The smallest factor by which time must be multiplied for no duration (n,) in s to be too short."""
        return float(self.shortest / np.min(durations))
