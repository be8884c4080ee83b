"""Clearance proven for all t, and the closest approach.

Around the middle m of a time cell of length h, no point of the links 1..i moves farther than

    r_i = sum over j <= i of l_j (|dpsi_j(m)| h / 2 + max |d2psi_j| h^2 / 8),

and the distance from an obstacle changes by no more than the points do. Of two links only the turning of the links
between them counts, as seen from the first: psi_j - psi_i in the place of psi_j. A cell is settled where clearance(m)
- r_i is large enough; the others are halved. An obstacle that moves by itself changes its distance by no more than its
own points move, which is subtracted too. The proof holds up to rounding in floating point.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from problems.base import FloatArray
from problems.certify.pairs import MovingPairs, halves
from problems.certify.verdict import CertificateStatus
from problems.limits import Proximity
from problems.motions import Trajectory

INITIAL_CELLS = {2: 400, 3: 100}  # in the plane, and in space, where there are many pairs and most are far apart
RELATIVE_PROOF_GAP = 0.1  # of the smallest clearance seen beyond the margin: what is proven is lower by this
MAX_CELLS = 200_000


@dataclass(frozen=True)
class ClearanceProof:
    """Bounds of the clearance of a whole motion.

    Attributes:
        proven: the clearance of all pairs that could meet is at least this for all t, m; -inf when it is below the
            margin somewhere, or when ``MAX_CELLS`` cells were not enough.
        smallest: the smallest clearance at any time that was evaluated, m.
        time: of that, s.
        where: the pair of that.
        broken: whether the distance itself is below the margin then, not only a lower bound of it.
    """

    proven: float
    smallest: float
    time: float
    where: str
    broken: bool

    @property
    def status(self) -> CertificateStatus:
        """Clear for all t, too near at some time, or not known."""
        if self.proven > -np.inf:
            return CertificateStatus.CERTIFIED
        return CertificateStatus.VIOLATED if self.broken else CertificateStatus.UNDECIDED


def prove_clearance(limit: Proximity, trajectory: Trajectory) -> ClearanceProof | None:
    """Bound the clearance of a motion for all t; None when nothing can touch."""
    robot, margin = limit.robot, limit.robot.margin
    pairs = tuple(pair for pair in limit.pairs if pair.can_touch(robot))
    if not pairs:
        return None
    motion = MovingPairs.of(robot, pairs, trajectory)
    edges = trajectory.times(INITIAL_CELLS[robot.dim])
    cells = np.column_stack([edges[:-1], edges[1:]])
    unsettled = np.ones((len(cells), len(pairs)), dtype=bool)
    minima: list[tuple[float, float, int]] = []
    cell_count = 0
    while True:
        nearest, column, low = motion.around_middles(cells, unsettled)
        cell = int(np.argmin(nearest))
        minima.append((float(nearest[cell]), float(cells[cell].mean()), int(column[cell])))
        (smallest, time, number), cell_count = min(minima), cell_count + len(cells)
        proven = margin + (smallest - margin) * (1.0 - RELATIVE_PROOF_GAP)
        unsettled = low < proven
        left = np.asarray(unsettled.any(axis=1))
        cells, unsettled = halves(cells[left]), np.tile(unsettled[left] if robot.dim > 2 else left[left, None], (2, 1))
        if not len(cells) and smallest >= margin:
            return ClearanceProof(proven, smallest, time, str(pairs[number]), broken=False)
        if smallest < margin or cell_count + len(cells) > MAX_CELLS:
            broken = smallest < margin and motion.distance(number, time) < margin
            return ClearanceProof(-np.inf, smallest, time, str(pairs[number]), broken)


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
