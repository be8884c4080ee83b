"""Clearance for all t, not only at samples: a lower bound proven by subdivision of time.

Around the middle m of a time cell of length h, no point of the links 1..i moves farther than

    r_i = sum over j <= i of l_j (|dpsi_j(m)| h / 2 + max |d2psi_j| h^2 / 8),

and the distance from an obstacle changes by no more than the points do. Of two links only the turning of the links
between them counts, as seen from the first: psi_j - psi_i in the place of psi_j. A cell is settled where clearance(m)
- r_i is large enough; the others are halved. The proof holds up to rounding in floating point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray, Matrix, as_array
from problems.certify.travel import halves
from problems.certify.verdict import CertificateStatus
from problems.limits.proximity import Pair, Proximity, clearances
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

INITIAL_CELLS = 400
RELATIVE_PROOF_GAP = 0.1  # of the smallest clearance seen beyond the margin: what is proven is lower by this
MAX_CELLS = 200_000
BLOCK = 1_000_000  # cells times pairs that are computed at once


@dataclass(frozen=True)
class ClearanceProof:
    """Bounds of the clearance of a whole motion.

    Attributes:
        proven: the clearance is at least this for all t, m; -inf when it is below the margin somewhere, or when
            ``MAX_CELLS`` cells were not enough.
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
    edges = trajectory.times(INITIAL_CELLS)
    cells = np.column_stack([edges[:-1], edges[1:]])
    minima: list[tuple[float, float, int]] = []
    cell_count = 0
    while True:
        nearest, column, low = motion.around_middles(cells)
        cell = int(np.argmin(nearest))
        minima.append((float(nearest[cell]), float(cells[cell].mean()), int(column[cell])))
        (smallest, time, number), cell_count = min(minima), cell_count + len(cells)
        proven = margin + (smallest - margin) * (1.0 - RELATIVE_PROOF_GAP)
        cells = halves(cells[low < proven])
        if not len(cells) and smallest >= margin:
            return ClearanceProof(proven, smallest, time, str(pairs[number]), broken=False)
        if smallest < margin or cell_count + len(cells) > MAX_CELLS:
            broken = smallest < margin and pairs[number].distance(motion.positions(np.array([time]))) < margin
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

    def around_middles(self, cells: FloatArray) -> tuple[FloatArray, NDArray[np.intp], FloatArray]:
        """Of cells (n, 2): the smallest clearance in the middle, its pair, a lower bound all through; (n,), m."""
        size = max(1, BLOCK // len(self.pairs))
        blocks = [self._block(cells[first : first + size]) for first in range(0, len(cells), size)]
        nearest, column, low = (np.concatenate(parts) for parts in zip(*blocks, strict=True))
        return nearest, column, low

    def _block(self, cells: FloatArray) -> tuple[FloatArray, NDArray[np.intp], FloatArray]:
        middles, h = cells.mean(axis=1), np.diff(cells, axis=1)
        positions = self.positions(middles)
        speeds = np.abs(self.turning.at(middles, 1))
        moves = (speeds * h / 2.0 + self.sharpest * h**2 / 8.0) @ self._rates[1].T
        clearance = as_array(clearances(self.pairs, positions))
        return clearance.min(axis=1), clearance.argmin(axis=1), (clearance - moves).min(axis=1)
