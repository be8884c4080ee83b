"""Convex polygons and straight segments: how far they are apart, or how deep one is in the other.

Along a line they are apart by the gap between their shadows. If there is a gap along any line, there is one along a
normal of the polygon's edges or of the segment; if there is none, the smallest overlap is how far the segment has to
be moved to get out. That is the signed distance, which never changes by more than the points move.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import pairwise

import casadi as ca

from problems.base.matrix import Matrix
from problems.scene.segments import TINY_SQUARED, Point, apart, ends_of, point_squared


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
    return apart(_widest_gap(corners, ends), _nearest_squared(corners, ends))


def _widest_gap(corners: Sequence[Point], ends: tuple[Point, Point]) -> Matrix:
    """The gap between the shadows along the line where it is largest; negative where they overlap; (n, 1), m."""
    (x0, y0), (x1, y1) = ends
    gaps = []
    for (cx, cy), (dx, dy) in _edges(corners):
        length = ca.sqrt(dx * dx + dy * dy)
        nx, ny = dy / length, -dx / length
        gaps.append(ca.fmin(nx * (x0 - cx) + ny * (y0 - cy), nx * (x1 - cx) + ny * (y1 - cy)))
    across_edges = reduce(ca.fmax, gaps)
    dx, dy = x1 - x0, y1 - y0
    square = dx * dx + dy * dy
    length = ca.sqrt(square + TINY_SQUARED)
    sides = [(dx * (cy - y0) - dy * (cx - x0)) / length for cx, cy in corners]
    across_segment = ca.fmax(reduce(ca.fmin, sides), -reduce(ca.fmax, sides))
    return ca.if_else(square > TINY_SQUARED, ca.fmax(across_edges, across_segment), across_edges)


def _nearest_squared(corners: Sequence[Point], ends: tuple[Point, Point]) -> Matrix:
    """The squared distance of the segment from the nearest edge, if they do not cross; (n, 1), m^2."""
    (x0, y0), (x1, y1) = ends
    of_ends = [point_squared((x, y), corner, edge) for corner, edge in _edges(corners) for x, y in ends]
    of_corners = [point_squared(corner, (x0, y0), (x1 - x0, y1 - y0)) for corner in corners]
    return reduce(ca.fmin, [*of_ends, *of_corners])


def _edges(corners: Sequence[Point]) -> list[tuple[Point, Point]]:
    """From each corner the way to the next."""
    return [((ax, ay), (bx - ax, by - ay)) for (ax, ay), (bx, by) in pairwise([*corners, corners[0]])]
