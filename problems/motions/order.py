"""The best choice of increasing times: one for each of several things that have to happen in order."""

from __future__ import annotations

import numpy as np

from problems.base.matrix import FloatArray


def increasing_choice(costs: FloatArray) -> list[int]:
    """Indices i_1 <= i_2 <= ... with the smallest sum of ``costs[n, i_n]``, by dynamic programming.

    Args:
        costs: of each thing at each time, (things, times).
    """
    index = np.arange(costs.shape[1])
    best, origins = costs[0], []
    for cost in costs[1:]:
        least = np.minimum.accumulate(best)
        origins.append(np.maximum.accumulate(np.where(best == least, index, 0)))
        best = least + cost
    chosen = [int(np.argmin(best))]
    for origin in reversed(origins):
        chosen.append(int(origin[chosen[-1]]))
    return chosen[::-1]
