"""Convex polytopes: all that lies behind some planes.

The largest of the distances from the planes is the distance where the nearest point lies in a face, less of it
elsewhere, and never wrong. A search has enough of that, and of few planes around it all; a proof has the distance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache, reduce
from typing import Annotated, ClassVar, TypeAlias

import casadi as ca
import numpy as np

from problems.base import Coordinate, Count, FloatArray, Matrix
from problems.geometry import Hull, enclosing
from problems.scene.solids import PlainSolid, Shape, Solid, Surface

Plane: TypeAlias = tuple[float, float, float, float]  # a unit normal outwards, and how far along it, m

MOST_POINTS = 2_000
MOST_PLANES = 24
BLOCK = 8  # planes are repeated up to a multiple of so many, so that few structures are compiled


@dataclass(frozen=True, kw_only=True)
class Polytope(Solid):
    """The convex hull of points.

    Args:
        center: of the frame in which the points are, (x, y, z), m.
        points: 4 at least that are not in one plane, (x, y, z), m.

    Attributes:
        planes: of its faces, some of them repeated; of a hull around it where these are many.

    Raises:
        InvalidProblem: a number is out of range, there are too few or too many points, or they are in one plane.
    """

    numbers: ClassVar[tuple[str, ...]] = ("center", "quaternion", "planes")
    inert: ClassVar[tuple[str, ...]] = (*Solid.inert, "points")

    center: tuple[Coordinate, Coordinate, Coordinate] = (0.0, 0.0, 0.0)
    points: Annotated[tuple[tuple[Coordinate, Coordinate, Coordinate], ...], Count(4, MOST_POINTS, "points")]
    planes: tuple[Plane, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        around = enclosing(self._hull, MOST_PLANES)
        rows = [tuple(row) for row in np.column_stack([around.normals, around.offsets]).tolist()]
        object.__setattr__(self, "planes", (*rows, *[rows[-1]] * (-len(rows) % BLOCK)))

    @property
    def _hull(self) -> Hull:
        return _hull(self.points)

    @property
    def complexity(self) -> int:
        """A quarter of the number of planes, each of which is simpler than the side of a polygon."""
        return len(self.planes) // 4

    @property
    def place(self) -> tuple[float, ...]:
        return tuple(self.surface()[0].mean(axis=0).tolist())

    @property
    def width(self) -> float:
        """The least distance between two parallel planes around it, one of them that of a face, m."""
        hull = self._hull
        return float(np.ptp(hull.corners @ hull.normals.T, axis=0).min())

    @property
    def half_extents(self) -> FloatArray:
        return np.asarray(np.ptp(self.bounding_box(), axis=0) / 2.0)

    def bounding_box(self) -> FloatArray:
        corners = self.surface()[0]
        return np.array([corners.min(axis=0), corners.max(axis=0)])

    @property
    def plain(self) -> PlainSolid:
        hull = self._hull
        faces = np.column_stack([hull.normals, hull.offsets])
        return PlainSolid(Shape.POLYTOPE, (), np.array(self.planes), faces, np.hstack(hull.edges))

    def point_clearance(self, points: Matrix) -> Matrix:
        """The largest distance from a plane: how deep inside, or outside no more than the distance."""
        x, y, z = self.local(points)
        return reduce(ca.fmax, (nx * x + ny * y + nz * z - offset for nx, ny, nz, offset in self.planes))

    def exact_distances(self, points: FloatArray) -> FloatArray:
        return self._hull.distances((points - np.array(self.center)) @ self.axes)

    def distance_of(self, start: tuple[float, ...], end: tuple[float, ...]) -> float:
        return float(self.exact_distances(np.array([start], dtype=float))[0])

    def local_surface(self) -> Surface:
        hull = self._hull
        return hull.corners, hull.triangles.tolist()


@lru_cache(maxsize=1_000)
def _hull(points: tuple[tuple[float, float, float], ...]) -> Hull:
    return Hull.of(np.array(points, dtype=float))
