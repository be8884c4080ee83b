"""Clearance for all t, not only at samples: a lower bound proven by subdivision of time.

Around the middle m of a time cell of length h, no point of the links 1..i moves farther than

    r_i = sum over j <= i of l_j (|dpsi_j(m)| h / 2 + max |d2psi_j| h^2 / 8),

and the clearance of :meth:`Ellipse.segment_clearance` changes by no more than the points do. A cell is settled where
clearance(m) - r_i is large enough; the others are halved. The proof holds up to rounding in floating point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, as_array
from problems.certify.verdict import CertificateStatus
from problems.limits.clearance import Clearance, CollisionPair
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot

INITIAL_CELLS = 400
RELATIVE_PROOF_GAP = 0.1  # of the smallest clearance seen: the bound proven is lower by this, so that few cells do
MAX_CELLS = 200_000


@dataclass(frozen=True)
class ClearanceProof:
    """Bounds of the clearance of a whole motion.

    Attributes:
        proven: the clearance is at least this for all t, m; -inf when it is negative somewhere, or when ``MAX_CELLS``
            cells were not enough.
        smallest: the smallest clearance at any time that was evaluated, m.
        time: of that, s.
        where: the link and the obstacle of that.
    """

    proven: float
    smallest: float
    time: float
    where: str

    @property
    def status(self) -> CertificateStatus:
        """Clear for all t, touching at some time, or not known."""
        if self.proven >= 0.0:
            return CertificateStatus.CERTIFIED
        return CertificateStatus.VIOLATED if self.smallest < 0.0 else CertificateStatus.UNDECIDED


def prove_clearance(limit: Clearance, trajectory: Trajectory) -> ClearanceProof | None:
    """Bound the clearance of a motion for all t; None when no body can reach any obstacle."""
    robot = limit.robot
    pairs = [pair for pair in limit.pairs if robot.reach(pair.body.end)[1] >= pair.obstacle.distance_to(robot.base)]
    if not pairs:
        return None
    motion = _MovingPairs(robot, pairs, trajectory)
    edges = trajectory.times(INITIAL_CELLS)
    cells = np.column_stack([edges[:-1], edges[1:]])
    minima: list[tuple[float, float, str]] = []
    cell_count = 0
    while True:
        clearance, fall = motion.around_middles(cells)
        cell, column = np.unravel_index(np.argmin(clearance), clearance.shape)
        minima.append((float(clearance[cell, column]), float(cells[cell].mean()), str(pairs[column])))
        smallest, cell_count = min(minima), cell_count + len(cells)
        proven = smallest[0] * (1.0 - RELATIVE_PROOF_GAP)
        cells = _halves(cells[(clearance - fall).min(axis=1) < proven])
        if not len(cells) and smallest[0] >= 0.0:
            return ClearanceProof(proven, *smallest)
        if smallest[0] < 0.0 or cell_count + len(cells) > MAX_CELLS:
            return ClearanceProof(-np.inf, *smallest)


@dataclass(frozen=True)
class _MovingPairs:
    """A trajectory seen by the bodies and obstacles that may meet."""

    robot: Robot
    pairs: list[CollisionPair]
    trajectory: Trajectory

    @cached_property
    def turning(self) -> Trajectory:
        """The angles over time whose rates bound how bodies move: for a planar arm the orientations of its links."""
        coefficients = np.einsum("mj,ipj->ipm", self.robot.turns, self.trajectory.coefficients)
        return Trajectory(self.trajectory.breakpoints, coefficients)

    @cached_property
    def sharpest(self) -> FloatArray:
        """Its largest second derivatives over all t, (m,), rad/s^2."""
        return np.asarray(np.abs(self.turning.at(self.turning.extreme_times(2), 2)).max(axis=0))

    def around_middles(self, cells: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Clearance of each pair in the middle of cells (n, 2), and how far it can fall in the cell: (n, pairs), m."""
        middles, h = cells.mean(axis=1), np.diff(cells, axis=1)
        positions = self.robot.positions(ca.DM(self.trajectory.at(middles)))
        speeds = np.abs(self.turning.at(middles, 1))
        moves = (speeds * h / 2.0 + self.sharpest * h**2 / 8.0) @ self.robot.levers.T
        bodies = [self.robot.bodies.index(pair.body) for pair in self.pairs]
        return np.column_stack([as_array(pair.clearance(positions)) for pair in self.pairs]), moves[:, bodies]


def _halves(cells: FloatArray) -> FloatArray:
    middles = cells.mean(axis=1)
    return np.concatenate([np.column_stack([cells[:, 0], middles]), np.column_stack([middles, cells[:, 1]])])
