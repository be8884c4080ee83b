"""A lower bound of the time along a path from rest to rest, by the energy that each joint can gain.

The square of a joint's speed changes by twice its largest acceleration times the length that it turns, at most. From
both ends on this bounds the speeds of all joints at grid points, and the time that the slowest joint needs in between.
With a jerk limit accelerations are none at the ends, and the first and the last of these times are longer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from math import inf
from typing import Self

import numpy as np

from problems.base import FloatArray, bernstein
from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing.speed_profile import SpeedProfile

CELLS, FEW_CELLS = 64, 32  # of a path, at least
ROUNDING = 1e-9  # of the bound


@dataclass(frozen=True, eq=False)
class PathGrid:
    """The shapes of m paths of k joints at n + 1 parameters from end to end, on which the energies of joints depend.

    Attributes:
        angles: (n + 1, m, k), rad.
        slopes: their derivatives, (n + 1, m, k).
        longest: what joints turn in each cell, at most, (n, m, k), rad.
    """

    angles: FloatArray
    slopes: FloatArray
    longest: FloatArray

    @classmethod
    def of(cls, path: JointPath, u: FloatArray) -> Self:
        """The grid of one path at parameters (n + 1,)."""
        return cls(path.at(u)[:, None], path.at(u, 1)[:, None], _turns(_slopes_of_cells(path, u), u)[:, None])

    @classmethod
    def through(cls, points: FloatArray) -> Self:
        """The grid of the splines through points that are passed at equal steps of the parameter, (m, n, k)."""
        u, values, slopes, in_cells = _even_spline(points.shape[1])
        angles, derivatives = (np.einsum("up,mpk->umk", each, points) for each in (values, slopes))
        return cls(angles, derivatives, _turns(np.einsum("oup,mpk->oumk", in_cells, points), u))


def _turns(slopes: FloatArray, u: FloatArray) -> FloatArray:
    """The lengths that joints turn in cells, at most, (n, ...), by Bernstein coefficients (order, n, ...) of slopes."""
    lengths = np.diff(u)
    return np.asarray(np.abs(slopes).mean(axis=0) * lengths.reshape(-1, *[1] * (slopes.ndim - 2)))


def _slopes_of_cells(path: JointPath, u: FloatArray) -> FloatArray:
    """Bernstein coefficients of the derivatives in cells between parameters (n + 1,), (order, n, k)."""
    local = path.restarted(u[:-1])
    return bernstein(local[:-1] * np.arange(len(local) - 1, 0, -1)[:, None, None], np.diff(u))


@cache
def _even_spline(count: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """The spline through so many points at equal steps, as matrices: its grid, and what is linear in the points.

    Returns:
        The parameters, (n + 1,); values and derivatives there, (n + 1, count); the derivatives' Bernstein coefficients
        in the cells, (order, n, count).
    """
    path = JointPath.through(np.eye(count), np.linspace(0.0, 1.0, count))
    u = _even_grid(path, FEW_CELLS)
    return u, path.at(u), path.at(u, 1), _slopes_of_cells(path, u)


def least_along(path: JointPath, limits: JointLimits) -> float:
    """A lower bound of the duration of every motion along a smooth path from rest to rest, s.

    Args:
        path: of k joints, whose first derivative is continuous.
        limits: on speed, acceleration and jerk; others do not count.
    """
    return float(_least_of_each(PathGrid.of(path, _even_grid(path, CELLS)), limits)[0])


def least_along_points(
    points: FloatArray, limits: JointLimits, length: float = 0.0, fastest_tool: float | None = None
) -> FloatArray:
    """About the least durations along smooth paths through points that the tool passes evenly, from rest to rest, s.

    Args:
        points: postures, (m, n, k), of each of m paths.
        limits: on speed, acceleration and jerk; others do not count.
        length: of the tool's way, m.
        fastest_tool: its largest speed, m/s; None for any.

    Returns:
        (m,): of the splines through the points, of which cells are fewer.
    """
    if fastest_tool is not None:
        shares = np.broadcast_to(np.linspace(0.0, length, points.shape[1])[:, None], (*points.shape[:2], 1))
        points, limits = np.concatenate([points, shares], axis=2), with_tool(limits, fastest_tool)
    return _least_of_each(PathGrid.through(points), limits)


def with_tool(limits: JointLimits, fastest_tool: float) -> JointLimits:
    """The limits with those of the length of the tool's way, as one more joint whose speed is limited, m/s."""
    return replace(
        limits,
        speed=(*limits.speed, fastest_tool),
        acceleration=(*limits.acceleration, inf),
        jerk=None if limits.jerk is None else (*limits.jerk, inf),
    )


