"""Torque limits on the square b of a path's speed: linear, and sufficient between grid points but for interpolation.

Between two grid points b is linear and m, c and g are nearly parabolas, drawn through three nodes; the torque is then
a polynomial whose Bernstein coefficients are linear in the two values of b. What viscous friction takes grows with the
root of b, which is linear around the squares that are expected.
"""

from __future__ import annotations

import numpy as np

from problems.base.matrix import FloatArray
from problems.timing.motors.path_torques import LEAST_ROOM, PathTorques
from problems.timing.polynomials import derivative, in_bernstein_form
from problems.timing.speed_profile import SpeedProfile
from problems.timing.speed_rows import Intervals, weighted

AT = (1.0 - np.cos(np.pi * (np.arange(3) + 0.5) / 3.0)) / 2.0  # nodes, shares of an interval
CHECKED = (1.0 - np.cos(np.pi * (np.arange(5) + 0.5) / 5.0)) / 2.0  # of a finished profile
MOST_VISCOUS = 0.5  # of what is left of a limit: what viscous friction takes of it where b is zero


def torque_rows(motors: PathTorques, intervals: Intervals, expected: FloatArray, resting: FloatArray) -> FloatArray:
    """Coefficients (N, rows, 2): for each interval and row, their product with b at its two ends must be <= 1.

    Args:
        motors: of the path.
        intervals: of the path.
        expected: squares (N + 1,), around which viscous friction is linear.
        resting: whether b is zero, (N + 1,).
    """
    lengths = intervals.lengths
    inertia, bend, held = motors.at(intervals.nodes[:-1] + AT[:, None] * lengths)
    high, low = _friction(motors, intervals, resting)
    above = np.maximum(motors.bound - held - high, LEAST_ROOM * motors.bound)
    below = np.maximum(motors.bound + held + low, LEAST_ROOM * motors.bound)
    if motors.viscous.any():
        slope, taken = _viscous(motors, intervals, expected, np.minimum(above, below))
        bend, above, below = bend + slope, above - taken, below + taken
    room = in_bernstein_form(np.pad(_through(np.stack([above, below], axis=-1)), ((0, 1), *((0, 0),) * 3)))
    room = np.maximum(room, LEAST_ROOM * motors.bound[:, None])
    row = weighted(_through(bend))
    row[:3] += _through(inertia)[..., None] * np.array([-1.0, 1.0]) / (2.0 * lengths[:, None, None])
    row = in_bernstein_form(row)
    rows = np.concatenate([row / room[..., :1], -row / room[..., 1:]])
    return rows.transpose(1, 0, 2, 3).reshape(lengths.size, -1, 2)


def profile_time_scale(motors: PathTorques, profile: SpeedProfile) -> float:
    """How many times slower a profile has to be run for its torques, at samples between its nodes."""
    lengths, squares = np.diff(profile.nodes)[:, None], profile.squares
    u = profile.nodes[:-1, None] + CHECKED * lengths
    rate = np.sqrt(squares[:-1, None] + CHECKED * np.diff(squares)[:, None])
    change = np.broadcast_to(np.diff(squares)[:, None] / (2.0 * lengths), u.shape)
    return motors.time_scale(u.ravel(), rate.ravel(), change.ravel())


def _friction(motors: PathTorques, intervals: Intervals, resting: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The most and the least that Coulomb friction can take in each interval, (N, k)."""
    slopes = in_bernstein_form(derivative(intervals.local))
    stops = np.logical_or(resting[:-1], resting[1:])[:, None]
    high = np.where((slopes.max(axis=0) < 0.0) & ~stops, -1.0, 1.0)
    low = np.where((slopes.min(axis=0) > 0.0) & ~stops, 1.0, -1.0)
    return high * motors.coulomb, low * motors.coulomb


def _viscous(
    motors: PathTorques, intervals: Intervals, expected: FloatArray, room: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Viscous friction at the nodes, (3, N, k): how it grows with b, and what is left of it where b is zero."""
    factor = motors.viscous * motors.path.at(intervals.nodes[:-1] + AT[:, None] * intervals.lengths, 1)
    size = np.abs(factor)
    b = (expected[:-1] + AT[:, None] * np.diff(expected))[..., None]
    with np.errstate(divide="ignore"):
        root = np.minimum(np.sqrt(np.maximum(b, LEAST_ROOM * expected.max())), 2.0 * MOST_VISCOUS * room / size)
    return factor / (2.0 * root), factor * root / 2.0


def _through(values: FloatArray) -> FloatArray:
    """Parabolas, lowest power first, through values (3, N, ...) at the nodes."""
    flat = np.linalg.solve(np.vander(AT, increasing=True), values.reshape(3, -1))
    return np.asarray(flat.reshape(values.shape))
