"""From the pieces of a solution to an exact motion: waypoints, end velocities and smoothness hold to rounding.

A solver leaves about 1e-8 of each equality. The pieces are integrated, which makes the motion smooth, and their jerks
(or accelerations) are changed by the least that removes what is left at the waypoints and at the end: a linear system.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.timing.free_space.acceleration_pieces import AccelerationPieces

CORRECTIONS = 3  # each leaves about 1e-12 of what it corrects


@dataclass(frozen=True)
class Waypoints:
    """What a motion through nodes has to meet.

    Attributes:
        nodes: numbers of the nodes that are waypoints, increasing, the first 0 and the last one that of the end, (m,).
        theta: angles there, (m, k), rad.
        velocities: at both ends, (2, k), rad/s.
    """

    nodes: NDArray[np.intp]
    theta: FloatArray
    velocities: FloatArray


def through(pieces: AccelerationPieces, waypoints: Waypoints, smooth: bool) -> Trajectory:
    """The motion nearest to given pieces that meets waypoints and end velocities.

    Args:
        pieces: of N durations.
        waypoints: to meet.
        smooth: whether accelerations are continuous, and zero at both ends.
    """
    h = pieces.durations
    controls = (
        pieces.jerks if smooth else np.vstack([pieces.accelerations, pieces.accelerations + h[:, None] * pieces.jerks])
    )
    effects = _effects(h, waypoints.nodes, smooth)
    shares = np.sqrt(np.tile(h, len(controls) // h.size))  # a control weighs as much as the time for which it acts
    for _ in range(CORRECTIONS):
        missing = _missing(_motion(h, controls, waypoints, smooth), waypoints, smooth)
        controls = controls + np.linalg.lstsq(effects / shares, missing, rcond=None)[0] / shares[:, None]
    return _motion(h, controls, waypoints, smooth)


def _motion(h: FloatArray, controls: FloatArray, waypoints: Waypoints, smooth: bool) -> Trajectory:
    if smooth:
        gains = h[:, None] * controls
        pieces = AccelerationPieces(h, np.cumsum(gains, axis=0) - gains, controls)
    else:
        before, after = np.split(controls, 2)
        pieces = AccelerationPieces(h, before, (after - before) / h[:, None])
    return pieces.trajectory(waypoints.theta[0], waypoints.velocities[0])


def _missing(motion: Trajectory, waypoints: Waypoints, smooth: bool) -> FloatArray:
    """What is left to correct: of the ways between waypoints, of the last velocity, of the last acceleration."""
    theta = motion.at(motion.breakpoints[waypoints.nodes])
    end = motion.breakpoints[-1:]
    ways = np.diff(waypoints.theta, axis=0) - np.diff(theta, axis=0)
    rates = [waypoints.velocities[1:] - motion.at(end, 1), *([-motion.at(end, 2)] if smooth else [])]
    return np.vstack([ways, *rates])


def _effects(h: FloatArray, nodes: NDArray[np.intp], smooth: bool) -> FloatArray:
    """The matrix from controls to what :func:`_missing` lists."""
    count = h.size
    identity, zero = np.eye(count), np.zeros((count, count))
    chain = np.tril(np.ones((count, count)), -1) * h
    before, after = (
        (chain, chain + np.diag(h)) if smooth else (np.hstack([identity, zero]), np.hstack([zero, identity]))
    )
    gains = h[:, None] * (before + after) / 2.0
    speeds = np.vstack([np.zeros((1, gains.shape[1])), np.cumsum(gains, axis=0)])
    ways = h[:, None] * speeds[:-1] + h[:, None] ** 2 * (2.0 * before + after) / 6.0
    angles = np.vstack([np.zeros((1, gains.shape[1])), np.cumsum(ways, axis=0)])
    return np.vstack([np.diff(angles[nodes], axis=0), speeds[-1:], *([after[-1:]] if smooth else [])])
