"""Straight segments in the plane: how far they are from points and from each other, or how deep they cross."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import TypeAlias

import casadi as ca

from problems.base.matrix import Matrix, Operand, columns

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
