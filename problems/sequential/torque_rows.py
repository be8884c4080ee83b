"""What a linear program has to keep of the torques: their linearisation around a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray
from problems.sequential.joint_torques import JointTorques
from problems.sequential.limit_rows import looked_at
from problems.sequential.path_speed import Grid, PathSpeed


@dataclass(frozen=True)
class TorqueRows:
    """Shares of torque limits at some samples, of some joints, to first order: each depends on the path of all joints.

    Attributes:
        values: (rows,).
        by_controls: slopes with respect to all control points, (rows, N k).
        by_speeds: with respect to the speeds, (rows, M).
    """

    values: FloatArray
    by_controls: FloatArray
    by_speeds: FloatArray

    def slopes(self, moves: FloatArray) -> FloatArray:
        """With respect to moves (N k, free) of all control points, and to the speeds: (rows, free + M)."""
        return np.concatenate([self.by_controls @ moves, self.by_speeds], axis=1)


def torque_rows(motion: PathSpeed, grid: Grid, every: int, torques: JointTorques) -> TorqueRows:
    """Torques at every so many samples of a grid, and wherever they are extreme."""
    state = motion.state(grid)
    shares = torques.shares(state)
    samples, joints = looked_at(shares, every)
    used, places = np.unique(samples, return_inverse=True)
    of_angle, of_speed, of_acceleration = torques.slopes(state[used])[places, joints].transpose(1, 0, 2)
    q1, q2 = (matrix[samples] @ motion.controls for matrix in grid.path[1:3])
    w, w1 = ((matrix[samples] @ motion.speeds)[:, None] for matrix in grid.speed[:2])
    along = (of_angle, of_speed * w + of_acceleration * w * w1, of_acceleration * w**2)  # with respect to q, q', q''
    by_controls = sum(m[samples][:, :, None] * f[:, None, :] for m, f in zip(grid.path, along, strict=False))
    by_w = (of_speed * q1 + of_acceleration * (2.0 * q2 * w + q1 * w1)).sum(axis=1)
    by_w1 = (of_acceleration * q1 * w).sum(axis=1)
    by_speeds = by_w[:, None] * grid.speed[0][samples] + by_w1[:, None] * grid.speed[1][samples]
    return TorqueRows(shares[samples, joints], np.reshape(by_controls, (samples.size, -1)), by_speeds)
