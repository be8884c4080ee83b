"""Good candidates that differ from each other, collected during a search."""

from __future__ import annotations

import numpy as np

from solvers.box import Box, FloatArray

CAPACITY = 64
CANDIDATES_PER_BATCH = 4  # the best of each batch are considered
NICHE_WIDTH = 0.1  # share of the box: of two candidates closer than that in every coordinate only the better is kept


class Archive:
    """The best candidates of a search, none close to a better one; the best first.

    Attributes:
        x: candidates, (n, d).
        cost: of them, (n,), ascending.

    Args:
        box: of the search.
    """

    def __init__(self, box: Box) -> None:
        self._box = box
        self.x: FloatArray = np.empty((0, box.dimension))
        self.cost: FloatArray = np.empty(0)

    def add(self, candidates: FloatArray, cost: FloatArray) -> None:
        """Consider the best of a batch: candidates (m, d), costs (m,)."""
        span = np.where(self._box.span > 0.0, self._box.span, 1.0)
        for i in np.argsort(cost, kind="stable")[:CANDIDATES_PER_BATCH]:
            full = self.cost.size >= CAPACITY
            if not np.isfinite(cost[i]) or (full and cost[i] >= self.cost[-1]):
                return
            close = (np.abs(self.x - candidates[i]) < NICHE_WIDTH * span).all(axis=1)
            if (self.cost[close] <= cost[i]).any():
                continue
            x = np.vstack([self.x[~close], candidates[i]])
            costs = np.append(self.cost[~close], cost[i])
            order = np.argsort(costs, kind="stable")[:CAPACITY]
            self.x, self.cost = x[order], costs[order]
