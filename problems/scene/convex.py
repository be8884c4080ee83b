"""Convex outlines in the plane: distance to their sides, and a cover of any polygon by convex ones.

Along a line they are apart by the gap between their shadows. If there is a gap along any line, there is one along a
normal of the polygon's sides or of the segment; if there is none, the smallest overlap is how far the segment has to
be moved to get out. That is the signed distance, which never changes by more than the points move.

Ears are cut off one after the other, and the triangles are joined where the result is convex (Hertel and Mehlhorn,
1983). Where two of the parts meet, a third one lies across their border: a point on the border is within none of the
two, but within the third. Corners of parts are shares of the polygon's, so that polygons that are divided alike have
the same cover.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from itertools import pairwise
from typing import TypeAlias

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, columns

Point: TypeAlias = tuple[Operand, Operand]
TINY = 1e-100  # m: gives a segment that is a point a direction


@dataclass(frozen=True, eq=False)
class Side:
    """Segments as seen along their own ways.

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
        """How far a point is along the way, and to the left of it, m."""
        (x, y), (u, v) = (point[0] - self.start[0], point[1] - self.start[1]), self.way
        return u * x + v * y, u * y - v * x

    def squared(self, along: Operand, across: Operand) -> Matrix:
        """The squared distance of a point that is seen there, m^2."""
        beyond = ca.fmax(0.0, ca.fmax(-along, along - self.length))
        return across * across + beyond * beyond


def apart(gap: Operand, squares: list[Operand]) -> Matrix:
    """The signed distance of two convex things: the distance where there is a gap, else the overlap.

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
    """Ears cut off one after the other; of all that there are, always the one with the widest angle at its sides."""
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
    """Where two parts meet: both their numbers, and the corners a, b of an edge from a to b of the first."""
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
    """The same part, beginning at another corner."""
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
