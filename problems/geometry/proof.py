"""Proof that balls hold a surface: every triangle is cut until each piece lies in one ball.

A triangle lies in a ball when its corners do. The ball to ask is that of least power, |p - c|^2 - r^2, at the middle of
a piece: lifted by sqrt(R^2 - r^2) into a fourth dimension, with R the largest radius, it is the nearest of points.
Corners must lie deeper in a ball than :data:`DEPTH_MARGIN`, which is more than floating point takes from them: numbers
below 100 m are rounded by less than 1e-14 m, once for every cut.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.geometry.surface import halved, longest_sides

DEPTH_MARGIN = 1e-9  # m
CANDIDATES = 2  # balls that are asked about a piece
LEAST_PIECE = 1e-5  # m: a piece so small that lies in no ball is not held
PIECES_AT_ONCE = 200_000  # pieces


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
        lift = np.sqrt(np.maximum(self.radii.max() ** 2 - self.radii**2, 0.0))
        return scipy.spatial.cKDTree(np.column_stack([self.centers, lift]))

    @cached_property
    def _squares(self) -> FloatArray:
        return np.asarray(np.square(np.maximum(self.radii - DEPTH_MARGIN, 0.0)))

    def likeliest(self, points: FloatArray, count: int) -> NDArray[np.intp]:
        """Numbers of the balls of least power at points (n, 3): (n, count or as many as there are)."""
        lifted = np.column_stack([points, np.zeros(len(points))])
        _, numbers = self._tree.query(lifted, k=min(count, len(self)), workers=-1)
        return np.asarray(numbers).reshape(len(points), min(count, len(self)))

    def hold(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points (n, 3) lie in any of the balls, (n,)."""
        numbers = self.likeliest(points, 1)[:, 0]
        away = points - self.centers[numbers]
        return np.asarray(np.einsum("ij,ij->i", away, away) <= self._squares[numbers])

    def hold_pieces(self, pieces: FloatArray) -> NDArray[np.bool_]:
        """Whether triangles (n, 3, 3) surely lie in one ball each, (n,)."""
        numbers, held = self.likeliest(pieces.mean(axis=1), CANDIDATES), np.zeros(len(pieces), dtype=bool)
        for column in numbers.T:
            rows = np.flatnonzero(~held)
            away = pieces[rows] - self.centers[column[rows], None]
            held[rows] = (np.einsum("nij,nij->ni", away, away) <= self._squares[column[rows], None]).all(axis=1)
        return held


def unheld(corners: FloatArray, balls: Balls, resolution: float = np.inf) -> FloatArray:
    """Points of triangles in no ball, or on the border of all, (m, 3), m; none where the balls hold all.

    Args:
        corners: of the triangles, (n, 3, 3), m.
        balls: that should hold them.
        resolution: a piece no longer than that of which a corner lies in no ball is cut no more, m.
    """
    if not len(balls):
        return np.asarray(corners.mean(axis=1))
    waiting, found = [corners], []
    while waiting:
        pieces = waiting.pop()
        if len(pieces) > PIECES_AT_ONCE:
            waiting += [pieces[: len(pieces) // 2], pieces[len(pieces) // 2 :]]
            continue
        left = pieces[~balls.hold_pieces(pieces)]
        if not len(left):
            continue
        middles, lengths = left.mean(axis=1), longest_sides(left)
        lost = lengths <= LEAST_PIECE
        found.append(middles[lost])
        small = np.flatnonzero(~lost & (lengths <= resolution))
        bare = ~balls.hold(left[small].reshape(-1, 3)).reshape(-1, 3)
        some = bare.any(axis=1)
        found.append(left[small[some], np.argmax(bare[some], axis=1)])
        lost[small[some]] = True
        if not lost.all():
            waiting.append(halved(left[~lost]))
    return np.concatenate(found) if found else np.empty((0, 3))
