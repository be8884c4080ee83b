"""Limits on the square b of a path's speed du/dt: linear, and sufficient between grid points too.

Between two grid points b is linear, so that velocity squared q'^2 b and acceleration q' b'/2 + q'' b are polynomials
whose Bernstein coefficients are linear in the two values of b. If every coefficient keeps the limit, the polynomial
does.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import comb

import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.joint_path import JointPath
from problems.robots.robot import JointLimits
from problems.timing.polynomials import derivative, in_bernstein_form, product


@dataclass(frozen=True)
class Intervals:
    """A path over the intervals of a grid.

    Args:
        nodes: N + 1 increasing parameters, every breakpoint of the path among them.
        local: lowest power first, (order, N, k), rad; each interval over [0, 1].
    """

    nodes: FloatArray
    local: FloatArray

    @classmethod
    def of(cls, path: JointPath, nodes: FloatArray) -> Intervals:
        """Expand each piece of the path around the start of each interval in it."""
        piece = np.searchsorted(path.breakpoints, (nodes[:-1] + nodes[1:]) / 2.0) - 1
        ascending = path.coefficients[::-1][:, piece]
        order, start, length = len(ascending), nodes[:-1] - path.breakpoints[piece], np.diff(nodes)
        local = np.zeros_like(ascending)
        for n in range(order):
            for m in range(n, order):
                local[n] += comb(m, n) * ascending[m] * (start ** (m - n))[:, None]
            local[n] *= (length**n)[:, None]
        return cls(nodes, local)

    @property
    def lengths(self) -> FloatArray:
        """Of the intervals in the parameter, (N,)."""
        return np.diff(self.nodes)


def limit_rows(intervals: Intervals, limits: JointLimits) -> FloatArray:
    """Coefficients (N, rows, 2): for each interval and row, their product with b at its two ends must be <= 1."""
    first = derivative(intervals.local)
    velocity = weighted(product(first, first))
    bend = weighted(derivative(first))
    change = np.zeros_like(bend)
    change[: len(first)] = 0.5 * first[..., None] * np.array([-1.0, 1.0])
    scale = intervals.lengths[:, None, None] ** 2
    speed, most = (np.array(values)[:, None] for values in (limits.speed, limits.acceleration))
    acceleration = in_bernstein_form((bend + change) / (scale * most))
    rows = np.concatenate([in_bernstein_form(velocity / (scale * speed**2)), acceleration, -acceleration])
    return rows.transpose(1, 0, 2, 3).reshape(scale.size, -1, 2)


def steady_jerk_rows(intervals: Intervals, jerk: tuple[float, ...], share: float) -> FloatArray:
    """Rows (N, 2, 2) that bound b by the jerk limits' share at constant du/dt, which is d3q/du3 b^(3/2)."""
    third = derivative(derivative(derivative(intervals.local))) / intervals.lengths[:, None] ** 3
    most = (np.abs(in_bernstein_form(third)).max(axis=0) / (share * np.array(jerk))).max(axis=1) ** (2.0 / 3.0)
    return np.asarray(most[:, None, None] * np.eye(2))


def ceiling_rows(ceiling: FloatArray) -> FloatArray:
    """Rows (N, 2, 2) that keep b below a ceiling (N + 1,); none where that is zero, as at ends at rest."""
    shares = np.divide(1.0, ceiling, out=np.zeros_like(ceiling), where=ceiling > 0.0)
    return np.asarray(np.stack([shares[:-1], shares[1:]], axis=1)[:, :, None] * np.eye(2))


def weighted(ascending: FloatArray) -> FloatArray:
    """Polynomials (n, N, k) in w times 1 - w, and times w: (n + 1, N, k, 2)."""
    padded = np.pad(ascending, ((0, 1), (0, 0), (0, 0)))
    later = np.roll(padded, 1, axis=0)
    return np.stack([padded - later, later], axis=-1)


def necessary(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The rows that matter where both values of b are positive, by gift wrapping, all intervals at once.

    A row says something only where its coefficients are a corner of the convex hull of all, seen from above right.

    Args:
        rows: (N, rows, 2).

    Returns:
        The interval of each row kept, and its coefficients (kept, 2).
    """
    every = np.arange(len(rows))
    last = rows[every, _lexicographic(rows[..., 0], rows[..., 1])]
    kept_intervals, kept = [every], [last]
    active = every
    while active.size:
        away = rows[active] - last[:, None]
        up = away[..., 1] > 0.0
        slope = np.where(up, -away[..., 0] / np.where(up, away[..., 1], 1.0), np.inf)  # what a step up costs
        best = _lexicographic(-slope, away[..., 1])
        found = up.any(axis=1)
        active, last = active[found], rows[active, best][found]
        kept_intervals.append(active)
        kept.append(last)
    return np.concatenate(kept_intervals), np.concatenate(kept)


def _lexicographic(first: FloatArray, second: FloatArray) -> FloatArray:
    """Where the first (n, m) is largest in each row, of several where the second is."""
    return np.asarray(np.argmax(np.where(first == first.max(axis=1, keepdims=True), second, -np.inf), axis=1))
