"""Where a motion that becomes a start has its nodes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from problems.robots.robot import JointLimits

LEAST_SHARE = 1e-6  # of the duration, between two nodes of a start
CLEAR_JUMP = 0.1  # of a limit: smaller jumps are no reason for a node


def node_times(motion: Trajectory, passed: FloatArray, pieces: int, limits: JointLimits) -> FloatArray:
    """Where to put nodes on a motion, s.

    Args:
        motion: whose own breakpoints are taken, those first where accelerations or jerks jump most.
        passed: when the waypoints are passed, (m,), s; they become nodes.
        pieces: between one waypoint and the next.
        limits: to which jumps are relative.

    Returns:
        Increasing times, ((m - 1) pieces + 1,).
    """
    least = LEAST_SHARE * motion.duration / passed.size
    bounds = ((2, limits.acceleration), (3, limits.jerk))
    jumps = np.array([_jumps(motion, order, bound) for order, bound in bounds if bound is not None])
    between = [
        _inner_times(motion.breakpoints[1:-1], jumps.max(axis=0), (first, last), pieces, least)
        for first, last in pairwise(passed)
    ]
    times = np.concatenate([passed[:1], *between])
    even = np.arange(times.size) * least
    return np.asarray(np.maximum.accumulate(times - even) + even)


def _jumps(motion: Trajectory, order: int, bound: tuple[float, ...]) -> FloatArray:
    """By how much a derivative jumps at the inner breakpoints, of any joint, relative to its bound; (p - 1,)."""
    at = motion.breakpoints[1:-1]
    jumps = np.abs(motion.at(at, order) - motion.at(np.nextafter(at, 0.0), order)) / np.array(bound)
    return np.asarray(jumps.max(axis=1))


def _inner_times(
    breakpoints: FloatArray, jumps: FloatArray, ends: tuple[float, float], pieces: int, least: float
) -> FloatArray:
    """Times after the first of two ends up to the second, as many as pieces."""
    first, last = ends
    within = (breakpoints > first + least) & (breakpoints < last - least)
    inner, jumps = breakpoints[within], jumps[within]
    apart = np.diff(inner, prepend=first) > least
    inner, jumps = inner[apart], jumps[apart]
    if inner.size >= pieces:
        clear = np.flatnonzero(jumps > CLEAR_JUMP)
        inner = np.sort(inner[clear[np.argsort(-jumps[clear], kind="stable")[: pieces - 1]]])
    times = np.concatenate([[first], inner, [last]])
    while times.size <= pieces:
        longest = int(np.argmax(np.diff(times)))
        times = np.insert(times, longest + 1, (times[longest] + times[longest + 1]) / 2.0)
    return times[1:]
