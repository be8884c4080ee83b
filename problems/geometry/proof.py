"""Balls, and the proof that they hold a surface: every triangle is cut until each piece lies in one ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from problems.library import needed_core

MOST_SHOWN = 10_000  # points that no ball holds


@dataclass(frozen=True, eq=False)
class Balls:
    """Balls that may hold a surface.

    Attributes:
        centers: (k, 3), m.
        radii: (k,), m.
    """

    centers: FloatArray
    radii: FloatArray

    def __len__(self) -> int:
        return len(self.radii)

    def combined(self, other: Balls) -> Balls:
        """The balls of both sets in one."""
        return Balls(np.concatenate([self.centers, other.centers]), np.concatenate([self.radii, other.radii]))

    def shrunk(self, length: float) -> Balls:
        """The balls with radii smaller by a length, m."""
        return Balls(self.centers, np.maximum(self.radii - length, 0.0))

    def overlaps(self, others: Balls) -> FloatArray:
        """How deep each of k balls lies in the one of these that it overlaps most, (k,), m; negative where apart."""
        one, two, depths = self._numbers(), others._numbers(), np.empty(len(others))
        addresses = one.ctypes.data, len(two), two.ctypes.data, depths.ctypes.data
        if needed_core().core_overlaps(len(one), *addresses) < 0:
            raise MemoryError("overlaps of balls")
        return depths

    def _numbers(self) -> FloatArray:
        return np.ascontiguousarray(np.column_stack([self.centers, self.radii]), dtype=np.float64)


def unheld(corners: FloatArray, balls: Balls) -> FloatArray:
    """Points of triangles in no ball, or on the border of all, (m, 3), m; none where the balls hold all.

    At most ``MOST_SHOWN`` points are found. Coordinates have to be less than ``LARGEST_COORDINATE`` of covers: what
    rounding takes is derived in ``ball_tree.hpp``.

    Args:
        corners: of the triangles, (n, 3, 3), m.
        balls: that should hold them.
    """
    triangles = np.ascontiguousarray(corners, dtype=np.float64)
    numbers, points = balls._numbers(), np.empty((MOST_SHOWN, 3))
    count = needed_core().core_not_held(
        len(triangles), triangles.ctypes.data, len(numbers), numbers.ctypes.data, np.inf, MOST_SHOWN, points.ctypes.data
    )
    if count < 0:
        raise MemoryError("a proof that balls hold triangles")
    return points[: min(count, MOST_SHOWN)]
