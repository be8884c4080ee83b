"""Where segments in the plane are nearest to lines of many corners."""

from __future__ import annotations

import numpy as np

from problems.base.matrix import FloatArray


def nearest(start: FloatArray, end: FloatArray, corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The nearest points of n segments, and those of n lines that they are nearest to.

    Args:
        start: of the segments, (n, 2), m.
        end: likewise.
        corners: of the lines, (n, m, 2), m; a closed line ends where it starts.

    Returns:
        Both (n, 2), m; where a segment and its line cross, both are there.
    """
    first, last = corners[:, :-1], corners[:, 1:]
    ends = [np.broadcast_to(point[:, None], first.shape) for point in (start, end)]
    on_segment = [*ends, _foot(corners, *(np.broadcast_to(point[:, None], corners.shape) for point in (start, end)))]
    on_line = [*(_foot(point, first, last) for point in ends), corners]
    crossing = _crossing(ends[0], ends[1], first, last)
    near, far = (np.concatenate([*points, crossing], axis=1) for points in (on_segment, on_line))
    gaps = np.linalg.norm(far - near, axis=2)
    rows = np.arange(len(start)), np.nanargmin(gaps, axis=1)
    return near[rows], far[rows]


def _foot(points: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """The points of segments that are nearest to given points; all (n, m, 2)."""
    along = last - first
    length = np.maximum((along**2).sum(axis=2), np.finfo(float).tiny)
    share = np.clip(((points - first) * along).sum(axis=2) / length, 0.0, 1.0)
    return np.asarray(first + share[..., None] * along)


def _crossing(start: FloatArray, end: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """Where segments cross, (n, m, 2); not a number where they do not."""
    one, two, between = end - start, last - first, first - start
    turn = _cross(one, two)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = [_cross(between, two) / turn, _cross(between, one) / turn]
    crosses = np.all([(share >= 0.0) & (share <= 1.0) for share in shares], axis=0)
    share = np.where(crosses, shares[0], np.nan)
    return np.asarray(start + share[..., None] * one)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
