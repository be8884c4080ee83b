"""How a joint gets from rest to rest along (3) and (5) in little time, whatever the distance.

A profile is a point-to-point motion of one joint through 1 rad in 1 s. Limits scale: a way D takes
max(peak speed x D / v, sqrt(peak acceleration x D / a)). For a given share t1 / T least peaks are a linear program;
these are its solutions at the shares where descents, from one share or another, ended best.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.segments import QUARTIC, QUINTIC


@dataclass(frozen=True)
class Profile:
    """A motion through 1 rad in 1 s.

    Attributes:
        middle: theta_m - theta_s, rad.
        speed: dtheta_m, rad/s.
        share: t1 / T.
    """

    middle: float
    speed: float
    share: float

    @cached_property
    def peaks(self) -> tuple[float, float]:
        """Largest speed in rad/s and acceleration in rad/s^2, over all t."""
        t1, t2 = self.share, 1.0 - self.share
        bend = (6.0 * self.speed * t1 - 12.0 * self.middle) / t1**2  # ddtheta_m of (5)
        data = (
            np.array([0.0, self.middle, self.speed * t1]),
            np.array([self.middle, 1.0 - self.middle, self.speed * t2, bend * t2**2]),
        )
        pieces = [matrix @ part for matrix, part in zip((QUARTIC, QUINTIC), data, strict=True)]
        speed, acceleration = (
            max(_peak(piece, n) / t**n for piece, t in zip(pieces, (t1, t2), strict=True)) for n in (1, 2)
        )
        return speed, acceleration

    def duration(self, way: FloatArray, speed: FloatArray, acceleration: FloatArray, shortest: float) -> float:
        """The least T in s in which every joint keeps its limits.

        Args:
            way: displacements (k,), rad.
            speed: limits (k,), rad/s.
            acceleration: limits (k,), rad/s^2.
            shortest: of t1 and t2, s.
        """
        fastest, sharpest = self.peaks
        least = np.maximum(fastest * np.abs(way) / speed, np.sqrt(sharpest * np.abs(way) / acceleration))
        return max(float(least.max()), shortest / min(self.share, 1.0 - self.share))


def _peak(coefficients: FloatArray, derivative: int) -> float:
    """The largest absolute value in [0, 1] of a derivative of a polynomial, lowest power first."""
    curve = np.polynomial.Polynomial(coefficients).deriv(derivative)
    turns = curve.deriv().roots()
    inside = turns[(np.abs(turns.imag) < 1e-9) & (turns.real > 0.0) & (turns.real < 1.0)].real
    return float(np.abs(curve(np.concatenate([[0.0, 1.0], inside]))).max())


SKEWED = Profile(0.7208, 1.6776, 0.635)  # least acceleration
SYMMETRIC = Profile(0.5, 1.5, 0.5)
EARLY = Profile(0.3484, 1.5377, 0.4053)  # where speed and acceleration bind
EARLIEST = Profile(0.2274, 1.4639, 0.2732)  # where speed binds
PROFILES = (SKEWED, SYMMETRIC, EARLY, EARLIEST)
