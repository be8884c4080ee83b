"""How far joints may be from where they are planned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from problems.base import FloatArray, InvalidProblem, Operand, check_within

MOST = 0.5  # rad or m, s or s^2: what is larger is no robot that follows
MOST_TOGETHER = 1.0  # rad, of all joints that turn: farther than that bounds by levers say little


@dataclass(frozen=True)
class TrackingError:
    """Joint j is never farther from its planned place than constant_j + speed_j |dq_j/dt| + acceleration_j |d2q_j/dt2|.

    At every time, whatever the other joints do; speed and acceleration are the planned ones.

    Args:
        constant: of each joint, rad, or m of one that slides.
        speed: share of the speed, s.
        acceleration: share of the acceleration, s^2.

    Raises:
        InvalidProblem: a number is negative or far too large, or all are zero.
    """

    constant: tuple[float, ...]
    speed: tuple[float, ...]
    acceleration: tuple[float, ...]

    def __post_init__(self) -> None:
        for part in fields(self):
            check_within("tracking_error", getattr(self, part.name), (0.0, MOST), "rad, m, s or s^2")
        if not any((*self.constant, *self.speed, *self.acceleration)):
            raise InvalidProblem("tracking_error", "it is zero everywhere: leave it out")

    @property
    def numbers(self) -> FloatArray:
        """Its three parts, (3, dof)."""
        return np.array([self.constant, self.speed, self.acceleration])

    def at(self, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """How far joints may be from their places at speeds and accelerations (n, dof): (n, dof), rad or m."""
        constant, by_speed, by_acceleration = self.numbers
        return np.asarray(constant + by_speed * np.abs(speed) + by_acceleration * np.abs(acceleration))

    def most(self, speed: Sequence[Operand], acceleration: Sequence[Operand]) -> tuple[Operand, ...]:
        """The same within limits of speed and acceleration, of each joint: (dof,)."""
        own = zip(self.constant, self.speed, self.acceleration, speed, acceleration, strict=True)
        return tuple(a + b * fast + c * sharp for a, b, c, fast, sharp in own)
