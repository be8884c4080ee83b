"""By how much a linear program may change when a motion passes its samples, where obstacles move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray


@dataclass(frozen=True)
class TimeShift:
    """A trust region of times.

    Attributes:
        passing: slopes of times at some samples with respect to speeds and delay, (p, M + 1).
        most: by how much each, and the delay, may change, s.
    """

    passing: FloatArray
    most: float

    def rows(self, free: int) -> tuple[FloatArray, FloatArray]:
        """Of a program with so many other variables before the speeds: (2 p, free + M + 1), and their bounds."""
        slopes = np.pad(self.passing, ((0, 0), (free, 0))) / self.most
        return np.concatenate([slopes, -slopes]), np.ones(2 * len(slopes))
