"""Rectangles and polygons in the plane: distances to convex outlines, and a cover of any polygon by convex ones.

Along a line a convex outline and a segment are apart by the gap between their shadows. If there is a gap along any
line, there is one along a normal of the outline's sides or of the segment; if there is none, the smallest overlap is
how far the segment has to be moved to get out. That is the signed distance, which never changes by more than the points
move.

To cover a polygon, ears are cut off one after the other, and the triangles are joined where the result is convex
(Hertel and Mehlhorn, 1983). Where two of the parts meet, a third one lies across their border: a point on the border is
within none of the two, but within the third. Corners of parts are shares of the polygon's, so that polygons that are
divided alike have the same cover.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import reduce
from itertools import combinations, pairwise
from typing import Annotated, ClassVar, TypeAlias

import casadi as ca
import numpy as np

from problems.base import (
    LENGTHS,
    Angle,
    Coordinate,
    Count,
    FloatArray,
    InvalidProblem,
    Length,
    Matrix,
    Operand,
    check_within,
    columns,
    is_zero,
)
from problems.scene.obstacle import Obstacle
from problems.scene.polytope import Polytope
from problems.scene.solids import Box, Solid, about_z

Point: TypeAlias = tuple[Operand, Operand]
TINY = 1e-100  # m: gives a segment that is a point a direction


@dataclass(frozen=True, eq=False)
class Side:
    """Segments in frames along themselves.

    Attributes:
        start: where they begin, m.
        way: unit vectors from there to their ends.
        length: m.
    """

    start: Point
    way: Point
    length: Operand

    @classmethod
    def between(cls, start: Point, end: Point) -> Side:
        """The segments from one point to another."""
        dx, dy = end[0] - start[0] + TINY, end[1] - start[1]
        length = ca.sqrt(dx * dx + dy * dy)
        return cls(start, (dx / length, dy / length), length)

    def seen(self, point: Point) -> Point:
        """Coordinates of a point along a segment, and to the left of it, m."""
        (x, y), (u, v) = (point[0] - self.start[0], point[1] - self.start[1]), self.way
        return u * x + v * y, u * y - v * x

    def squared(self, along: Operand, across: Operand) -> Matrix:
        """The squared distance of a point with these coordinates, m^2."""
        beyond = ca.fmax(0.0, ca.fmax(-along, along - self.length))
        return across * across + beyond * beyond


def apart(gap: Operand, squares: list[Operand]) -> Matrix:
    """The signed distance of two convex shapes: the distance where there is a gap, else the overlap.

    Args:
        gap: between their shadows on the line where it is largest, m; negative where they overlap.
        squares: of the distances between their corners and sides, m^2.
    """
    square = ca.fmax(reduce(ca.fmin, squares), gap * gap)  # a distance is no less than any gap
    return ca.if_else(gap > 0.0, ca.sqrt(square), gap)


def ends_of(points: Matrix) -> Point:
    """The coordinates of points (n, 2), both (n, 1)."""
    x, y = columns(points)
    return x, y


def crossing_clearance(first: tuple[Matrix, Matrix], second: tuple[Matrix, Matrix]) -> Matrix:
    """Signed distances of n pairs of segments, each given by its ends (n, 2) in m.

    Returns:
        (n, 1), m: the distance, or where two cross, less than zero by the shortest way to move one off the other. It
        changes by no more than the points of one move as seen from the other.
    """
    one, two = ((ends_of(start), ends_of(end)) for start, end in (first, second))
    gaps: list[Operand] = []
    squares: list[Operand] = []
    for ends, others in ((one, two), (two, one)):
        side = Side.between(*ends)
        seen = [side.seen(point) for point in others]
        along, across = zip(*seen, strict=True)
        gaps += [ca.fmin(*along) - side.length, -ca.fmax(*along), ca.fmin(*across), -ca.fmax(*across)]
        squares += [side.squared(*each) for each in seen]
    return apart(reduce(ca.fmax, gaps), squares)


def convex_clearance(corners: Sequence[Point], start: Matrix, end: Matrix) -> Matrix:
    """Signed distances of straight segments from a filled convex polygon.

    Args:
        corners: of the polygon, counter-clockwise, m.
        start: of the segments, (n, 2), m.
        end: likewise.

    Returns:
        (n, 1), m: the distance, or where a segment enters, less than zero by the shortest way out.
    """
    ends = ends_of(start), ends_of(end)
    gaps: list[Operand] = []
    squares: list[Operand] = []
    for side in (Side.between(*pair) for pair in pairwise([*corners, corners[0]])):
        seen = [side.seen(point) for point in ends]
        gaps.append(-ca.fmax(*(across for _, across in seen)))  # outside is to the right of every side
        squares += [side.squared(*each) for each in seen]
    segment = Side.between(*ends)
    seen = [segment.seen(corner) for corner in corners]
    across = [each for _, each in seen]
    gaps += [reduce(ca.fmin, across), -reduce(ca.fmax, across)]
    squares += [segment.squared(*each) for each in seen]
    return apart(reduce(ca.fmax, gaps), squares)


Share: TypeAlias = tuple[tuple[int, float], ...]  # indices of the polygon's corners, and their weights
Part: TypeAlias = tuple[Share, ...]
STRAIGHT = 1e-12  # a corner counts as none where it turns by less, relative to the polygon's size


def convex_cover(points: FloatArray) -> tuple[Part, ...]:
    """Convex parts whose union is a simple polygon.

    Args:
        points: its corners, counter-clockwise, (n, 2), m.

    Returns:
        The corners of each part, counter-clockwise. Every inner point of the polygon is an inner point of a part.
    """
    corners = _real_corners(points)
    parts = _joined(points, _triangles(points, corners))
    across = [_across(points, parts[i], parts[j], a, b) for i, j, a, b in _borders(parts)]
    return (*(tuple(((index, 1.0),) for index in part) for part in parts), *across)


def _turn(a: FloatArray, b: FloatArray, c: FloatArray) -> float:
    """Twice the signed area of a triangle, m^2; positive where it turns left."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _real_corners(points: FloatArray) -> list[int]:
    """Indices of the corners at which the outline turns."""
    size = float(np.ptp(points, axis=0).max()) ** 2
    count = len(points)
    turns = [_turn(points[i - 1], points[i], points[(i + 1) % count]) for i in range(count)]
    return [i for i in range(count) if abs(turns[i]) > STRAIGHT * size]


