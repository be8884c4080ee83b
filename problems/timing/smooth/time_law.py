"""A smooth time law: the path parameter s over the share tau of the duration, a B-spline; and the motion it makes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np
from scipy.interpolate import BSpline
from scipy.sparse import csr_array

from problems.base.matrix import FloatArray
from problems.motions.joint_path import JointPath
from problems.motions.trajectory import Trajectory
from problems.timing.polynomials import composition
from problems.timing.speed_rows import Intervals

DEGREE = 4
BISECTIONS = 60
LEAST_SPAN = 1e-290  # s^n, an interval to the n-th power: dividing by less gives no number
SAME_TIME = 1e-9  # of the duration: a knot nearer to where the path changes its piece is left out


def averaged_knots(knots: FloatArray) -> FloatArray:
    """For each control point the tau that it is about, (controls,) (Greville abscissae)."""
    return np.asarray(np.lib.stride_tricks.sliding_window_view(knots[1:-1], DEGREE).mean(axis=1))


def operators(knots: FloatArray, tau: FloatArray, orders: int) -> list[csr_array]:
    """Matrices (n, controls) that turn control points into s, s', ... at tau (n,)."""
    every = BSpline(knots, np.eye(knots.size - DEGREE - 1), DEGREE)
    return [csr_array(every(tau, order)) for order in range(orders)]


@dataclass(frozen=True)
class TimeLaw:
    """A spline s(tau), not decreasing.

    Args:
        knots: of a clamped B-spline of degree ``DEGREE`` over [0, 1].
        controls: its control points, not decreasing, from the path's first parameter to its last.
    """

    knots: FloatArray
    controls: FloatArray

    @cached_property
    def _spline(self) -> BSpline:
        return BSpline(self.knots, self.controls, DEGREE)

    def at(self, tau: FloatArray, derivative: int = 0) -> FloatArray:
        """The parameter or a derivative of it with respect to tau, (n,)."""
        return np.asarray(self._spline(tau, derivative))

    def reaching(self, parameters: FloatArray) -> FloatArray:
        """The tau (n,) at which parameters are reached, by bisection."""
        low, high = np.zeros(parameters.size), np.ones(parameters.size)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2.0
            late = self.at(middle) >= parameters
            low, high = np.where(late, low, middle), np.where(late, middle, high)
        return high

    def trajectory(self, path: JointPath, duration: float) -> Trajectory:
        """The motion along a path in a duration in s: polynomials of ``DEGREE`` times the path's degree."""
        ends, crossed = path.breakpoints[[0, -1]], self.reaching(path.breakpoints[1:-1])
        inner = np.unique(self.knots)[1:-1]
        inner = inner[np.abs(inner[:, None] - crossed).min(axis=1, initial=1.0) > SAME_TIME]
        parameters = np.clip(self.at(inner), *ends)
        nodes = np.concatenate([ends, parameters, path.breakpoints[1:-1]])
        nodes, first = np.unique(nodes, return_index=True)
        tau = np.concatenate([[0.0, 1.0], inner, crossed])[first]
        steps, lengths = np.diff(tau), np.diff(nodes)
        local = [self.at(tau[:-1], n) * steps**n / factorial(n) / lengths for n in range(1, DEGREE + 1)]
        inside = np.stack([np.zeros_like(steps), *local])[..., None]
        scaled = composition(Intervals.of(path, nodes).local, inside)
        spans = (steps * duration) ** np.arange(len(scaled))[:, None]
        kept = spans > LEAST_SPAN  # terms beyond turn a joint by rounding at most: a law hardly bends in an interval
        coefficients = np.where(kept[..., None], scaled, 0.0) / np.where(kept, spans, 1.0)[..., None]
        return Trajectory(tau * duration, coefficients[::-1])
