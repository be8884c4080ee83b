"""Clearance for all t, not only at samples: a lower bound proven by subdivision of time.

Around the middle m of a time cell of length h, no point of the links 1..i moves farther than

    r_i = sum over j <= i of l_j (|dpsi_j(m)| h / 2 + max |d2psi_j| h^2 / 8),

and the distance from an obstacle changes by no more than the points do. Of two links only the turning of the links
between them counts, as seen from the first: psi_j - psi_i in the place of psi_j. A cell is settled where clearance(m)
- r_i is large enough; the others are halved. An obstacle that moves by itself changes its distance by no more than its
own points move, which is subtracted too. The proof holds up to rounding in floating point.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray, Matrix, as_array
from problems.certify.travel import halves
from problems.certify.verdict import CertificateStatus
from problems.limits.distances.proximity import Pair, Proximity
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

INITIAL_CELLS = {2: 400, 3: 100}  # in the plane, and in space, where there are many pairs and most are far apart
RELATIVE_PROOF_GAP = 0.1  # of the smallest clearance seen beyond the margin: what is proven is lower by this
MAX_CELLS = 200_000
BLOCK = 1_000_000  # cells times pairs that are computed at once


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
    pairs = [pair for pair in limit.pairs if pair.can_touch(robot)]
    if not pairs:
        return None
    motion = _MovingPairs(robot, pairs, trajectory)
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


@dataclass(frozen=True)
class _MovingPairs:
    """A trajectory seen by pairs that may meet."""

    robot: Robot
    pairs: list[Pair]
    trajectory: Trajectory

    @cached_property
    def _rates(self) -> tuple[FloatArray, FloatArray]:
        """All turns that move any pair, (m, dof), and their levers, (pairs, m), m."""
        motions = [pair.motion(self.robot) for pair in self.pairs]
        numbers: dict[tuple[float, ...], int] = {}
        for turns, _ in motions:
            for turn in turns.tolist():
                numbers.setdefault(tuple(turn), len(numbers))
        levers = np.zeros((len(motions), len(numbers)))
        for row, (turns, own) in zip(levers, motions, strict=True):
            row[[numbers[tuple(turn)] for turn in turns.tolist()]] = own
        return np.array(list(numbers)), levers

    @cached_property
    def turning(self) -> Trajectory:
        """The angles over time whose rates bound how bodies move: for a planar arm the orientations of its links."""
        coefficients = np.einsum("mj,ipj->ipm", self._rates[0], self.trajectory.coefficients)
        return Trajectory(self.trajectory.breakpoints, coefficients)

    @cached_property
    def sharpest(self) -> FloatArray:
        """Its largest second derivatives over all t, (m,), rad/s^2; on both sides of where they may jump."""
        just_before = np.nextafter(self.trajectory.breakpoints[1:], 0.0)
        times = np.concatenate([self.turning.extreme_times(2), just_before])
        return np.asarray(np.abs(self.turning.at(times, 2)).max(axis=0))

    def positions(self, times: FloatArray) -> tuple[Matrix, ...]:
        """Where the robot's frames are at times (n,) in s."""
        return self.robot.positions(ca.DM(self.trajectory.at(times)))

    def distance(self, number: int, time: float) -> float:
        """Of one pair at a time in s, exact to rounding, m."""
        return self.pairs[number].distance(self.positions(np.array([time])), ca.DM(time))

    def _own_travels(self, cells: FloatArray) -> FloatArray:
        """How much distances can change within cells because obstacles move, (n, pairs), m."""
        travels = np.zeros((len(cells), len(self.pairs)))
        for members, _ in self._groups:
            first = self.pairs[members[0]]
            if first.timed:
                travels[:, members] = first.own_travel(self.robot, cells)[:, None]
        return travels

    @cached_property
    def _groups(self) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
        """Pairs that are computed together: their numbers (members,), and those of their frames, (members, ends)."""
        groups: dict[Hashable, list[int]] = {}
        for number, pair in enumerate(self.pairs):
            groups.setdefault(pair.group, []).append(number)
        return [(np.array(group), np.array([self.pairs[k].frames for k in group])) for group in groups.values()]

    @cached_property
    def _thickness(self) -> FloatArray:
        return np.array([float(pair.thickness) for pair in self.pairs])

    def around_middles(
        self, cells: FloatArray, chosen: NDArray[np.bool_]
    ) -> tuple[FloatArray, NDArray[np.intp], FloatArray]:
        """What pairs keep around the middles of cells.

        Args:
            cells: start and end of each, (n, 2), s.
            chosen: which pairs are looked at in each, (n, pairs), or (n, 1) for all or none.

        Returns:
            The smallest clearance in the middle and its pair, both (n,); a lower bound of the clearance of each pair
            all through, (n, pairs), infinite of those that are not looked at; m.
        """
        size = max(1, BLOCK // len(self.pairs))
        blocks = [self._block(cells[k : k + size], chosen[k : k + size]) for k in range(0, len(cells), size)]
        nearest, column, low = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
        return nearest, column, low

    def _block(self, cells: FloatArray, chosen: NDArray[np.bool_]) -> tuple[FloatArray, NDArray[np.intp], FloatArray]:
        middles, h = cells.mean(axis=1), np.diff(cells, axis=1)
        speeds = np.abs(self.turning.at(middles, 1))
        moves = (speeds * h / 2.0 + self.sharpest * h**2 / 8.0) @ self._rates[1].T + self._own_travels(cells)
        clearance = self._clearances(middles, np.broadcast_to(chosen, moves.shape))
        return clearance.min(axis=1), clearance.argmin(axis=1), clearance - moves

    def _clearances(self, times: FloatArray, chosen: NDArray[np.bool_]) -> FloatArray:
        """Of the pairs that are looked at, (n, pairs), m; infinite of the others."""
        places = np.stack([as_array(place) for place in self.positions(times)])
        found = np.full(chosen.shape, np.inf)
        for members, frames in self._groups:
            rows, which = np.nonzero(chosen[:, members])
            if rows.size:
                ends = [ca.DM(places[numbers, rows]) for numbers in frames[which].T]
                distances = as_array(self.pairs[members[0]].between(*ends, times=ca.DM(times[rows]))).ravel()
                found[rows, members[which]] = distances - self._thickness[members[which]]
        return found