def _triangles(points: FloatArray, corners: list[int]) -> list[tuple[int, ...]]:
    """Ears cut off one after the other, always the one with the widest angle at its sides."""
    left, triangles = list(corners), []
    while len(left) > 3:
        ears = [k for k in range(len(left)) if _is_ear(points, left, k)]
        k = max(ears, key=lambda k: _thickness(points, left, k))
        triangles.append((left[k - 1], left[k], left[(k + 1) % len(left)]))
        del left[k]
    return [*triangles, (left[0], left[1], left[2])]


def _is_ear(points: FloatArray, left: list[int], k: int) -> bool:
    """Whether corner k can be cut off: it is convex, and no other corner lies in what is cut off."""
    a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
    if not _turn(points[a], points[b], points[c]) > 0.0:
        return False
    sides = ((a, b), (b, c), (c, a))
    others = (points[other] for other in left if other not in (a, b, c))
    return not any(all(_turn(points[i], points[j], other) >= 0.0 for i, j in sides) for other in others)


def _thickness(points: FloatArray, left: list[int], k: int) -> float:
    """The area of an ear over the square of its longest side."""
    a, b, c = (points[left[i % len(left)]] for i in (k - 1, k, k + 1))
    return _turn(a, b, c) / max(float(((p - q) ** 2).sum()) for p, q in ((a, b), (b, c), (c, a)))


def _borders(parts: list[tuple[int, ...]]) -> list[tuple[int, int, int, int]]:
    """Numbers of each two parts that meet, and the corners a, b of an edge from a to b of the first."""
    edges = {edge: number for number, part in enumerate(parts) for edge in zip(part, (*part[1:], part[0]), strict=True)}
    return [(i, edges[b, a], a, b) for (a, b), i in edges.items() if a < b and (b, a) in edges]


def _joined(points: FloatArray, parts: list[tuple[int, ...]]) -> list[tuple[int, ...]]:
    """The parts that are left when neighbours are joined as long as the result is convex."""
    for i, j, a, b in _borders(parts):
        joined = (*_from(parts[i], b), *_from(parts[j], a)[1:-1])
        if _is_convex(points[list(joined)]):
            return _joined(points, [joined, *(part for k, part in enumerate(parts) if k not in (i, j))])
    return parts


def _from(part: tuple[int, ...], first: int) -> tuple[int, ...]:
    """The part, beginning at another corner."""
    at = part.index(first)
    return part[at:] + part[:at]


def _is_convex(corners: FloatArray) -> bool:
    """Whether an outline (n, 2) never turns right."""
    n = len(corners)
    return all(_turn(corners[k - 1], corners[k], corners[(k + 1) % n]) >= 0.0 for k in range(n))


