"""What a linear program has to keep of velocities, accelerations and jerks: their linearisation around a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray
from problems.robots.robot import JointLimits
from problems.sequential.path_speed import Grid, PathSpeed

NEARLY = 0.5  # of a limit: a share that a peak between the samples of rows has at least to be looked at


@dataclass(frozen=True)
class LimitRows:
    """Shares of limits at some samples, of some joints, to first order: each depends on the path of its joint alone.

    Attributes:
        values: (rows,).
        by_controls: slopes with respect to the control points of their joint, (rows, N).
        by_speeds: with respect to the speeds, (rows, M).
        joints: numbers, (rows,).
    """

    values: FloatArray
    by_controls: FloatArray
    by_speeds: FloatArray
    joints: NDArray[np.intp]

    def slopes(self, moves: FloatArray) -> FloatArray:
        """With respect to moves (N k, free) of all control points, and to the speeds: (rows, free + M)."""
        count = self.by_controls.shape[1]
        k = moves.shape[0] // count
        of_joint = moves.reshape(count, k, moves.shape[1])
        first = np.empty((self.values.size, moves.shape[1]))
        for joint in range(k):
            rows = self.joints == joint
            first[rows] = self.by_controls[rows] @ of_joint[:, joint]
        return np.concatenate([first, self.by_speeds], axis=1)


def limit_rows(motion: PathSpeed, grid: Grid, every: int, limits: JointLimits) -> LimitRows:
    """Velocities, accelerations and jerks at every so many samples of a grid, and wherever they are extreme."""
    parts: list[tuple[FloatArray, FloatArray, FloatArray, NDArray[np.intp]]] = []
    q1, q2, q3 = (matrix @ motion.controls for matrix in grid.path[1:])
    w, w1, w2 = ((matrix @ motion.speeds)[:, None] for matrix in grid.speed)
    along = [  # with respect to q', q'', q'''
        (w,),
        (w * w1, w**2),
        (w * (w1**2 + w * w2), 3.0 * w**2 * w1, w**3),
    ]
    across = [  # with respect to w, w', w''
        (q1,),
        (2.0 * q2 * w + q1 * w1, q1 * w),
        (3.0 * q3 * w**2 + 6.0 * q2 * w * w1 + q1 * (w1**2 + 2.0 * w * w2), 3.0 * q2 * w**2 + 2.0 * q1 * w * w1,
         q1 * w**2),
    ]  # fmt: skip
    bounds = (limits.speed, limits.acceleration, limits.jerk)
    for derivative, bound, path, speed in zip(motion.derivatives(grid), bounds, along, across, strict=True):
        if bound is None:
            continue
        shares = derivative / np.array(bound)
        samples, joints = looked_at(shares, every)
        scale = np.array(bound)[joints, None]
        by_controls = sum(f[samples] * m[samples] for f, m in zip(path, grid.path[1:], strict=False)) / scale
        by_speeds = (
            sum(f[samples, joints][:, None] * m[samples] for f, m in zip(speed, grid.speed, strict=False)) / scale
        )
        parts.append((shares[samples, joints], by_controls, by_speeds, joints))
    return LimitRows(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def looked_at(shares: FloatArray, every: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Samples and joints of rows: every so many samples, and where a column of shares (n, k) has a peak."""
    chosen = _peaks(np.abs(shares))
    chosen[::every] = True
    samples, joints = np.nonzero(chosen)
    return samples, joints


def _peaks(sizes: FloatArray) -> NDArray[np.bool_]:
    """Where a column (n, k) is largest for a while, and not small."""
    padded = np.pad(sizes, ((1, 1), (0, 0)), constant_values=-1.0)
    return (sizes >= padded[:-2]) & (sizes >= padded[2:]) & (sizes > NEARLY)
