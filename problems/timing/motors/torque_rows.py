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
CHECKED = np.linspace(0.0, 1.0, 5)  # of a finished profile, shares of an interval
MOST_VISCOUS = 0.5  # of what is left of a limit: what viscous friction takes of it where b is zero


def torque_rows(motors: PathTorques, intervals: Intervals, expected: FloatArray, resting: FloatArray) -> FloatArray:
    """Coefficients (N, rows, 2): for each interval and row, their product with b at its two ends must be <= 1.

    Args:
        motors: of the path.
        intervals: of the path.
        expected: squares (N + 1,), around which viscous friction is linear.
        resting: whether b is zero, (N + 1,).
    """
    u = intervals.nodes[:-1] + AT[:, None] * intervals.lengths
    inertia, bend, held = motors.at(u)
    viscous = motors.viscous * motors.path.at(u, 1)
    high, low = _friction(motors, intervals, resting)
    above = _one_sided(motors, intervals, expected, (inertia, bend, held + high, viscous))
    below = _one_sided(motors, intervals, expected, (-inertia, -bend, -held - low, -viscous))
    return np.concatenate([above, below]).transpose(1, 0, 2, 3).reshape(len(intervals.lengths), -1, 2)


def _one_sided(
    motors: PathTorques, intervals: Intervals, expected: FloatArray, terms: tuple[FloatArray, ...]
) -> FloatArray:
    """Rows (n, N, k, 2) with which torques stay below their bounds; m, c, g and viscous friction at the nodes."""
    inertia, bend, held, viscous = terms
    least = LEAST_ROOM * motors.bound
    room = np.maximum(motors.bound - held, least)
    if motors.viscous.any():
        slope, taken = _viscous(viscous, expected, room)
        bend, room = bend + slope, room - taken
    room = in_bernstein_form(np.pad(_through(room), ((0, 1), (0, 0), (0, 0))))
    row = weighted(_through(bend))
    row[:-1] += _through(inertia)[..., None] * np.array([-1.0, 1.0]) / (2.0 * intervals.lengths[:, None, None])
    return np.asarray(in_bernstein_form(row) / np.maximum(room, least)[..., None])


def profile_time_scale(motors: PathTorques, profile: SpeedProfile) -> float:
    """How many times slower a profile has to be run for its torques, at samples between its nodes."""
    lengths, squares = np.diff(profile.nodes)[:, None], profile.squares
    u = np.minimum(profile.nodes[:-1, None] + CHECKED * lengths, np.nextafter(profile.nodes[1:, None], 0.0))
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


def _viscous(factor: FloatArray, expected: FloatArray, room: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Viscous friction at the nodes, (3, N, k): how it grows with b, and what is left of it where b is zero.

    A root lies below its tangents, and above its chord where b is between the two squares that are expected.
    """
    with np.errstate(divide="ignore"):
        most = 2.0 * MOST_VISCOUS * room / np.abs(factor)
    roots = np.sqrt(np.maximum(expected, LEAST_ROOM * expected.max()))[:, None]
    total, middle = roots[:-1] + roots[1:], np.sqrt((roots[:-1] ** 2 + roots[1:] ** 2) / 2.0)
    tangent = np.minimum(middle, most)
    slope = np.where(factor > 0.0, 1.0 / (2.0 * tangent), 1.0 / total)
    return factor * slope, factor * np.where(factor > 0.0, tangent / 2.0, roots[:-1] * roots[1:] / total)


def _through(values: FloatArray) -> FloatArray:
    """Parabolas, lowest power first, through values (3, N, ...) at the nodes."""
    flat = np.linalg.solve(np.vander(AT, increasing=True), values.reshape(3, -1))
    return np.asarray(flat.reshape(values.shape))
