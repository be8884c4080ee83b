"""A lower bound of the time along a path from rest to rest, by the energy that each joint can gain.

The square of a joint's speed changes by twice its largest acceleration times the length that it turns, at most. From
both ends on this bounds the speeds of all joints at grid points, and the time that the slowest joint needs in between.
With a jerk limit accelerations are none at the ends, and the first and the last of these times are longer.
"""

from __future__ import annotations

import numpy as np

from problems.base import FloatArray, bernstein
from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing.speed_profile import SpeedProfile

CELLS = 64  # of a path, at least
ROUNDING = 1e-9  # of the bound


def least_along(path: JointPath, limits: JointLimits) -> float:
    """A lower bound of the duration of every motion along a smooth path from rest to rest, s.

    Args:
        path: of k joints, whose first derivative is continuous.
        limits: on speed, acceleration and jerk; others do not count.
    """
    u = _even_grid(path, CELLS)
    slopes = path.at(u, 1) ** 2
    with np.errstate(divide="ignore"):
        squares = _largest_squares(path, limits, u, (limits.by_order[0] ** 2 / slopes).min(axis=1))
    ways = np.abs(np.diff(path.at(u), axis=0))
    times = _least_times(ways, slopes * squares[:, None], limits)
    if limits.jerk is not None:
        times[[0, -1]] = np.maximum(times[[0, -1]], _from_rest(ways[[0, -1]], *limits.by_order[1:]))
    return float(times.max(axis=1).sum()) * (1.0 - ROUNDING)


def energy_profile(path: JointPath, limits: JointLimits, cells: int) -> SpeedProfile:
    """The profile of the path's speed that the energies of all joints allow, without their accelerations in bends.

    Speeds, and accelerations where the path's speed is steady, are kept at the ends of cells, so many at least.
    """
    u = _even_grid(path, cells)
    speed, acceleration = limits.by_order[:2]
    with np.errstate(divide="ignore"):
        most = np.minimum((speed**2 / path.at(u, 1) ** 2), acceleration / np.abs(path.at(u, 2))).min(axis=1)
    return SpeedProfile(u, _largest_squares(path, limits, u, most))


def _even_grid(path: JointPath, cells: int) -> FloatArray:
    """Parameters of a path, so many equal cells at least, the breakpoints among them."""
    each = -(-cells // (path.breakpoints.size - 1))
    inner = path.breakpoints[:-1, None] + np.diff(path.breakpoints)[:, None] * np.arange(each) / each
    return np.append(inner.ravel(), path.breakpoints[-1])


def _largest_squares(path: JointPath, limits: JointLimits, u: FloatArray, most: FloatArray) -> FloatArray:
    """The largest (du/dt)^2 at parameters, (n + 1,), that the energies of all joints allow between rest at both ends.

    Args:
        path: of k joints.
        limits: on acceleration.
        u: parameters from end to end, (n + 1,).
        most: (du/dt)^2 that is not exceeded, (n + 1,).
    """
    slopes, gains = path.at(u, 1) ** 2, 2.0 * limits.by_order[1] * _longest(path, u)
    return _reached(slopes[::-1], gains[::-1], _reached(slopes, gains, most)[::-1])[::-1]


def _longest(path: JointPath, u: FloatArray) -> FloatArray:
    """The lengths that joints turn between parameters (n + 1,), at most, (n, k), rad."""
    lengths = np.diff(u)
    local = path.restarted(u[:-1])
    slopes = local[:-1] * np.arange(len(local) - 1, 0, -1)[:, None, None]
    return np.asarray(np.abs(bernstein(slopes, lengths)).mean(axis=0) * lengths[:, None])


def _reached(slopes: FloatArray, gains: FloatArray, most: FloatArray) -> FloatArray:
    """The largest (du/dt)^2 at parameters, (n + 1,), that joints come to from rest at the first of them.

    Args:
        slopes: squares of q', (n + 1, k).
        gains: of squares of speeds between them, (n, k).
        most: that is not exceeded, (n + 1,).
    """
    found = np.zeros_like(most)
    with np.errstate(divide="ignore", invalid="ignore"):
        for number, (before, gain, after) in enumerate(zip(slopes, gains, slopes[1:], strict=False), start=1):
            found[number] = min(np.fmin.reduce((before * found[number - 1] + gain) / after), most[number])
    return found


def _least_times(ways: FloatArray, squares: FloatArray, limits: JointLimits) -> FloatArray:
    """The least times in which joints turn by ways (n, k), one after the other, (n, k), s.

    Args:
        ways: rad.
        squares: of speeds before and after each way, at most, (n + 1, k).
        limits: on speed and acceleration.
    """
    speed, acceleration = limits.by_order[:2]
    gains = 2.0 * acceleration * ways
    first, last = np.minimum(squares[:-1], squares[1:] + gains), np.minimum(squares[1:], squares[:-1] + gains)
    peak = np.minimum(speed**2, (first + last + gains) / 2.0)
    left = np.maximum(ways - (2.0 * peak - first - last) / (2.0 * acceleration), 0.0)
    steady = np.divide(left, np.sqrt(peak), out=np.zeros_like(ways), where=peak > 0.0)
    return (2.0 * np.sqrt(peak) - np.sqrt(first) - np.sqrt(last)) / acceleration + steady


def _from_rest(ways: FloatArray, acceleration: FloatArray, jerk: FloatArray) -> FloatArray:
    """The least times in which joints turn by ways (n, k) from rest without an acceleration, s."""
    rise = np.divide(acceleration, jerk, out=np.zeros_like(jerk), where=np.isfinite(jerk))  # none without limits
    growing = np.cbrt(6.0 * ways / jerk)
    steady = np.sqrt(np.maximum(2.0 * ways / acceleration - rise**2 / 12.0, 0.0)) + rise / 2.0
    return np.where(growing <= rise, growing, steady)
