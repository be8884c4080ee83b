"""Rectangles and polygons in the plane."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import reduce
from itertools import combinations
from typing import Annotated, ClassVar

import casadi as ca
import numpy as np

from problems.base import (
    COORDINATES,
    LENGTHS,
    Angle,
    Coordinate,
    Count,
    FloatArray,
    InvalidProblem,
    Length,
    Matrix,
    Operand,
    check_quantities,
    check_within,
    is_zero,
)
from problems.scene.convex import Part, Point, Share, convex_clearance, convex_cover
from problems.scene.obstacle import Obstacle

SIGNS = ((-1, -1), (1, -1), (1, 1), (-1, 1))  # of the corners, counter-clockwise


@dataclass(frozen=True)
class Rectangle(Obstacle):
    """A filled rectangle in the plane.

    Args:
        center: (x, y), m.
        size: width and height before turning, m, positive.
        angle: how far it is turned counter-clockwise, rad.

    Raises:
        InvalidProblem: a number is out of range, or a size not positive.
    """

    numbers: ClassVar[tuple[str, ...]] = ("center", "size", "angle")
    zero_is_structure: ClassVar[tuple[str, ...]] = ("angle",)

    center: tuple[Coordinate, Coordinate]
    size: tuple[Length, Length]
    angle: Angle = 0.0

    def __post_init__(self) -> None:
        check_quantities(self, "center", "angle", "size")

    @property
    def place(self) -> tuple[float, ...]:
        """Its centre, m."""
        return self.center

    @property
    def width(self) -> float:
        """The shorter side, m."""
        return min(self.size)

    @property
    def complexity(self) -> int:
        """That of its corners."""
        return 4

    @property
    def corners(self) -> tuple[Point, ...]:
        """Counter-clockwise, m."""
        (x, y), (dx, dy) = self.center, self.size
        halves = [(0.5 * i * dx, 0.5 * j * dy) for i, j in SIGNS]
        if not is_zero(self.angle):
            cosine, sine = ca.cos(self.angle), ca.sin(self.angle)
            halves = [(cosine * u - sine * v, sine * u + cosine * v) for u, v in halves]
        return tuple((x + u, y + v) for u, v in halves)

    def contains(self, point: tuple[float, ...]) -> bool:
        """Whether a point (m) lies in or on it."""
        away, turn = np.array(point) - self.center, np.exp(-1j * self.angle)
        local = complex(*away) * turn
        return bool(2.0 * abs(local.real) <= self.size[0] and 2.0 * abs(local.imag) <= self.size[1])

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """Signed distances of straight segments, exact; (n, 1), m."""
        return convex_clearance(self.corners, start, end)

    def distance_to(self, point: tuple[float, ...]) -> float:
        """The distance from a point, m; 0 inside."""
        return max(0.0, self.distance_of(point, point))

    def outline(self, count: int = 96) -> FloatArray:
        """The corners, counter-clockwise, (4, 2), m."""
        return np.array([[float(part) for part in corner] for corner in self.corners])

    def bounding_box(self) -> FloatArray:
        """The smallest box around it with sides along the axes: lower and upper corner, (2, 2), m."""
        corners = self.outline()
        return np.array([corners.min(axis=0), corners.max(axis=0)])


MAX_CORNERS = 60


@dataclass(frozen=True)
class Polygon(Obstacle):
    """A filled polygon in the plane whose outline does not meet itself.

    A polygon that is not convex is a union of convex parts. Its clearance is the least of theirs: the distance outside;
    inside, how deep a segment is in the part in which it is deepest.

    Args:
        points: at least 3 corners in order, either way round, m.

    Attributes:
        parts: convex, of which it is the union; their corners are shares of the points.

    Raises:
        InvalidProblem: a number is out of range, there are too few or too many corners, or the outline meets itself.
    """

    numbers: ClassVar[tuple[str, ...]] = ("points",)

    points: Annotated[tuple[tuple[Coordinate, Coordinate], ...], Count(3, MAX_CORNERS)]
    parts: tuple[Part, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        if not 3 <= len(self.points) <= MAX_CORNERS:
            raise InvalidProblem("points", f"{len(self.points)} corners are not within 3 and {MAX_CORNERS}")
        for point in self.points:
            check_within("points", point, COORDINATES, "m")
        self._check_outline()
        order = np.arange(len(self.points))[:: 1 if _area(self._corners) > 0.0 else -1]
        cover = convex_cover(self._corners[order])
        parts = tuple(tuple(tuple((int(order[k]), weight) for k, weight in share) for share in part) for part in cover)
        object.__setattr__(self, "parts", parts)

    def _check_outline(self) -> None:
        """Its sides are long enough, and none meets another but at the corner that they share."""
        corners, count = self._corners, len(self.points)
        for k, length in enumerate(np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)):
            check_within("points", (length,), LENGTHS, "m", f"the side from point {k + 1} on: ")
        for i, j in combinations(range(count), 2):
            sides = [(corners[k], corners[(k + 1) % count]) for k in (i, j)]
            neighbours = j - i == 1 or j - i == count - 1
            if _meet(*sides[0], *sides[1]) if not neighbours else _folded(corners, (j if j - i == 1 else i) % count):
                raise InvalidProblem("points", f"the sides from points {i + 1} and {j + 1} on meet")
        if abs(_area(corners)) <= 0.0:
            raise InvalidProblem("points", "they enclose no area")

    @property
    def _corners(self) -> FloatArray:
        return np.array(self.points)

    @property
    def complexity(self) -> int:
        """The corners of its convex parts."""
        return sum(map(len, self.parts))

    @property
    def place(self) -> tuple[float, ...]:
        """Its first corner, m."""
        return self.points[0]

    @property
    def width(self) -> float:
        """The least distance in m between two parallel lines that hold it: along a side of its convex hull."""
        i, j = np.triu_indices(len(self.points), 1)
        sides = self._corners[j] - self._corners[i]
        normals = (sides @ [[0.0, -1.0], [1.0, 0.0]])[np.hypot(*sides.T) > 0.0]
        across = self._corners @ (normals / np.hypot(*normals.T)[:, None]).T
        return float(np.ptp(across, axis=0).min())

    def contains(self, point: tuple[float, ...]) -> bool:
        """Whether a point (m) lies in or on it."""
        for part in self.parts:
            corners = np.array([self._corner(share) for share in part])
            way, to_point = np.roll(corners, -1, axis=0) - corners, np.array(point) - corners
            if (way[:, 0] * to_point[:, 1] - way[:, 1] * to_point[:, 0] >= 0.0).all():
                return True
        return False

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """Signed clearance of straight segments, (n, 1), m: exact outside and, for a convex polygon, inside."""
        each = [convex_clearance([self._corner(share) for share in part], start, end) for part in self.parts]
        return reduce(ca.fmin, each)

    def _corner(self, share: Share) -> Point:
        """A corner of a part, m."""
        if len(share) == 1:
            return self.points[share[0][0]]
        x, y = (_sum([weight * self.points[k][axis] for k, weight in share]) for axis in (0, 1))
        return x, y

    def distance_to(self, point: tuple[float, ...]) -> float:
        """The distance from a point, m; 0 inside."""
        return max(0.0, self.distance_of(point, point))

    def outline(self, count: int = 96) -> FloatArray:
        """The corners, counter-clockwise, (n, 2), m."""
        return self._corners if _area(self._corners) > 0.0 else self._corners[::-1]

    def bounding_box(self) -> FloatArray:
        """The smallest box around it with sides along the axes: lower and upper corner, (2, 2), m."""
        return np.array([self._corners.min(axis=0), self._corners.max(axis=0)])


def _sum(terms: list[Operand]) -> Operand:
    return reduce(lambda a, b: a + b, terms)


def _area(corners: FloatArray) -> float:
    """The area inside an outline (n, 2), m^2; positive where it is counter-clockwise."""
    x, y = (corners - corners[0]).T
    return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


def _meet(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Whether the segments from a to b and from c to d have a point in common."""

    def side(p: FloatArray, q: FloatArray, r: FloatArray) -> float:
        return float(np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])))

    boxes_meet = bool((np.minimum(a, b) <= np.maximum(c, d)).all() and (np.minimum(c, d) <= np.maximum(a, b)).all())
    return boxes_meet and side(a, b, c) * side(a, b, d) <= 0.0 and side(c, d, a) * side(c, d, b) <= 0.0


def _folded(corners: FloatArray, k: int) -> bool:
    """Whether the outline runs back along itself at a corner."""
    before, after = corners[k - 1] - corners[k], corners[(k + 1) % len(corners)] - corners[k]
    return bool(before[0] * after[1] == before[1] * after[0] and before @ after > 0.0)
