"""Signed distances of points from solids. Formulas as in :mod:`problems.scene.solids`.

Points come as coordinates along a solid's own axes, from its centre, in arrays of any shape; sizes, three for each
solid, in arrays that go with these. Only where a distance is less than enough has it to be known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.scene import Shape

LEAST_SQUARE = 1e-30
ELLIPSOID_STEPS = 4
ON_FACE = 1e-9  # m

Tables: TypeAlias = tuple[FloatArray, ...]
Formula: TypeAlias = Callable[[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
SolidNumbers: TypeAlias = tuple[int, FloatArray, FloatArray, FloatArray, Tables]


def _length(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(x * x + y * y + z * z))


def from_ball(x: FloatArray, y: FloatArray, z: FloatArray, sizes: FloatArray, enough: FloatArray) -> FloatArray:
    """Distances from a ball of a radius."""
    return np.asarray(_length(x, y, z) - sizes[0])


def from_box(x: FloatArray, y: FloatArray, z: FloatArray, sizes: FloatArray, enough: FloatArray) -> FloatArray:
    """Distances from a box of half sides."""
    x, y, z = np.abs(x) - sizes[0], np.abs(y) - sizes[1], np.abs(z) - sizes[2]
    deepest = np.maximum(np.maximum(x, y), z)
    outside = _length(np.maximum(x, 0.0), np.maximum(y, 0.0), np.maximum(z, 0.0))
    return np.asarray(np.where(deepest > 0.0, outside, deepest))


def from_capsule(x: FloatArray, y: FloatArray, z: FloatArray, sizes: FloatArray, enough: FloatArray) -> FloatArray:
    """Distances from a capsule of a radius and half a length."""
    return np.asarray(_length(x, y, np.maximum(np.abs(z) - sizes[1], 0.0)) - sizes[0])


def from_cylinder(x: FloatArray, y: FloatArray, z: FloatArray, sizes: FloatArray, enough: FloatArray) -> FloatArray:
    """Distances from a cylinder of a radius and half a length."""
    around, along = np.sqrt(x * x + y * y) - sizes[0], np.abs(z) - sizes[1]
    deepest, u, v = np.maximum(around, along), np.maximum(around, 0.0), np.maximum(along, 0.0)
    return np.asarray(np.where(deepest > 0.0, np.sqrt(u * u + v * v), deepest))


def from_ellipsoid(x: FloatArray, y: FloatArray, z: FloatArray, sizes: FloatArray, enough: FloatArray) -> FloatArray:
    """Lower bounds of distances from an ellipsoid: beyond the tangent plane whose normal Newton's method finds."""
    coordinates, a = (x, y, z), sizes
    t = np.zeros(np.broadcast_shapes(x.shape, a[0].shape))
    for i, p in enumerate(coordinates):
        t = np.maximum(t, a[i] * np.abs(p) - a[i] * a[i])
    for _ in range(ELLIPSOID_STEPS):
        square, slope = np.full(t.shape, LEAST_SQUARE), np.full(t.shape, LEAST_SQUARE)
        for i, p in enumerate(coordinates):
            w = a[i] * p / (t + a[i] * a[i])
            square += w * w
            slope += w * w / (t + a[i] * a[i])
        t = np.maximum(0.0, t + (np.sqrt(square) - 1.0) * square / slope)
    shortest = np.minimum(a[0], np.minimum(a[1], a[2]))
    beyond, extent, norm = (
        np.zeros(t.shape),
        np.full(t.shape, LEAST_SQUARE),
        LEAST_SQUARE / (shortest * shortest) + np.zeros(t.shape),
    )
    for i, p in enumerate(coordinates):
        n = p / (t + a[i] * a[i])
        beyond += n * p
        extent += a[i] * a[i] * n * n
        norm += n * n
    return np.asarray((beyond - np.sqrt(extent)) / np.sqrt(norm))


def from_half_space(x: FloatArray, y: FloatArray, z: FloatArray, sizes: FloatArray, enough: FloatArray) -> FloatArray:
    """Distances from a half-space: heights above it."""
    return z


@dataclass(frozen=True, eq=False)
class Polytope:
    """A convex solid of planes: normal and how far along it, four numbers each.

    Attributes:
        planes: of a hull around it, (n, 4).
        faces: of itself, (m, 4).
        edges: of these, where one begins and the way along it, (e, 6), m.
    """

    planes: FloatArray
    faces: FloatArray
    edges: FloatArray

    def __call__(
        self, x: FloatArray, y: FloatArray, z: FloatArray, sizes: FloatArray, enough: FloatArray
    ) -> FloatArray:
        """Lower bounds of distances; above enough, any number above it."""
        points = np.stack([x.ravel(), y.ravel(), z.ravel()])
        found: FloatArray = _beyond(self.planes, points).max(axis=0)
        near = np.flatnonzero(~(found >= enough.ravel()))
        if near.size:
            found[near] = self._from_faces(points[:, near])
        return found.reshape(x.shape)

    def _from_faces(self, points: FloatArray) -> FloatArray:
        """Distances exact to ON_FACE, and never larger: by an edge where the foot on the face seen is beside it."""
        heights = _beyond(self.faces, points)
        face = heights.argmax(axis=0)
        far: FloatArray = np.take_along_axis(heights, face[None], axis=0)[0]
        foot = points - far * self.faces[face, :3].T
        beside = np.flatnonzero((far > 0.0) & (_beyond(self.faces, foot).max(axis=0) > ON_FACE))
        if beside.size:
            far[beside] = np.maximum(np.sqrt(self._from_edges(points[:, beside])) - ON_FACE, far[beside])
        return far

    def _from_edges(self, points: FloatArray) -> FloatArray:
        """The squared distance from the nearest edge."""
        begin, way = self.edges[:, :3], self.edges[:, 3:]
        away = points[None] - begin[:, :, None]  # (e, 3, n)
        along = (away * way[:, :, None]).sum(axis=1) / (way * way).sum(axis=1)[:, None]
        rest = away - np.clip(along, 0.0, 1.0)[:, None] * way[:, :, None]
        return np.asarray((rest * rest).sum(axis=1).min(axis=0))


