"""What comes closest in a motion: two things at each time, how far they are apart, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.assembly.criteria import Criteria
from problems.base.matrix import FloatArray, Matrix, as_array
from problems.limits.distances.proximity import Pair, Proximity, clearances
from tpbso_casadi.animation.nearest import nearest


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