def _least_of_each(grid: PathGrid, limits: JointLimits) -> FloatArray:
    """Lower bounds of the durations along the paths of a grid, (m,), s."""
    speed, acceleration, *jerk = limits.by_order
    slopes = grid.slopes**2
    with np.errstate(divide="ignore"):
        squares = _largest_squares(grid, acceleration, (speed**2 / slopes).min(axis=2))
    ways = np.abs(np.diff(grid.angles, axis=0))
    times = _least_times(ways, slopes * squares[..., None], speed, acceleration)
    if jerk:
        times[[0, -1]] = np.maximum(times[[0, -1]], _from_rest(ways[[0, -1]], acceleration, *jerk))
    return np.asarray(times.max(axis=2).sum(axis=0) * (1.0 - ROUNDING))


def energy_profile(path: JointPath, limits: JointLimits, cells: int) -> SpeedProfile:
    """The profile of the path's speed that the energies of all joints allow, without their accelerations in bends.

    Speeds, and accelerations where the path's speed is steady, are kept at the ends of cells, so many at least.
    """
    u = _even_grid(path, cells)
    speed, acceleration = limits.by_order[:2]
    with np.errstate(divide="ignore"):
        most = np.minimum((speed**2 / path.at(u, 1) ** 2), acceleration / np.abs(path.at(u, 2))).min(axis=1)
    return SpeedProfile(u, _largest_squares(PathGrid.of(path, u), acceleration, most[:, None])[:, 0])


def _even_grid(path: JointPath, cells: int) -> FloatArray:
    """Parameters of a path, so many equal cells at least, the breakpoints among them."""
    each = -(-cells // (path.breakpoints.size - 1))
    inner = path.breakpoints[:-1, None] + np.diff(path.breakpoints)[:, None] * np.arange(each) / each
    return np.append(inner.ravel(), path.breakpoints[-1])


def _largest_squares(grid: PathGrid, acceleration: FloatArray, most: FloatArray) -> FloatArray:
    """The largest (du/dt)^2 of paths at the parameters of a grid, (n + 1, m), between rest at both ends.

    Args:
        grid: of the paths.
        acceleration: of each joint at most, (k,).
        most: (du/dt)^2 that is not exceeded, (n + 1, m).
    """
    slopes, gains = grid.slopes**2, 2.0 * acceleration * grid.longest
    return _reached(slopes[::-1], gains[::-1], _reached(slopes, gains, most)[::-1])[::-1]


def _reached(slopes: FloatArray, gains: FloatArray, most: FloatArray) -> FloatArray:
    """The largest (du/dt)^2 of m paths at parameters, (n + 1, m), that joints come to from rest at the first of them.

    Args:
        slopes: squares of q', (n + 1, m, k).
        gains: of squares of speeds between them, (n, m, k).
        most: that is not exceeded, (n + 1, m).
    """
    found = np.zeros_like(most)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares, added = slopes[:-1] / slopes[1:], gains / slopes[1:]
        for number, (share, gain) in enumerate(zip(shares, added, strict=True), start=1):
            grown = np.fmin.reduce(share * found[number - 1, :, None] + gain, axis=1)
            found[number] = np.fmin(grown, most[number])
    return found


def _least_times(ways: FloatArray, squares: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
    """The least times in which joints turn by ways (n, m, k), one after the other, (n, m, k), s.

    Args:
        ways: rad.
        squares: of speeds before and after each way, at most, (n + 1, m, k).
        speed: at most, (k,).
        acceleration: likewise.
    """
    gains = 2.0 * acceleration * ways
    first, last = np.minimum(squares[:-1], squares[1:] + gains), np.minimum(squares[1:], squares[:-1] + gains)
    peak = np.minimum(speed**2, (first + last + gains) / 2.0)
    left = np.maximum(ways - (2.0 * peak - first - last) / (2.0 * acceleration), 0.0)
    steady = np.divide(left, np.sqrt(peak), out=np.zeros_like(ways), where=peak > 0.0)
    return (2.0 * np.sqrt(peak) - np.sqrt(first) - np.sqrt(last)) / acceleration + steady


def _from_rest(ways: FloatArray, acceleration: FloatArray, jerk: FloatArray) -> FloatArray:
    """The least times in which joints turn by ways (n, m, k) from rest without an acceleration, s."""
    rise = np.divide(acceleration, jerk, out=np.zeros_like(jerk), where=np.isfinite(jerk))  # none without limits
    growing = np.cbrt(6.0 * ways / jerk)
    steady = np.sqrt(np.maximum(2.0 * ways / acceleration - rise**2 / 12.0, 0.0)) + rise / 2.0
    return np.where(growing <= rise, growing, steady)
