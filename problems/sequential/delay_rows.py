"""By how much a linear program may change when a motion passes its samples, where obstacles move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray


@dataclass(frozen=True)
class DelayRows:
    """Changes of times as shares of the largest one that is allowed: like rows of limits, none before a step.

    Attributes:
        by_speeds: slopes with respect to the speeds, (rows, M).
    """

    by_speeds: FloatArray

    @property
    def values(self) -> FloatArray:
        """None, (rows,)."""
        return np.zeros(len(self.by_speeds))

    def slopes(self, moves: FloatArray) -> FloatArray:
        """With respect to moves (N k, free) of all control points, which change no time, and to the speeds."""
        return np.concatenate([np.zeros((len(self.by_speeds), moves.shape[1])), self.by_speeds], axis=1)


def delay_rows(passing: FloatArray, most: float) -> DelayRows:
    """The rows of some samples.

    Args:
        passing: how their times change with the speeds, (rows, M), s^2.
        most: the largest change, s.
    """
    return DelayRows(passing / most)
