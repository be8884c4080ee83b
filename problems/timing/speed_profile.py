"""How fast a path is run: the square b of du/dt, linear between the points of a grid; and the exact motion it makes.

Between two grid points du/dt changes at a constant rate in time, so that u is quadratic and q(u(t)) a polynomial in t.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.timing.polynomials import composition
from problems.timing.speed_rows import Intervals


@dataclass(frozen=True)
class SpeedProfile:
    """The squared speed of a path parameter.

    Args:
        nodes: N + 1 increasing parameters.
        squares: (du/dt)^2 there, (N + 1,), of two neighbours one at least positive.
    """

    nodes: FloatArray
    squares: FloatArray

    @property
    def durations(self) -> FloatArray:
        """Of the intervals, (N,), s."""
        speed = np.sqrt(self.squares)
        return np.asarray(2.0 * np.diff(self.nodes) / (speed[:-1] + speed[1:]))

    @property
    def times(self) -> FloatArray:
        """When the nodes are passed, (N + 1,), s."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    def seen_from(self, parameter: float) -> SpeedProfile:
        """The same over a parameter that is 0 there."""
        return SpeedProfile(self.nodes - parameter, self.squares)

    def parameters(self, times: FloatArray) -> FloatArray:
        """The parameters u at times (n,) in s, from 0 to the end."""
        nodes_at, speed = self.times, np.sqrt(self.squares)
        interval = np.clip(np.searchsorted(nodes_at, times, "right") - 1, 0, self.durations.size - 1)
        share = np.clip((times - nodes_at[interval]) / self.durations[interval], 0.0, 1.0)
        linear, quadratic = (part[interval] for part in _course(speed))
        return np.asarray(self.nodes[interval] + np.diff(self.nodes)[interval] * share * (linear + quadratic * share))

    def trajectory(self, intervals: Intervals) -> Trajectory:
        """The motion along a path, expanded over this profile's intervals: polynomials of twice its degree."""
        linear, quadratic = _course(np.sqrt(self.squares))
        w = np.stack([np.zeros_like(linear), linear, quadratic])[:, :, None]
        scaled = composition(intervals.local, w)
        powers = np.arange(len(scaled))[:, None]
        return Trajectory(self.times, (scaled / (self.durations**powers)[..., None])[::-1])


def _course(speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two coefficients of the share of an interval that is done, in the share of its duration, (N,) each."""
    total = speed[:-1] + speed[1:]
    return 2.0 * speed[:-1] / total, np.diff(speed) / total
