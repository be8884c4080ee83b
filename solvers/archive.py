"""Good candidates that differ from each other, kept while a search goes on."""

from __future__ import annotations

import numpy as np

from solvers.box import Box, FloatArray

CAPACITY = 64
LOOKED_AT = 4  # of the best of each batch
NICHE = 0.1  # of the box: of two candidates nearer than that in every coordinate only the better is kept


class Archive:
    """The best candidates of a search, none near a better one.

    Args:
        box: of the search.
    """

    def __init__(self, box: Box) -> None:
        self._box = box
        self.x: FloatArray = np.empty((0, box.dimension))
        self.cost: FloatArray = np.empty(0)

    def add(self, candidates: FloatArray, cost: FloatArray) -> None:
        """Look at the best of a batch: candidates (m, d), costs (m,). Worst ones give way, best come first."""
        span = np.where(self._box.span > 0.0, self._box.span, 1.0)
        for i in np.argsort(cost, kind="stable")[:LOOKED_AT]:
            full = self.cost.size >= CAPACITY
            if not np.isfinite(cost[i]) or (full and cost[i] >= self.cost[-1]):
                return
            near = (np.abs(self.x - candidates[i]) < NICHE * span).all(axis=1)
            if (self.cost[near] <= cost[i]).any():
                continue
            x = np.vstack([self.x[~near], candidates[i]])
            costs = np.append(self.cost[~near], cost[i])
            order = np.argsort(costs, kind="stable")[:CAPACITY]
            self.x, self.cost = x[order], costs[order]
