"""Clearance for all t, not only at samples: a lower bound that subdivision of time proves.

Around the middle m of a time cell of length h, no point of the links 1..i moves farther than

    r_i = sum over j <= i of l_j (|dpsi_j(m)| h / 2 + max |d2psi_j| h^2 / 8),

and the clearance of :meth:`Ellipse.segment_clearance` changes by no more than the points do. A cell is settled where
clearance(m) - r_i is large enough; the others are halved. The proof holds up to rounding in floating point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray, as_array
from problems.limits.constraint import CertificateStatus
from problems.limits.motion_limits import Pair, link_clearances, reachable_pairs
from problems.motions.trajectory import Trajectory
from problems.robots.planar import PlanarArm
from problems.scene.ellipse import Ellipse

FIRST_CELLS = 400
PROOF_GAP = 0.1  # share of the smallest clearance met that the proof gives away, so that few cells are needed
MOST_CELLS = 200_000


@dataclass(frozen=True)
class ClearanceProof:
    """What is known of the clearance of a whole motion.

    Attributes:
        proven: the clearance is at least this for all t, m; -inf when it is negative somewhere, or when ``MOST_CELLS``
            cells were not enough.
        smallest: the smallest clearance met at any time looked at, m.
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


def prove_clearance(arm: PlanarArm, obstacles: Sequence[Ellipse], trajectory: Trajectory) -> ClearanceProof | None:
    """Bound the clearance of a motion for all t; None when no link can reach any obstacle."""
    pairs = reachable_pairs(arm, obstacles)
    if not pairs:
        return None
    motion = _Motion(arm, pairs, trajectory)
    edges = trajectory.times(FIRST_CELLS)
    cells = np.column_stack([edges[:-1], edges[1:]])
    met: list[tuple[float, float, str]] = []
    looked_at = 0
    while True:
        clearance, fall = motion.around_middles(cells)
        cell, column = np.unravel_index(np.argmin(clearance), clearance.shape)
        met.append((float(clearance[cell, column]), float(cells[cell].mean()), str(pairs[column])))
        smallest, looked_at = min(met), looked_at + len(cells)
        wanted = smallest[0] * (1.0 - PROOF_GAP)
        cells = _halves(cells[(clearance - fall).min(axis=1) < wanted])
        if not len(cells) and smallest[0] >= 0.0:
            return ClearanceProof(wanted, *smallest)
        if smallest[0] < 0.0 or looked_at + len(cells) > MOST_CELLS:
            return ClearanceProof(-np.inf, *smallest)


@dataclass(frozen=True)
class _Motion:
    """A trajectory seen by the links and obstacles that may meet."""

    arm: PlanarArm
    pairs: list[Pair]
    trajectory: Trajectory

    @cached_property
    def orientations(self) -> Trajectory:
        """Link orientations psi over time."""
        return Trajectory(self.trajectory.breakpoints, np.cumsum(self.trajectory.coefficients, axis=2))

    @cached_property
    def sharpest(self) -> FloatArray:
        """Largest |d2psi_j| over all t, (k,), rad/s^2."""
        times = self.orientations.extreme_times(2)
        return np.asarray(np.abs(as_array(self.orientations.samples(times).acceleration)).max(axis=0))

    def around_middles(self, cells: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Clearance of each pair in the middle of cells (n, 2), and how far it can fall in the cell: (n, pairs), m."""
        middles, h = cells.mean(axis=1), np.diff(cells, axis=1)
        x, y = self.arm.joint_positions(self.trajectory.samples(middles).theta)
        turning = np.abs(as_array(self.orientations.samples(middles).speed))
        moves = np.cumsum(self.arm.link_lengths * (turning * h / 2.0 + self.sharpest * h**2 / 8.0), axis=1)
        links = [pair.link - 1 for pair in self.pairs]
        return as_array(link_clearances(self.pairs, x, y)), moves[:, links]


def _halves(cells: FloatArray) -> FloatArray:
    middles = cells.mean(axis=1)
    return np.concatenate([np.column_stack([cells[:, 0], middles]), np.column_stack([middles, cells[:, 1]])])
