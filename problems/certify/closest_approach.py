"""When and where a motion comes closest to something, as exactly as an engineer wants to know it."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from problems.base.matrix import FloatArray
from problems.certify.distances.moving_pairs import MovingPairs
from problems.limits.distances.proximity import Proximity
from problems.motions.trajectory import Trajectory

TIMES = 400  # at least, at which all pairs are looked at
CANDIDATES, OF_EACH = 6, 2  # of the dips seen there that are followed to the bottom, the deepest ones; of each pair
RELATIVE_RESOLUTION = 1e-7  # of the time between two looks
ROUNDING = 1e-9  # m: no less is no less


@dataclass(frozen=True)
class ClosestApproach:
    """The smallest distance of a motion.

    Attributes:
        distance: between the surfaces, m; not positive where they touch.
        time: of that, s.
        pair: that comes so near.
    """

    distance: float
    time: float
    pair: str


def closest_approach(limit: Proximity, trajectory: Trajectory) -> ClosestApproach | None:
    """The closest approach of all pairs of a limit, found at many times and followed from there to about 1e-6 m.

    Obstacles that move are where they are predicted. This is no proof: :func:`prove_clearance` gives a lower bound.

    Args:
        limit: on distances, from obstacles or of the robot's own bodies.
        trajectory: of the robot.

    Returns:
        None where there are no pairs.
    """
    if not limit.pairs:
        return None
    motion = MovingPairs.of(limit.robot, tuple(pair.without_growth() for pair in limit.pairs), trajectory)
    times = trajectory.times(TIMES)
    seen = motion.clearances(times, np.ones((len(times), len(motion.pairs)), dtype=bool))
    found = [_followed(motion, times, row, number) for row, number in _dips(seen)]
    distance, time, number = min(found)
    return ClosestApproach(distance, time, str(motion.pairs[number]))


def _dips(distances: FloatArray) -> list[tuple[int, int]]:
    """Rows and pairs of the deepest minima over rows, of distances (n, pairs): few of each pair, one at least."""
    around = np.pad(distances, ((1, 1), (0, 0)), constant_values=np.inf)
    rows, numbers = np.nonzero((distances < around[:-2]) & (distances <= around[2:]))
    counts: Counter[int] = Counter()
    dips = []
    for k in np.argsort(distances[rows, numbers], kind="stable"):
        counts[int(numbers[k])] += 1
        if counts[int(numbers[k])] <= OF_EACH:
            dips.append((int(rows[k]), int(numbers[k])))
    return dips[:CANDIDATES]


def _followed(motion: MovingPairs, times: FloatArray, row: int, number: int) -> tuple[float, float, int]:
    """The least distance of a pair between the times around one of them, the time of that, and the pair."""

    def distance(time: float) -> float:
        return motion.distance(number, time)

    low, middle, high = (float(times[k]) for k in (max(row - 1, 0), row, min(row + 1, len(times) - 1)))
    seen = min((distance(time), time) for time in (low, middle, high))
    inner = minimize_scalar(
        distance, bounds=(low, high), method="bounded", options={"xatol": RELATIVE_RESOLUTION * (high - low)}
    )
    lower = float(inner.fun) < seen[0] - ROUNDING
    return (float(inner.fun), float(inner.x), number) if lower else (*seen, number)
