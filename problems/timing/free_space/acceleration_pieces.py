"""Motions given by accelerations that are linear in each of some pieces of time: cubic pieces, exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory

SAME_TIME = 4e-15  # of the duration: breakpoints that are one


@dataclass(frozen=True)
class AccelerationPieces:
    """Joint accelerations that are linear in time within each piece.

    Args:
        durations: of the p pieces, positive, (p,), s.
        accelerations: at the start of each piece, (p, k), rad/s^2.
        jerks: of each piece, (p, k), rad/s^3.
    """

    durations: FloatArray
    accelerations: FloatArray
    jerks: FloatArray

    def trajectory(self, theta: FloatArray, velocity: FloatArray) -> Trajectory:
        """The motion that starts at angles (k,) in rad with velocities (k,) in rad/s."""
        h = self.durations[:, None]
        gains = h * self.accelerations + h**2 * self.jerks / 2.0
        speeds = velocity + np.cumsum(gains, axis=0) - gains
        ways = h * speeds + h**2 * self.accelerations / 2.0 + h**3 * self.jerks / 6.0
        angles = theta + np.cumsum(ways, axis=0) - ways
        coefficients = np.stack([self.jerks / 6.0, self.accelerations / 2.0, speeds, angles])
        return Trajectory(np.concatenate([[0.0], np.cumsum(self.durations)]), coefficients)

    def split_at(self, times: FloatArray) -> AccelerationPieces:
        """The same accelerations in the pieces between times (n,) in s, which increase and hold all breakpoints."""
        ends = np.cumsum(self.durations)
        piece = np.minimum(np.searchsorted(ends, (times[:-1] + times[1:]) / 2.0), ends.size - 1)
        since = times[:-1] - (ends - self.durations)[piece]
        accelerations = self.accelerations[piece] + since[:, None] * self.jerks[piece]
        return AccelerationPieces(np.diff(times), accelerations, self.jerks[piece])


def side_by_side(motions: Sequence[AccelerationPieces], duration: float) -> AccelerationPieces:
    """The motions of several joints, each of which takes the duration in s, as one."""
    times = breakpoints(motions, duration)
    parts = [motion.split_at(times) for motion in motions]
    accelerations, jerks = (np.hstack([getattr(part, name) for part in parts]) for name in ("accelerations", "jerks"))
    return AccelerationPieces(np.diff(times), accelerations, jerks)


def breakpoints(motions: Sequence[AccelerationPieces], duration: float) -> FloatArray:
    """All times in s at which one of the motions has a breakpoint, those that are one merged."""
    times = np.unique(np.concatenate([np.cumsum(motion.durations)[:-1] for motion in motions]))
    times = times[(times > SAME_TIME * duration) & (times < (1.0 - SAME_TIME) * duration)]
    apart = np.diff(times, prepend=-inf) > SAME_TIME * duration
    return np.concatenate([[0.0], times[apart], [duration]])
