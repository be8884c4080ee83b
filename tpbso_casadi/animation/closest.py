"""The closest two of a moment, as points to draw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.assembly import Criteria
from problems.base import FloatArray, Matrix, as_array
from problems.limits import Pair, Proximity, clearances


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


@dataclass(frozen=True)
class Closest:
    """The closest two of all that have to keep a distance, at n times.

    Attributes:
        pairs: those that are the closest at any time.
        numbers: of the closest, (n,).
        distances: (n,), m; negative where the two meet.
        points: on both surfaces, (n, 2, dim), m.
    """

    pairs: tuple[Pair, ...]
    numbers: np.ndarray
    distances: FloatArray
    points: FloatArray


def closest_of(criteria: Criteria, theta: FloatArray, times: FloatArray) -> Closest | None:
    """The closest two in n postures (n, dof), rad, at times (n,) in s.

    How far they are apart is what the limits say of balls, and of lines that meet; lines that do not are measured as
    they are drawn, because some limits know only a lower bound. None where nothing has to keep apart.
    """
    limits = [limit for limit in criteria.limits if isinstance(limit, Proximity)]
    pairs = [pair.without_growth() for limit in limits for pair in limit.pairs]
    if not pairs:
        return None
    frames = criteria.robot.positions(ca.DM(theta))
    apart_of, points_of = MEASURES[criteria.robot.dim]
    apart = apart_of(pairs, frames, times)
    every, numbers = np.unique(apart.argmin(axis=1), return_inverse=True)
    distances = apart.min(axis=1)
    points = np.empty((len(theta), 2, criteria.robot.dim))
    for number, index in enumerate(every):
        rows = np.flatnonzero(numbers == number)
        seen = [frame[rows.tolist(), :] for frame in frames]
        points[rows] = points_of(pairs[index], seen, times[rows], distances[rows, None])
    return Closest(tuple(pairs[index] for index in every), numbers, distances, points)


def _said_apart(pairs: Sequence[Pair], frames: Sequence[Matrix], times: FloatArray) -> FloatArray:
    """How far pairs are apart as the limits compute it, (n, pairs), m."""
    return as_array(clearances(pairs, frames, ca.DM(times)))


def _drawn_apart(pairs: Sequence[Pair], frames: Sequence[Matrix], times: FloatArray) -> FloatArray:
    """How far lines are apart as they are drawn, (n, pairs), m; what the limits say where they meet."""
    said, drawn = _said_apart(pairs, frames, times), [_between_lines(pair, frames, times) for pair in pairs]
    gaps = [np.linalg.norm(far - near, axis=1) for near, far in drawn]
    widths = [float(sum(pair.radii)) for pair in pairs]
    return np.where(said < 0.0, said, np.transpose(gaps) - widths)


def _between_lines(pair: Pair, frames: Sequence[Matrix], times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where the middle lines of two in the plane are nearest: (n, 2), m, each."""
    start, end = (as_array(end) for end in pair.ends(frames)[:2])
    return nearest(start, end, pair.opposite(frames, times))


def _points_on_lines(pair: Pair, frames: Sequence[Matrix], times: FloatArray, distances: FloatArray) -> FloatArray:
    """Where the surfaces of two in the plane are nearest: (n, 2, 2)."""
    near, far = _between_lines(pair, frames, times)
    toward = (far - near) / np.maximum(np.linalg.norm(far - near, axis=1, keepdims=True), np.finfo(float).tiny)
    first, *second = map(float, pair.radii)
    return np.stack([near + first * toward, far - sum(second) * toward], axis=1)


def _points_on_balls(pair: Pair, frames: Sequence[Matrix], times: FloatArray, distances: FloatArray) -> FloatArray:
    """Where the surface of the first ball of a pair, and that of the other thing, are nearest: (n, 2, 3)."""
    ends = [as_array(end) for end in pair.ends(frames)]
    middle, radius = ends[0], float(pair.radii[0])
    toward = -_gradient(pair, ends, times)
    near = middle + radius * toward
    return np.stack([near, near + distances * toward], axis=1)


def _gradient(pair: Pair, ends: list[FloatArray], times: FloatArray) -> FloatArray:
    """Unit vectors (n, 3) along which the first of a pair goes away from the other; 0 where there is no such way."""
    symbols = [ca.SX.sym(f"end_{number}", *end.shape) for number, end in enumerate(ends)]
    gradient = ca.gradient(ca.sum1(pair.between(*symbols, times=ca.DM(times))), symbols[0])
    away = as_array(ca.Function("gradient", symbols, [gradient])(*ends))
    return np.asarray(away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), np.finfo(float).tiny))


MEASURES = {2: (_drawn_apart, _points_on_lines), 3: (_said_apart, _points_on_balls)}  # by the robot's dimensions
