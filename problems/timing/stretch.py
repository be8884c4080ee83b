"""By what factor the time of a motion has to be multiplied for its limits to hold for all t: no more, no less."""

from __future__ import annotations

from math import comb

import numpy as np

from problems.base.bernstein import bernstein
from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.robots.robot import JointLimits

MAX_HALVINGS = 40  # of a piece
RESOLUTION = 1e-11  # relative, to which a peak is found; it is never found too small


def minimum_time_scale(trajectory: Trajectory, limits: JointLimits) -> float:
    """The least factor, 1e-11 too large at most; below 1 where time can be saved."""
    return max(float(ratio ** (1.0 / order)) for order, ratio in enumerate(peak_ratios(trajectory, limits), start=1))


def peak_ratios(trajectory: Trajectory, limits: JointLimits) -> list[float]:
    """Bounds of the largest speed, acceleration and, where limited, jerk over all t, as shares of their limits."""
    bounds = [limits.speed, limits.acceleration, *([] if limits.jerk is None else [limits.jerk])]
    durations = np.diff(trajectory.breakpoints)
    ratios = []
    for order, bound in enumerate(bounds, start=1):
        curves = bernstein(np.asarray(trajectory.derivative(order).c), durations)
        ratios.append(_peak((curves / np.array(bound)).reshape(len(curves), -1)))
    return ratios


def _peak(curves: FloatArray) -> float:
    """An upper bound of the largest absolute value of curves in Bernstein form, (n + 1, m), by halving them."""
    n = len(curves) - 1
    half = np.array([[comb(i, j) / 2**i if j <= i else 0.0 for j in range(n + 1)] for i in range(n + 1)])
    reached = 0.0
    for _ in range(MAX_HALVINGS):
        reached = max(reached, float(np.abs(curves[[0, -1]]).max()))
        undecided = np.abs(curves).max(axis=0) > reached * (1.0 + RESOLUTION)
        if not undecided.any():
            return reached * (1.0 + RESOLUTION)
        curves = curves[:, undecided]
        curves = np.concatenate([half @ curves, (half @ curves[::-1])[::-1]], axis=1)
    return float(np.abs(curves).max())
