"""Where a time law needs knots: everywhere some, more in short pieces of its path, gradually."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from problems.base.matrix import FloatArray
from problems.timing.smooth.time_law import DEGREE

GRID = 4000  # points at which sizes are computed
GRADING = 0.4  # by how much intervals grow with the distance from a short piece
SHORTEST = 1e-5  # of the duration, an interval


def graded_knots(passed: FloatArray, count: int, per_piece: float, most: int) -> FloatArray:
    """Knots of a clamped B-spline over [0, 1].

    Args:
        passed: when the breakpoints of the path are passed, (p + 1,), shares of the duration.
        count: of intervals, were all equally long.
        per_piece: intervals in a piece of the path, about so many at least; fewer where there would be too many.
        most: intervals.
    """
    tau = np.union1d(np.linspace(0.0, 1.0, GRID), passed)
    done = _intervals_before(tau, passed, count, per_piece)
    while done[-1] > max(most, count + 1):
        per_piece /= 2.0
        done = _intervals_before(tau, passed, count, per_piece)
    inner = np.interp(np.linspace(0.0, done[-1], int(np.ceil(done[-1])) + 1), done, tau)
    return np.concatenate([np.zeros(DEGREE), [0.0], inner[1:-1], [1.0], np.ones(DEGREE)])


def _intervals_before(tau: FloatArray, passed: FloatArray, count: int, per_piece: float) -> FloatArray:
    """How many intervals there should be before each tau, (n,), increasing from 0."""
    size = np.full(tau.size, 1.0 / count)
    for start, end in pairwise(passed):
        away = np.maximum(np.maximum(start - tau, tau - end), 0.0)
        size = np.minimum(size, np.maximum((end - start) / per_piece, SHORTEST) + GRADING * away)
    density = 1.0 / size
    return np.concatenate([[0.0], np.cumsum(np.diff(tau) * (density[:-1] + density[1:]) / 2.0)])