def _beyond(planes: FloatArray, points: FloatArray) -> FloatArray:
    return np.asarray(planes[:, :3] @ points - planes[:, 3:])


FORMULAS: dict[int, Formula] = {
    Shape.BALL: from_ball,
    Shape.BOX: from_box,
    Shape.CAPSULE: from_capsule,
    Shape.CYLINDER: from_cylinder,
    Shape.ELLIPSOID: from_ellipsoid,
    Shape.HALF_SPACE: from_half_space,
}


class Alike(NamedTuple):
    """Solids of one formula.

    Attributes:
        numbers: of them, (a,).
        formula: of their distances.
        is_exact: whether distances are known, not only bounds of them.
    """

    numbers: NDArray[np.intp]
    formula: Formula
    is_exact: bool


def _alike(known: Sequence[SolidNumbers]) -> Iterator[Alike]:
    shapes = np.array([shape for shape, *_ in known], dtype=np.intp)
    for shape in np.unique(shapes).tolist():
        numbers = np.flatnonzero(shapes == shape)
        if shape in FORMULAS:
            yield Alike(numbers, FORMULAS[shape], shape != Shape.ELLIPSOID)
        else:
            yield from (Alike(np.array([number]), Polytope(*known[number][4]), True) for number in numbers.tolist())


@dataclass(frozen=True, eq=False)
class Solids:
    """Solids placed as their description says.

    Attributes:
        inverse: from outside to its own axes, (3, 3, s): along each row an axis.
        centers: (3, s), m.
        sizes: (3, s), m.
        alike: all of them.
    """

    inverse: FloatArray
    centers: FloatArray
    sizes: FloatArray
    alike: tuple[Alike, ...]

    @classmethod
    def of(cls, told: Iterable[SolidNumbers]) -> Solids:
        """The solids that a description states."""
        known = list(told)
        count = len(known)
        axes = np.array([axes for _, axes, *_ in known]).reshape(count, 3, 3)
        return cls(
            inverse=np.ascontiguousarray(axes.transpose(2, 1, 0)),
            centers=np.array([center for _, _, center, *_ in known]).reshape(count, 3).T.copy(),
            sizes=np.array([sizes for _, _, _, sizes, _ in known]).reshape(count, 3).T.copy(),
            alike=tuple(_alike(known)),
        )

    @cached_property
    def _kind(self) -> NDArray[np.intp]:
        """The number of the group of each solid, (s,)."""
        found = np.empty(self.centers.shape[1], dtype=np.intp)
        for kind, alike in enumerate(self.alike):
            found[alike.numbers] = kind
        return found

    @cached_property
    def is_exact(self) -> NDArray[np.bool_]:
        """Whether the distances of each solid are exact, not only bounds, (s,)."""
        return np.array([alike.is_exact for alike in self.alike], dtype=bool)[self._kind]

    @cached_property
    def _turned(self) -> tuple[FloatArray, FloatArray]:
        """The rotations to the axes of all solids, (3 s, 3), and their centres along these, (s, 3), m."""
        turned = self.inverse.transpose(2, 0, 1).reshape(-1, 3)
        return turned, np.einsum("abs,bs->sa", self.inverse, self.centers)

    def distances(self, number: NDArray[np.intp], points: FloatArray, enough: FloatArray) -> FloatArray:
        """Distances of points (3, m), as seen from the solids of numbers (m,), (m,), m; above enough, any number."""
        x, y, z = np.einsum("abm,bm->am", self.inverse[:, :, number], points - self.centers[:, number])
        found, kinds, sizes = np.empty(len(number)), self._kind[number], self.sizes[:, number]
        for kind, alike in enumerate(self.alike):
            own = np.flatnonzero(kinds == kind)
            if own.size:
                found[own] = alike.formula(x[own], y[own], z[own], sizes[:, own], enough[own])
        return found

    def from_all(self, points: FloatArray, moved: FloatArray | None, enough: FloatArray) -> FloatArray:
        """Distances of points (3, r, n) from every solid: (s, r, n), m; above enough, any number.

        Args:
            points: r in each of n postures, m.
            moved: how far solids have moved by then, (3, s, n), m; None where they stand still.
            enough: of each point, (r, n), or from each solid, (s, r, n), m.
        """
        _, r, n = points.shape
        turned, centers = self._turned
        local = (turned @ points.reshape(3, -1)).reshape(len(centers), 3, r, n)
        local -= centers[:, :, None, None]
        if moved is not None:
            local -= np.einsum("abs,bsn->san", self.inverse, moved)[:, :, None]
        found = np.empty((len(centers), r, n))
        everywhere = np.broadcast_to(enough, found.shape)
        for alike in self.alike:
            own, numbers = local[alike.numbers], alike.numbers
            sizes = self.sizes[:, numbers, None, None]
            found[numbers] = alike.formula(own[:, 0], own[:, 1], own[:, 2], sizes, everywhere[numbers])
        return found
