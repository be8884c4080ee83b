"""Triangles in numbers: cut, thinned, and how far points are from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray

CANDIDATES = 5  # pieces, of those with the nearest middles, to which a distance is computed


def longest_sides(corners: FloatArray) -> FloatArray:
    """The longest sides of triangles (n, 3, 3): (n,), m."""
    return np.asarray(np.sqrt(_squared_sides(corners).max(axis=1)))


def _squared_sides(corners: FloatArray) -> FloatArray:
    """Squared lengths of the sides opposite to corners 0, 1 and 2, (n, 3), m^2."""
    sides = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    return np.asarray(np.einsum("nij,nij->ni", sides, sides))


def halved(corners: FloatArray) -> FloatArray:
    """Two halves of every triangle, cut across its longest side, (2 n, 3, 3)."""
    rows, apex = np.arange(len(corners)), np.argmax(_squared_sides(corners), axis=1)
    top, one, two = (corners[rows, (apex + k) % 3] for k in range(3))
    middle = (one + two) / 2.0
    return np.concatenate([np.stack([top, one, middle], axis=1), np.stack([top, middle, two], axis=1)])


def pieces_of(corners: FloatArray, longest: float) -> FloatArray:
    """Triangles (n, 3, 3) cut until no side is longer, (m, 3, 3)."""
    waiting, done = corners, []
    while len(waiting):
        small = longest_sides(waiting) <= longest
        done.append(waiting[small])
        waiting = halved(waiting[~small])
    return np.concatenate(done) if done else corners


def thinned(points: FloatArray, cell: float) -> NDArray[np.intp]:
    """Numbers of points (n, 3) of which no two are in one cell of a lattice of so many m."""
    places = np.floor((points - points.min(axis=0)) / cell).astype(np.int64) if len(points) else np.empty((0, 3), int)
    sizes = places.max(axis=0) + 1 if len(points) else np.ones(3, int)
    keys = (places[:, 0] * sizes[1] + places[:, 1]) * sizes[2] + places[:, 2]
    return np.asarray(np.sort(np.unique(keys, return_index=True)[1]))


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface of small triangles, and distances from it.

    Attributes:
        pieces: (n, 3, 3), m.
    """

    pieces: FloatArray

    @cached_property
    def middles(self) -> FloatArray:
        """The middles of the pieces, (n, 3), m."""
        return np.asarray(self.pieces.mean(axis=1))

    @cached_property
    def _tree(self) -> scipy.spatial.cKDTree:
        return scipy.spatial.cKDTree(self.middles)

    def distances(self, points: FloatArray) -> FloatArray:
        """Distances of points (m, 3) from the nearest of the pieces with the nearest middles, (m,), m."""
        nearest = min(CANDIDATES, len(self.pieces))
        _, numbers = self._tree.query(points, k=nearest, workers=-1)
        each = np.asarray(numbers).reshape(len(points), nearest).T
        squares = np.min([_squared_distances(points, self.pieces[one]) for one in each], axis=0)
        return np.asarray(np.sqrt(squares))


def _squared_distances(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Squared distances of points (n, 3) from triangles (n, 3, 3) one by one, (n,), m^2.

    Source: C. Ericson, Real-Time Collision Detection (2005), 5.1.5.
    """
    one, two, three = corners[:, 0], corners[:, 1], corners[:, 2]
    along, across, away = two - one, three - one, points - one
    aa, ab, bb = (np.einsum("ij,ij->i", p, q) for p, q in ((along, along), (along, across), (across, across)))
    pa, pb = (np.einsum("ij,ij->i", away, side) for side in (along, across))
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = (bb * pa - ab * pb) / (aa * bb - ab**2), (aa * pb - ab * pa) / (aa * bb - ab**2)
    above = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    foot = away - np.where(above, u, 0.0)[:, None] * along - np.where(above, v, 0.0)[:, None] * across
    plane = np.where(above, np.einsum("ij,ij->i", foot, foot), np.inf)
    sides = [_from_side(points, p, q) for p, q in ((one, two), (two, three), (three, one))]
    return np.asarray(np.minimum.reduce([plane, *sides]))


def _from_side(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    side, away = end - start, points - start
    squared = np.einsum("ij,ij->i", side, side)
    share = np.einsum("ij,ij->i", away, side) / np.where(squared > 0.0, squared, 1.0)
    foot = away - np.clip(share, 0.0, 1.0)[:, None] * side
    return np.asarray(np.einsum("ij,ij->i", foot, foot))
