"""Torques for all t: a bound proven by Taylor models over cells of time.

In a cell every joint's angle, speed and acceleration is a polynomial, and the recursion of Newton and Euler makes of
them a polynomial of degree 3 for the torque and a bound of how far from that it can be, rounding included. Cells in
which this does not settle the limit are halved; the bound closes in with the fourth power of their length. Coulomb
friction takes any value between its two where a joint may stand still: the limit has to hold for all of them.

[1] J. Luh, M. Walker, R. Paul: On-line computational scheme for mechanical manipulators. Journal of Dynamic Systems,
    Measurement, and Control 102 (1980).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray
from problems.certify.dynamics.moving_arm import MovingArm
from problems.certify.dynamics.time_cells import Moments, TimeCells
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict
from problems.limits.torque import TorqueLimit
from problems.motions.trajectory import Trajectory

INITIAL_CELLS = 24
MAX_CELLS = 5_000  # beyond those that the pieces need
PROOF_GAP = 1e-3  # of the largest torque seen: what is proven is at most this much higher
LEAST_SHARE = 1e-3  # of a limit: smaller torques need not be known any better


@dataclass(frozen=True, eq=False)
class TorqueProof:
    """What is known of the torques of a whole motion.

    Attributes:
        arm: whose.
        status: whether they keep their limits.
        worst: the torque seen that is the largest share of its limit, with its sign, N m or N; proven to be nowhere
            more than ``PROOF_GAP`` larger, unless undecided.
        joint: of that, from 0 on.
        time: of that, s.
        held: whether the motor could hold the joint where it is then.
        broken: times at which a limit was seen to be broken.
    """

    arm: MovingArm
    status: CertificateStatus
    worst: float
    joint: int
    time: float
    held: bool
    broken: Moments

    @property
    def verdict(self) -> Verdict:
        """In words; a limit that is broken where standing still breaks it too is broken however slowly."""
        limit = self.arm.limit
        bound, robot = limit.bounds[self.joint], limit.robot
        where = f"{robot.joint_names[self.joint]}, t = {self.time:.4g} s"
        return Verdict(
            name=limit.name,
            worst=self.worst,
            bound=bound if self.worst >= 0.0 else -bound,
            unit=robot.torque_units[self.joint],
            status=self.status,
            where=where if self.held else f"{where}, however slowly",
        )


def prove_torques(limit: TorqueLimit, trajectory: Trajectory, tolerance: float = TOLERANCE) -> TorqueProof:
    """Bound the torques of a motion for all t.

    Args:
        limit: of the torques.
        trajectory: the motion.
        tolerance: relative to the limits, for rounding.
    """
    arm = MovingArm(limit, trajectory)
    allowed, seen = 1.0 + tolerance, _Seen.at(arm, arm.first_moments(INITIAL_CELLS))
    cells = TimeCells.over(trajectory, INITIAL_CELLS)
    count, most = 0, MAX_CELLS + len(cells)
    while len(cells) and count + len(cells) <= most and trajectory.is_finite:
        count += len(cells)
        sizes, likely = arm.over(cells)
        shares = (sizes / arm.bounds).max(axis=0)
        seen = seen.and_at(likely)
        aim = max(seen.share, LEAST_SHARE) * (1.0 + PROOF_GAP)
        aim = allowed if seen.share <= allowed < aim else aim
        cells = cells.halved(~(shares <= aim))
    if seen.share > allowed:
        status = CertificateStatus.VIOLATED
    else:
        status = CertificateStatus.UNDECIDED if len(cells) else CertificateStatus.CERTIFIED
    return TorqueProof(arm, status, *seen.worst, seen.broken(allowed))


@dataclass(frozen=True, eq=False)
class _Seen:
    """Torques at single times: (k, n), N m or N, at n moments."""

    arm: MovingArm
    moments: Moments
    torques: FloatArray

    @classmethod
    def at(cls, arm: MovingArm, moments: Moments) -> _Seen:
        return cls(arm, moments, arm.at(moments))

    def and_at(self, moments: Moments) -> _Seen:
        """Those at more times too."""
        torques = np.concatenate([self.torques, self.arm.at(moments)], axis=1)
        return _Seen(self.arm, self.moments.together(moments), torques)

    @cached_property
    def _shares(self) -> FloatArray:
        """Of the limits, (k, n)."""
        return np.asarray(np.abs(self.torques) / self.arm.bounds)

    @property
    def share(self) -> float:
        """The largest."""
        return float(self._shares.max())

    @property
    def worst(self) -> tuple[float, int, float, bool]:
        """That torque, its joint, its time in s, and whether the joint can be held there."""
        joint, moment = np.unravel_index(np.argmax(self._shares), self._shares.shape)
        when = self.moments.chosen(np.array([moment]))
        held = bool(self.arm.holds(when)[joint, 0])
        return float(self.torques[joint, moment]), int(joint), float(when.times[0]), held

    def broken(self, allowed: float) -> Moments:
        """When a torque is a larger share of its limit."""
        return self.moments.chosen(np.flatnonzero((self._shares > allowed).any(axis=0)))
