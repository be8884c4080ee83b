"""Convex hulls in numbers: their faces, how far points are from them, and hulls around them with fewer faces.

Where the nearest point of a hull does not lie in the face that is seen there, it lies on an edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem

SAME_PLANE = 1e-6  # of normals, and of offsets relative to the size: of triangles of one face
LEAST_THICKNESS = 1e-9  # relative: what is flatter has no inside
MOST_CORNERS = 10_000
PRODUCTS_AT_ONCE = 10_000_000  # products of corners and faces
ON_FACE = 1e-9  # m: so far from a face a point still counts as in it
COARSENESS = 0.0005  # m: so far it may be outside of that
GROWTH = 1e-9  # relative: rounding must not cut off a corner


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex hull by its corners and the planes of its faces.

    Attributes:
        corners: (n, 3), m.
        triangles: numbers of their corners, counter-clockwise from outside, (m, 3).
        normals: of the faces, outwards, (f, 3).
        offsets: of the faces from the origin along them, (f,), m; no corner is beyond any.
    """

    corners: FloatArray
    triangles: NDArray[np.intp]
    normals: FloatArray
    offsets: FloatArray

    @classmethod
    def of(cls, points: FloatArray) -> Hull:
        """The convex hull of points (n, 3), m.

        Raises:
            InvalidProblem: ``points`` are in one plane, or their hull has too many corners.
        """
        size = float(np.ptp(points, axis=0).max())
        try:
            found = scipy.spatial.ConvexHull(points)
        except (scipy.spatial.QhullError, ValueError) as error:
            raise InvalidProblem("points", "they are in one plane; a body needs an inside") from error
        if found.volume <= LEAST_THICKNESS * size**3:
            raise InvalidProblem("points", "they are in one plane; a body needs an inside")
        if len(found.vertices) > MOST_CORNERS:
            raise InvalidProblem("points", f"{len(found.vertices)} corners of their hull, of at most {MOST_CORNERS}")
        corners, triangles = points[found.vertices], np.searchsorted(found.vertices, found.simplices)
        normals = found.equations[:, :3]
        one, two, three = (corners[triangles[:, k]] for k in range(3))
        inwards = np.einsum("mi,mi->m", np.cross(two - one, three - one), normals) < 0.0
        triangles[inwards] = triangles[inwards][:, ::-1]
        normals = normals[_distinct(np.column_stack([normals, found.equations[:, 3] / size]))]
        blocks = np.array_split(normals, 1 + len(normals) * len(corners) // PRODUCTS_AT_ONCE)
        return cls(corners, triangles, normals, np.concatenate([(corners @ block.T).max(axis=0) for block in blocks]))

    @cached_property
    def edges(self) -> tuple[FloatArray, FloatArray]:
        """Starts of the edges of its faces, and vectors from there to their ends, both (e, 3), m."""
        on = np.abs(self.beyond(self.corners)) <= 2.0 * SAME_PLANE * np.ptp(self.corners, axis=0).max()
        pairs = {tuple(sorted(pair)) for triangle in self.triangles.tolist() for pair in combinations(triangle, 2)}
        one, two = np.array([pair for pair in sorted(pairs) if (on[pair[0]] & on[pair[1]]).sum() > 1]).T
        return self.corners[one], self.corners[two] - self.corners[one]

    @property
    def faces(self) -> FloatArray:
        """The corners of its triangles, (m, 3, 3), m."""
        return self.corners[self.triangles]

    def beyond(self, points: FloatArray) -> FloatArray:
        """Distances of points (n, 3) beyond each face, (n, f), m."""
        return np.asarray(points @ self.normals.T - self.offsets)

    @property
    def box(self) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Centre (3,), axes in columns (3, 3), right-handed, and sides along them (3,), m, if the hull is a box.

        That box holds it, also where its faces are not quite at right angles.
        """
        if len(self.corners) != 8 or len(self.normals) != 6:
            return None
        first = self.normals[0]
        across = self.normals[np.abs(self.normals @ first) < SAME_PLANE]
        if len(across) != 4:
            return None
        second = across[0] - (across[0] @ first) * first
        second /= np.linalg.norm(second)
        axes = np.column_stack([first, second, np.cross(first, second)])
        if not (np.abs(self.normals @ axes).max(axis=1) > 1.0 - SAME_PLANE).all():
            return None
        seen = self.corners @ axes
        return axes @ (seen.max(axis=0) + seen.min(axis=0)) / 2.0, axes, np.ptp(seen, axis=0)

    def grown(self, length: float) -> Hull:
        """The hull with all faces moved outwards by a length in m."""
        planes = np.column_stack([self.normals, -self.offsets - length])
        return Hull.of(scipy.spatial.HalfspaceIntersection(planes, self.corners.mean(axis=0)).intersections)

    def distances(self, points: FloatArray) -> FloatArray:
        """Signed distances of points (n, 3), m: (n,)."""
        beyond = self.beyond(points)
        face = beyond.argmax(axis=1)
        far = beyond[np.arange(len(points)), face]
        outside = np.flatnonzero(far > 0.0)
        feet = points[outside] - far[outside, None] * self.normals[face[outside]]
        beside = outside[self.beyond(feet).max(axis=1, initial=-np.inf) > ON_FACE]
        starts, ways = self.edges
        squares = np.full(len(beside), np.inf)
        for start, way in zip(starts, ways, strict=True):
            away = points[beside] - start
            away -= np.clip(away @ (way / (way @ way)), 0.0, 1.0)[:, None] * way
            np.minimum(squares, np.einsum("ni,ni->n", away, away), out=squares)
        far[beside] = np.maximum(np.sqrt(squares) - ON_FACE, far[beside])
        return np.asarray(far)


def _distinct(planes: FloatArray) -> NDArray[np.intp]:
    """Numbers of planes (m, 4) of which no two are the same, in order."""
    return np.sort(np.unique(np.round(planes / SAME_PLANE), axis=0, return_index=True)[1])


def enclosing(hull: Hull, most: int) -> Hull:
    """A hull with fewer faces around another, from which no corner is farther than ``COARSENESS``.

    Farther where so many faces are not enough; itself where it has no more.
    """
    if len(hull.normals) <= most:
        return hull
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    planes = np.column_stack([axes, -(hull.corners @ axes.T).max(axis=0)])
    faces, inside = np.column_stack([hull.normals, -hull.offsets]), hull.corners.mean(axis=0)
    while True:
        corners = scipy.spatial.HalfspaceIntersection(planes, inside).intersections
        beyond = (corners @ faces[:, :3].T + faces[:, 3]).max(axis=0)
        if beyond.max() <= COARSENESS or len(planes) >= most:
            return Hull.of(inside + (corners - inside) * (1.0 + GROWTH))
        planes = np.concatenate([planes, faces[[beyond.argmax()]]])
