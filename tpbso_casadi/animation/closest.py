"""What comes closest in a motion in space: two things at each time, how far they are apart, and where."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.assembly.criteria import Criteria
from problems.base.matrix import FloatArray, as_array
from problems.limits.distances.proximity import Pair, Proximity, clearances


@dataclass(frozen=True)
class Closest:
    """The closest two of all that have to keep a distance, at n times.

    Attributes:
        pairs: those that are the closest at any time.
        numbers: of the closest, (n,).
        distances: as the limits compute them, (n,), m; negative where the two meet.
        points: on both surfaces, (n, 2, 3), m.
    """

    pairs: tuple[Pair, ...]
    numbers: np.ndarray
    distances: FloatArray
    points: FloatArray


def closest_of(criteria: Criteria, theta: FloatArray, times: FloatArray) -> Closest | None:
    """The closest two in n postures (n, dof), rad, of a robot made of balls, at times (n,) in s.

    None where nothing has to keep apart.
    """
    limits = [limit for limit in criteria.limits if isinstance(limit, Proximity)]
    pairs = [pair.without_growth() for limit in limits for pair in limit.pairs]
    if not pairs:
        return None
    frames, clock = criteria.robot.positions(ca.DM(theta)), ca.DM(times)
    apart = as_array(clearances(pairs, frames, clock))
    every, numbers = np.unique(apart.argmin(axis=1), return_inverse=True)
    distances = apart.min(axis=1)
    points = np.empty((len(theta), 2, 3))
    for number, index in enumerate(every):
        rows = np.flatnonzero(numbers == number)
        ends = [as_array(end)[rows] for end in pairs[index].ends(frames)]
        points[rows] = _surfaces(pairs[index], ends, times[rows], distances[rows, None])
    return Closest(tuple(pairs[index] for index in every), numbers, distances, points)


def _surfaces(pair: Pair, ends: list[FloatArray], times: FloatArray, distances: FloatArray) -> FloatArray:
    """Where the surface of the first ball of a pair, and that of the other thing, are nearest: (n, 2, 3)."""
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
