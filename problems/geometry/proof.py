"""Balls, and the proof that they hold a surface: every triangle is cut until each piece lies in one ball."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

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

    @cached_property
    def _tree(self) -> scipy.spatial.cKDTree:
        """Balls as points in four dimensions, of which the nearest to a point is the ball of least power.

        The power |p - c|^2 - r^2 is a squared distance once c is lifted by sqrt(R^2 - r^2), with R the largest radius.
        """
        lift = np.sqrt(np.maximum(self.radii.max() ** 2 - self.radii**2, 0.0))
        return scipy.spatial.cKDTree(np.column_stack([self.centers, lift]))

    def likeliest(self, points: FloatArray, count: int) -> NDArray[np.intp]:
        """Numbers of the balls of least power at points (n, 3): (n, count or as many as there are)."""
        lifted = np.column_stack([points, np.zeros(len(points))])
        _, numbers = self._tree.query(lifted, k=min(count, len(self)), workers=-1)
        return np.asarray(numbers).reshape(len(points), min(count, len(self)))


def unheld(corners: FloatArray, balls: Balls) -> FloatArray:
    """Points of triangles in no ball, or on the border of all, (m, 3), m; none where the balls hold all.

    At most ``MOST_SHOWN`` points are found. Coordinates have to be less than ``LARGEST_COORDINATE`` of covers: what
    rounding takes is derived in ``ball_tree.hpp``.

    Args:
        corners: of the triangles, (n, 3, 3), m.
        balls: that should hold them.
    """
    triangles = np.ascontiguousarray(corners, dtype=np.float64)
    numbers, points = np.column_stack([balls.centers, balls.radii]), np.empty((MOST_SHOWN, 3))
    count = needed_core().core_not_held(
        len(triangles), triangles.ctypes.data, len(numbers), numbers.ctypes.data, np.inf, MOST_SHOWN, points.ctypes.data
    )
    if count < 0:
        raise MemoryError("a proof that balls hold triangles")
    return points[: min(count, MOST_SHOWN)]
