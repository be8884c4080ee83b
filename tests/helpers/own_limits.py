"""Limits of a user's own: one that scales with time without saying how, one that is not told to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Self

import casadi as ca

from problems import Constraint, Limit, Robot
from problems.base import Matrix
from problems.motions import Samples

FASTEST = 1.2  # m/s


@dataclass(frozen=True)
class TipSpeed(Limit):
    """The tip of a planar arm is never faster than ``FASTEST``: run slowly enough, every shape keeps it."""

    name: ClassVar[str] = "tip speed"
    robot: Robot

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Any) -> Self:
        return cls(robot)

    def magnitudes(self, samples: Samples) -> Matrix:
        angle, turn = ca.cumsum(samples.theta, 1), ca.cumsum(samples.speed, 1)
        lengths = ca.DM(self.robot.link_lengths)  # type: ignore[attr-defined]
        x, y = (ca.mtimes(part(angle) * turn, lengths) for part in (ca.sin, ca.cos))
        return ca.sqrt(x**2 + y**2)

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        speed, most = self.magnitudes(samples), ca.DM(FASTEST * (1.0 - margin))
        return [Constraint(name=self.name, unit="m/s", expression=speed, lower=None, upper=most, columns=("tip",))]

    @property
    def scales_with_time(self) -> bool:
        return True

    def time_scale(self, peaks: Matrix) -> Matrix:
        return peaks[0] / FASTEST


@dataclass(frozen=True)
class NotTooSoon(Limit):
    """The first joint is never faster than 1 rad/s; not told to scale with time."""

    name: ClassVar[str] = "not too soon"
    robot: Robot

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Any) -> Self:
        return cls(robot)

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        speed, most, names = samples.speed[:, 0], ca.DM(1.0), ("joint 1",)
        return [Constraint(name=self.name, unit="rad/s", expression=speed, lower=-most, upper=most, columns=names)]
