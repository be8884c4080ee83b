"""An exact piecewise-polynomial joint trajectory: coefficients, not samples."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from scipy.interpolate import PPoly

from problems.base.matrix import FloatArray
from problems.motions.bernstein import bernstein, within
from problems.motions.samples import Samples
from problems.robots.robot import Robot

SAMPLED_ORDERS = 4  # angles, speeds, accelerations, jerks
SMOOTH_ORDERS = 3  # of which all but the jerks have to be continuous


@dataclass(frozen=True)
class Trajectory:
    """Joint angles over time.

    Args:
        breakpoints: p + 1 increasing times, s, the first 0.
        coefficients: (order, p, k), rad / s^n; as in SciPy's PPoly the highest power comes first and each piece
            starts its own time at 0.
    """

    breakpoints: FloatArray
    coefficients: FloatArray

    @classmethod
    def from_pieces(cls, durations: FloatArray, scaled: list[FloatArray]) -> Trajectory:
        """Join pieces given in normalised time.

        Args:
            durations: of the p pieces, s.
            scaled: p coefficient arrays (order_i, k) in rad, lowest power first, in powers of tau = t / duration.
        """
        order = max(piece.shape[0] for piece in scaled)
        coefficients = np.zeros((order, len(scaled), scaled[0].shape[1]))
        for index, (duration, piece) in enumerate(zip(durations, scaled, strict=True)):
            powers = np.arange(piece.shape[0])
            coefficients[order - 1 - powers, index] = piece / (duration**powers)[:, None]
        return cls(np.concatenate([[0.0], np.cumsum(durations)]), coefficients)

    @property
    def duration(self) -> float:
        """T in s."""
        return float(self.breakpoints[-1])

    @cached_property
    def _derivatives(self) -> tuple[PPoly, ...]:
        theta = PPoly(self.coefficients, self.breakpoints)
        return theta, *(theta.derivative(order) for order in range(1, SAMPLED_ORDERS + 1))

    def derivative(self, order: int) -> PPoly:
        """The joint angles (0), or a derivative of them, as a piecewise polynomial."""
        return self._derivatives[order]

    def at(self, times: FloatArray, derivative: int = 0) -> FloatArray:
        """Joint angles or a derivative of them, (n, k), at times (n,) in s; rad / s^derivative."""
        return np.asarray(self._derivatives[derivative](times))

    def samples(self, times: FloatArray, robot: Robot | None = None) -> Samples:
        """Angles, speeds, accelerations and jerks at times (n,) in s, increasing; numeric matrices (n, k)."""
        derivatives = tuple(ca.DM(self.at(times, n)) for n in range(SAMPLED_ORDERS))
        weights = np.convolve(np.pad(np.diff(times), 1), [0.5, 0.5], mode="valid")
        return Samples(
            robot=robot,
            derivatives=derivatives,
            duration=ca.DM(self.duration),
            times=ca.DM(np.asarray(times)),
            weights=ca.DM(weights),
        )

    def times(self, at_least: int) -> FloatArray:
        """At least so many times in s, equally spaced in each piece, every breakpoint among them."""
        pieces = self.breakpoints.size - 1
        intervals = int(np.ceil(max(at_least - 1, 1) / pieces))
        starts, durations = self.breakpoints[:-1, None], np.diff(self.breakpoints)[:, None]
        inner = starts + durations * np.arange(intervals) / intervals
        return np.append(inner.ravel(), self.duration)

    def extreme_times(self, derivative: int) -> FloatArray:
        """All times in s at which any joint's angle (0), speed (1), acceleration (2) or jerk (3) can be extreme.

        These are the breakpoints and the roots of the next derivative; the extremes over all t are at some of them.
        A derivative that jumps at a breakpoint is evaluated just before it too.
        """
        curve = self._derivatives[derivative + 1]
        times = [self.breakpoints]
        if derivative >= SMOOTH_ORDERS:
            times.append(np.nextafter(self.breakpoints[1:-1], 0.0))
        for joint in range(self.coefficients.shape[2]):
            roots = PPoly(curve.c[:, :, joint], curve.x).roots(discontinuity=False, extrapolate=False)
            times.append(roots[np.isfinite(roots)])
        return np.unique(np.concatenate(times))

    def largest_jump(self) -> float:
        """Largest jump of angle, speed or acceleration, ends not at rest included, relative to their largest values."""
        worst = 0.0
        h = np.diff(self.breakpoints)
        for derivative, curve in enumerate(self._derivatives[:SMOOTH_ORDERS]):
            powers = h[:, None] ** np.arange(curve.c.shape[0] - 1, -1, -1)
            starts, ends = np.asarray(curve.c[-1]), np.einsum("ipk,pi->pk", np.asarray(curve.c), powers)
            jumps = np.abs(starts[1:] - ends[:-1])
            if derivative > 0:
                jumps = np.concatenate([jumps, np.abs(starts[:1]), np.abs(ends[-1:])])
            extreme = np.abs(self.at(self.extreme_times(derivative), derivative)).max()
            scale = max(float(extreme), np.finfo(float).tiny)
            worst = max(worst, float(jumps.max(initial=0.0)) / scale)
        return worst

    def stays_within(self, derivative: int, lower: FloatArray, upper: FloatArray) -> bool:
        """Whether bounds (k,) of angles (0), speeds (1) or accelerations (2) are proven for all t."""
        curve = self._derivatives[derivative]
        return within(bernstein(np.asarray(curve.c), np.diff(self.breakpoints)), lower, upper)

    def time_scaled(self, factor: float) -> Trajectory:
        """The same path run ``factor`` times slower."""
        powers = np.arange(self.coefficients.shape[0] - 1, -1, -1)
        slower = self.coefficients / (factor**powers)[:, None, None]
        return Trajectory(self.breakpoints * factor, slower)
