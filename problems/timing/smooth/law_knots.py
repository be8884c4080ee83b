"""Where a time law needs knots: everywhere some, more in short pieces of its path, gradually."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from problems.base.matrix import FloatArray
from problems.timing.smooth.time_law import DEGREE

GRID = 4000  # points at which sizes are computed
GRADING = 0.4  # by how much intervals grow with the distance from a short piece
SHORTEST = 1e-5  # of the duration, an interval


def graded_knots(passed: FloatArray, count: int, per_piece: int) -> FloatArray:
    """Knots of a clamped B-spline over [0, 1].

    Args:
        passed: when the breakpoints of the path are passed, (p + 1,), shares of the duration.
        count: of intervals, were all equally long.
        per_piece: intervals in a piece of the path, at least about so many.
    """
    tau = np.union1d(np.linspace(0.0, 1.0, GRID), passed)
    size = np.full(tau.size, 1.0 / count)
    for start, end in pairwise(passed):
        away = np.maximum(np.maximum(start - tau, tau - end), 0.0)
        size = np.minimum(size, np.maximum((end - start) / per_piece, SHORTEST) + GRADING * away)
    density = 1.0 / size
    done = np.concatenate([[0.0], np.cumsum(np.diff(tau) * (density[:-1] + density[1:]) / 2.0)])
    inner = np.interp(np.linspace(0.0, done[-1], int(np.ceil(done[-1])) + 1), done, tau)
    return np.concatenate([np.zeros(DEGREE), [0.0], inner[1:-1], [1.0], np.ones(DEGREE)])
