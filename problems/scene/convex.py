"""Convex polygons and straight segments: how far they are apart, or how deep one is in the other.

Along a line they are apart by the gap between their shadows. If there is a gap along any line, there is one along a
normal of the polygon's sides or of the segment; if there is none, the smallest overlap is how far the segment has to
be moved to get out. That is the signed distance, which never changes by more than the points move.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import pairwise

import casadi as ca

from problems.base.matrix import Matrix, Operand
from problems.scene.segments import Point, Side, apart, ends_of


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
