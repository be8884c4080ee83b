"""Limits of a derivative of the joint angles: speed (11), (21), acceleration (12), (22), and any higher order."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca

from problems.base.matrix import Matrix, largest
from problems.limits.constraint import Constraint, PenaltyKind
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle


@dataclass(frozen=True)
class DerivativeLimit(Limit):
    """``|d^n theta_i / dt^n| <= bound_i`` for every joint i.

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
    def holding(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit, where the robot has one."""
        return None if cls(robot).bounds is None else cls(robot)

    @property
    @abstractmethod
    def bounds(self) -> tuple[float, ...] | None:
        """The robot's bound of each joint, in ``unit``; None where it has none."""

    def at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The limit at each sample; no margin, as time scaling makes up for what lies between."""
        assert self.bounds is not None
        bound = ca.horzcat(*self.bounds)
        return [
            Constraint(
                name=self.name,
                equation=self.equation,
                unit=self.unit,
                expression=samples.derivative(self.order),
                lower=-bound,
                upper=bound,
                symmetric=True,
                columns=self.robot.joint_names,
                scale=bound,
                penalty=PenaltyKind.MAGNITUDE,
                formula=f"|{self.symbol}(t_j)| <= max_{self.name}_i, at every sample t_j",
            )
        ]

    @property
    def scales_with_time(self) -> bool:
        """Always: any shape can be run slowly enough."""
        return True

    def magnitudes(self, samples: Samples) -> Matrix:
        """Absolute values, (n, dof)."""
        return ca.fabs(samples.derivative(self.order))

    def time_scale(self, peaks: Matrix) -> Matrix:
        """The n-th root of the largest ratio of a joint's peak to its bound."""
        assert self.bounds is not None
        ratio = largest(peaks / ca.horzcat(*self.bounds))
        roots = {1: ratio, 2: ca.sqrt(ratio)}
        return roots[self.order] if self.order in roots else ratio ** (1.0 / self.order)


@dataclass(frozen=True)
class SpeedLimit(DerivativeLimit):
    """(11), (21): |dtheta_i(t)| <= dtheta_max."""

    name: ClassVar[str] = "speed"
    order: ClassVar[int] = 1
    unit: ClassVar[str] = "rad/s"
    equation: ClassVar[str] = "(11), (16)"

    @property
    def bounds(self) -> tuple[float, ...] | None:
        """The robot's largest joint speeds, rad/s."""
        return self.robot.limits.speed


@dataclass(frozen=True)
class AccelerationLimit(DerivativeLimit):
    """(12), (22): |d2theta_i(t)| <= d2theta_max."""

    name: ClassVar[str] = "acceleration"
    order: ClassVar[int] = 2
    unit: ClassVar[str] = "rad/s^2"
    equation: ClassVar[str] = "(12), (17)"

    @property
    def bounds(self) -> tuple[float, ...] | None:
        """The robot's largest joint accelerations, rad/s^2."""
        return self.robot.limits.acceleration


@dataclass(frozen=True)
class JerkLimit(DerivativeLimit):
    """|d3theta_i(t)| <= d3theta_max: ours, the paper has none."""

    name: ClassVar[str] = "jerk"
    order: ClassVar[int] = 3
    unit: ClassVar[str] = "rad/s^3"
    equation: ClassVar[str] = "-"

    @property
    def bounds(self) -> tuple[float, ...] | None:
        """The robot's largest jerks, rad/s^3."""
        return self.robot.limits.jerk
