"""Straight segments in the plane: how far they are from points and from each other, or how deep they cross."""

from __future__ import annotations

from functools import reduce
from typing import TypeAlias

import casadi as ca

from problems.base.matrix import Matrix, Operand, columns

Point: TypeAlias = tuple[Operand, Operand]
TINY_SQUARED = 1e-200  # m^2: keeps the length of a segment that is a point off zero


def point_squared(point: Point, start: Point, way: Point) -> Matrix:
    """The squared distance between a point and the segment from ``start`` along ``way``, m^2."""
    dx, dy = point[0] - start[0], point[1] - start[1]
    square = way[0] * way[0] + way[1] * way[1] + TINY_SQUARED
    along = ca.fmin(1.0, ca.fmax(0.0, (dx * way[0] + dy * way[1]) / square))
    return (dx - along * way[0]) ** 2 + (dy - along * way[1]) ** 2


def apart(gap: Matrix, square: Matrix) -> Matrix:
    """The signed distance of two convex things: the root of ``square`` where there is a gap, else the overlap.

    Args:
        gap: between their shadows along the line where it is largest, m; negative where they overlap.
        square: of their distance, if they do not meet, m^2.
    """
    return ca.if_else(gap > 0.0, ca.sqrt(ca.fmax(square, gap * gap)), gap)  # a distance is no less than any gap


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
    gap = ca.fmax(_widest_gap(*one, *two), _widest_gap(*two, *one))
    sides = [(point, *side) for side, ends in ((_side(*one), two), (_side(*two), one)) for point in ends]
    return apart(gap, reduce(ca.fmin, [point_squared(*each) for each in sides]))


def _side(start: Point, end: Point) -> tuple[Point, Point]:
    """Where a segment starts, and its way."""
    return start, (end[0] - start[0], end[1] - start[1])


def _widest_gap(start: Point, end: Point, *others: Point) -> Matrix:
    """The larger gap between the shadows of a segment and of the points of another, along it and across it, m."""
    _, (dx, dy) = _side(start, end)
    length = ca.sqrt(dx * dx + dy * dy + TINY_SQUARED)
    ways = [(x - start[0], y - start[1]) for x, y in others]
    along = [(dx * u + dy * v) / length for u, v in ways]
    across = [(dx * v - dy * u) / length for u, v in ways]
    beyond = ca.fmax(ca.fmin(*along) - length, -ca.fmax(*along))
    return ca.fmax(beyond, ca.fmax(ca.fmin(*across), -ca.fmax(*across)))