def _across(points: FloatArray, first: tuple[int, ...], second: tuple[int, ...], a: int, b: int) -> Part:
    """A convex quadrilateral over the edge from a to b between two parts, as large as halving finds it."""
    left, right = (max(part, key=lambda k: abs(_turn(points[a], points[b], points[k]))) for part in (first, second))
    share = 1.0
    while True:
        to_left, to_right = (((a, 0.5 - 0.5 * share), (b, 0.5 - 0.5 * share), (apex, share)) for apex in (left, right))
        part: Part = (((a, 1.0),), to_right, ((b, 1.0),), to_left)
        if _is_convex(np.array([sum(weight * points[k] for k, weight in corner) for corner in part])):
            return part
        share *= 0.5


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

    zero_is_structure: ClassVar[tuple[str, ...]] = ("angle",)

    center: tuple[Coordinate, Coordinate]
    size: tuple[Length, Length]
    angle: Angle = 0.0

    @property
    def place(self) -> tuple[float, ...]:
        return self.center

    @property
    def in_space(self) -> tuple[Solid, ...]:
        size = (*self.size, min(self.size))
        return (Box(center=(*self.center, 0.0), quaternion=about_z(self.angle), size=size),)

    @property
    def width(self) -> float:
        return min(self.size)

    @property
    def complexity(self) -> int:
        return 4

    @property
    def corners(self) -> tuple[Point, ...]:
        """The corners, counter-clockwise, m."""
        (x, y), (dx, dy) = self.center, self.size
        halves = [(0.5 * i * dx, 0.5 * j * dy) for i, j in SIGNS]
        if not is_zero(self.angle):
            cosine, sine = ca.cos(self.angle), ca.sin(self.angle)
            halves = [(cosine * u - sine * v, sine * u + cosine * v) for u, v in halves]
        return tuple((x + u, y + v) for u, v in halves)

    def contains(self, point: tuple[float, ...]) -> bool:
        away, turn = np.array(point) - self.center, np.exp(-1j * self.angle)
        local = complex(*away) * turn
        return bool(2.0 * abs(local.real) <= self.size[0] and 2.0 * abs(local.imag) <= self.size[1])

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        return convex_clearance(self.corners, start, end)

    def outline(self, count: int = 96) -> FloatArray:
        return np.array([[float(part) for part in corner] for corner in self.corners])


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

    points: Annotated[tuple[tuple[Coordinate, Coordinate], ...], Count(3, MAX_CORNERS, "corners")]
    parts: tuple[Part, ...] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_outline()
        order = np.arange(len(self.points))[:: 1 if _area(self._corners) > 0.0 else -1]
        cover = convex_cover(self._corners[order])
        parts = tuple(tuple(tuple((int(order[k]), weight) for k, weight in share) for share in part) for part in cover)
        object.__setattr__(self, "parts", parts)

    def _check_outline(self) -> None:
        """Check that sides are long enough, and none meets another but at their common corner."""
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
        return sum(map(len, self.parts))

    @property
    def place(self) -> tuple[float, ...]:
        return self.points[0]

    @property
    def width(self) -> float:
        i, j = np.triu_indices(len(self.points), 1)
        sides = self._corners[j] - self._corners[i]
        normals = (sides @ [[0.0, -1.0], [1.0, 0.0]])[np.hypot(*sides.T) > 0.0]
        across = self._corners @ (normals / np.hypot(*normals.T)[:, None]).T
        return float(np.ptp(across, axis=0).min())

    @property
    def in_space(self) -> tuple[Solid, ...]:
        half = self.width / 2.0
        outlines = [[tuple(map(float, self._corner(share))) for share in part] for part in self.parts]
        return tuple(
            Polytope(points=tuple((x, y, z) for x, y in outline for z in (-half, half))) for outline in outlines
        )

    def contains(self, point: tuple[float, ...]) -> bool:
        for part in self.parts:
            corners = np.array([self._corner(share) for share in part])
            way, to_point = np.roll(corners, -1, axis=0) - corners, np.array(point) - corners
            if (way[:, 0] * to_point[:, 1] - way[:, 1] * to_point[:, 0] >= 0.0).all():
                return True
        return False

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """The signed clearance of segments from the polygon, (n, 1), m: exact outside and, for a convex one, inside."""
        each = [convex_clearance([self._corner(share) for share in part], start, end) for part in self.parts]
        return reduce(ca.fmin, each)

    def _corner(self, share: Share) -> Point:
        """A corner of a part, m."""
        if len(share) == 1:
            return self.points[share[0][0]]
        x, y = (_sum([weight * self.points[k][axis] for k, weight in share]) for axis in (0, 1))
        return x, y

    def outline(self, count: int = 96) -> FloatArray:
        return self._corners if _area(self._corners) > 0.0 else self._corners[::-1]


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
