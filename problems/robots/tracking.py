"""How far joints may be from where they are planned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray, InvalidProblem, Operand, check_within

MOST = 0.5  # rad or m, s or s^2: what is larger is no robot that follows
LEAST_MOTION = 1e-12  # of what does not move
ROWS, ROUNDS, TOLERANCE = 100, 50, 1e-9  # that join a program at a time; programs; relative
MOST_TOGETHER = 1.0  # rad, of all joints that turn: farther than that bounds by levers say little


@dataclass(frozen=True)
class TrackingError:
    """A bound constant_j + speed_j |dq_j/dt| + acceleration_j |d2q_j/dt2| of joint j's distance from its plan.

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
        """The three parts of the bound, (3, dof)."""
        return np.array([self.constant, self.speed, self.acceleration])

    def at(self, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """The bounds at speeds and accelerations (n, dof): (n, dof), rad or m."""
        constant, by_speed, by_acceleration = self.numbers
        return np.asarray(constant + by_speed * np.abs(speed) + by_acceleration * np.abs(acceleration))

    def most(self, speed: Sequence[Operand], acceleration: Sequence[Operand]) -> tuple[Operand, ...]:
        """The largest bounds within limits of speed and acceleration, of each joint: (dof,)."""
        own = zip(self.constant, self.speed, self.acceleration, speed, acceleration, strict=True)
        return tuple(a + b * fast + c * sharp for a, b, c, fast, sharp in own)


def least_tracking_error(
    errors: FloatArray, speed: FloatArray, acceleration: FloatArray, constant_alone: bool = False, margin: float = 1.0
) -> TrackingError:
    """The least tracking error that bounds what was measured, by a linear program for each joint.

    It minimises the mean of the bound over the rows.

    Args:
        errors: how far joints were from where they were planned, (n, dof), rad or m.
        speed: planned, (n, dof).
        acceleration: likewise.
        constant_alone: whether the shares of speed and acceleration are to be zero.
        margin: by which everything is multiplied.

    Raises:
        InvalidProblem: a part is larger than any may be, or all are zero.
    """
    parts = [
        _least(np.abs(error), np.abs(fast), np.abs(sharp), constant_alone)
        for error, fast, sharp in zip(errors.T, speed.T, acceleration.T, strict=True)
    ]
    constant, by_speed, by_acceleration = margin * np.transpose(parts)
    return TrackingError(*(tuple(part.tolist()) for part in (constant, by_speed, by_acceleration)))


def _least(error: FloatArray, speed: FloatArray, acceleration: FloatArray, constant_alone: bool) -> FloatArray:
    if constant_alone or not error.any():
        return np.array([error.max(), 0.0, 0.0])
    scale = np.array([1.0, max(speed.max(), LEAST_MOTION), max(acceleration.max(), LEAST_MOTION)])
    rows = np.column_stack([np.ones_like(error), speed, acceleration]) / scale
    most, cost, shares = error.max(), rows.mean(axis=0), np.zeros(3)
    wanted, kept = error / most, np.empty(0, dtype=np.intp)
    for _ in range(ROUNDS):
        missing = wanted - rows @ shares
        if missing.max() <= TOLERANCE:
            break
        kept = np.union1d(kept, np.argsort(-missing)[:ROWS])  # few of many rows are tight
        found = scipy.optimize.linprog(
            cost, A_ub=-rows[kept], b_ub=-wanted[kept], bounds=(0.0, None), method="highs-ds"
        )
        shares = np.maximum(np.asarray(found.x, dtype=np.float64), 0.0)
    shares[0] += max(0.0, float((wanted - rows @ shares).max()))  # what tolerances leave
    return np.asarray(most * shares / scale)
