"""Limits of joints and torques as linear rows about a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.robots import JointLimits
from problems.sequential.path_speed import Grid, PathSpeed
from problems.sequential.torques import JointTorques

LARGE_SHARE = 0.5  # of a limit: smaller peaks between the samples of rows get no row


@dataclass(frozen=True)
class LimitRows:
    """Shares of limits at some samples, of some joints, to first order.

    Attributes:
        values: (rows,).
        by_controls: slopes with respect to all control points, (rows, N k), or to those of their joint, (rows, N).
        by_speeds: with respect to the speeds, (rows, M).
        joints: numbers, (rows,), where each depends on the path of its joint alone; else None.
    """

    values: FloatArray
    by_controls: FloatArray
    by_speeds: FloatArray
    joints: NDArray[np.intp] | None = None

    def slopes(self, moves: FloatArray) -> FloatArray:
        """Slopes by moves (N k, free) of all control points, and by the speeds: (rows, free + M)."""
        if self.joints is None:
            return np.concatenate([self.by_controls @ moves, self.by_speeds], axis=1)
        count = self.by_controls.shape[1]
        k = moves.shape[0] // count
        of_joint = moves.reshape(count, k, moves.shape[1])
        first = np.empty((self.values.size, moves.shape[1]))
        for joint in range(k):
            rows = self.joints == joint
            first[rows] = self.by_controls[rows] @ of_joint[:, joint]
        return np.concatenate([first, self.by_speeds], axis=1)


def derivative_limit_rows(motion: PathSpeed, grid: Grid, every: int, limits: JointLimits) -> LimitRows:
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
    for derivative, bound, path, speed in zip(motion.derivatives(grid), limits.by_order, along, across, strict=False):
        shares = derivative / bound
        samples, joints = sampled_rows(shares, every)
        scale = bound[joints, None]
        by_controls = sum(f[samples] * m[samples] for f, m in zip(path, grid.path[1:], strict=False)) / scale
        by_speeds = (
            sum(f[samples, joints][:, None] * m[samples] for f, m in zip(speed, grid.speed, strict=False)) / scale
        )
        parts.append((shares[samples, joints], by_controls, by_speeds, joints))
    return LimitRows(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def sampled_rows(shares: FloatArray, every: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Samples and joints of rows: every so many samples, and where a column of shares (n, k) has a peak."""
    chosen = _peaks(np.abs(shares))
    chosen[::every] = True
    samples, joints = np.nonzero(chosen)
    return samples, joints


def _peaks(sizes: FloatArray) -> NDArray[np.bool_]:
    """Mask of the local maxima of each column (n, k) that are not small."""
    padded = np.pad(sizes, ((1, 1), (0, 0)), constant_values=-1.0)
    return (sizes >= padded[:-2]) & (sizes >= padded[2:]) & (sizes > LARGE_SHARE)


def torque_limit_rows(motion: PathSpeed, grid: Grid, every: int, torques: JointTorques) -> LimitRows:
    """Torques at every so many samples of a grid, and wherever they are extreme."""
    state = motion.state(grid)
    shares = torques.shares(state)
    samples, joints = sampled_rows(shares, every)
    used, places = np.unique(samples, return_inverse=True)
    of_angle, of_speed, of_acceleration = torques.slopes(state[used])[places, joints].transpose(1, 0, 2)
    q1, q2 = (matrix[samples] @ motion.controls for matrix in grid.path[1:3])
    w, w1 = ((matrix[samples] @ motion.speeds)[:, None] for matrix in grid.speed[:2])
    along = (of_angle, of_speed * w + of_acceleration * w * w1, of_acceleration * w**2)  # with respect to q, q', q''
    by_controls = sum(m[samples][:, :, None] * f[:, None, :] for m, f in zip(grid.path, along, strict=False))
    by_w = (of_speed * q1 + of_acceleration * (2.0 * q2 * w + q1 * w1)).sum(axis=1)
    by_w1 = (of_acceleration * q1 * w).sum(axis=1)
    by_speeds = by_w[:, None] * grid.speed[0][samples] + by_w1[:, None] * grid.speed[1][samples]
    return LimitRows(shares[samples, joints], np.reshape(by_controls, (samples.size, -1)), by_speeds)


@dataclass(frozen=True)
class LinearLimits:
    """Shares of all limits to first order.

    Attributes:
        parts: of one kind each.
    """

    parts: tuple[LimitRows, ...]

    @property
    def values(self) -> FloatArray:
        """The values of all rows, (rows,)."""
        return np.concatenate([part.values for part in self.parts])

    @property
    def by_speeds(self) -> FloatArray:
        """Slopes with respect to the speeds, (rows, M)."""
        return np.concatenate([part.by_speeds for part in self.parts])

    def slopes(self, moves: FloatArray) -> FloatArray:
        """Slopes by moves (N k, free) of all control points, and by the speeds: (rows, free + M)."""
        return np.concatenate([part.slopes(moves) for part in self.parts])


@dataclass(frozen=True)
class MotionLimits:
    """The limits that a motion of a robot keeps.

    Args:
        joints: of velocities, accelerations and jerks, and the joints' ranges.
        torques: None where they are not limited.
    """

    joints: JointLimits
    torques: JointTorques | None = None

    def time_scale(self, motion: PathSpeed, grid: Grid) -> float:
        """The time scale at which a motion keeps them on a grid; below 1 where time can be saved."""
        factor = motion.time_scale(grid, self.joints)
        return factor if self.torques is None else max(factor, self.torques.time_scale(motion.state(grid)))

    def linear(self, motion: PathSpeed, grid: Grid, every: int) -> LinearLimits:
        """The limits linearised around a motion, at every so many samples of a grid and wherever one is extreme."""
        rows = derivative_limit_rows(motion, grid, every, self.joints)
        if self.torques is None:
            return LinearLimits((rows,))
        return LinearLimits((rows, torque_limit_rows(motion, grid, every, self.torques)))
