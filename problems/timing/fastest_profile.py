"""The fastest way to run a path under speed and acceleration limits: a linear program on the square of du/dt."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.sparse import csr_array

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.robots.robot import JointLimits
from problems.timing.linear_program import minimizer
from problems.timing.motors.path_torques import PathTorques
from problems.timing.motors.torque_rows import torque_rows
from problems.timing.prepared import PreparedPath
from problems.timing.speed_profile import SpeedProfile
from problems.timing.speed_rows import Intervals, ceiling_rows, limit_rows, necessary, steady_jerk_rows

INTERVALS = 40  # for each piece of a path
FEWEST, MOST = 400, 4000  # intervals of a grid, unless it has so many pieces that
LEAST_IN_PIECE = 4  # is more
FIRST_SHARE = 0.25  # of the intervals: in the first grid, equally spaced in the parameter
MARGIN = 1e-9  # of every limit where nothing can be slowed afterwards: more than the program's own tolerance
STEADY_JERK = 0.5  # of jerk limits: the share that a path may need where its speed is steady
UNBOUNDED = 1e4  # times the largest bound of those near it, where a square is not bounded by its own rows
NEAR = 20  # nodes on either side: a path may be a million times slower in its parameter than elsewhere
SAME_NODE = 1e-9  # of a piece: nodes nearer to a breakpoint are left out
VISCOUS_ROUNDS = 3  # programs on the last grid where viscous friction makes torques curved in the squares
GRADED = 16  # intervals at an end where q' is zero, that are replaced
GRADING = 4  # by so many each


def fastest_profile(
    prepared: PreparedPath,
    limits: JointLimits,
    motors: PathTorques | None = None,
    ceiling: SpeedProfile | None = None,
) -> tuple[SpeedProfile, Intervals]:
    """The fastest profile on a grid of about equal times, and the path over that grid.

    Of jerk limits it keeps what the path needs where its speed is steady.

    Args:
        prepared: the path.
        limits: of its joints.
        motors: what torques it takes; None where they do not count.
        ceiling: a profile that is not exceeded; none where None.

    Raises:
        InvalidProblem: the limits allow no motion with the velocities that the ends have to have.
    """
    breakpoints = prepared.path.breakpoints
    count = min(max(INTERVALS * (breakpoints.size - 1), FEWEST), MOST)
    nodes = _subdivided(breakpoints, breakpoints, int(FIRST_SHARE * count))
    intervals = Intervals.of(prepared.path, nodes)
    profile = _solved(prepared, intervals, limits, motors, ceiling, None)
    nodes = _equal_times(profile, breakpoints, count, prepared.resting)
    intervals = Intervals.of(prepared.path, nodes)
    for _ in range(1 if motors is None or not motors.viscous.any() else VISCOUS_ROUNDS):
        expected = np.interp(nodes, profile.nodes, profile.squares)
        profile = _solved(prepared, intervals, limits, motors, ceiling, expected)
    return profile, intervals


def _subdivided(breakpoints: FloatArray, measure: FloatArray, count: int) -> FloatArray:
    """About so many intervals, equal within each piece; a piece has its share of a measure (p + 1,), increasing."""
    shares = np.diff(measure) / (measure[-1] - measure[0])
    counts = np.maximum(LEAST_IN_PIECE, np.ceil(count * shares)).astype(int)
    inner = [
        start + (end - start) * np.arange(n) / n
        for start, end, n in zip(breakpoints[:-1], breakpoints[1:], counts, strict=True)
    ]
    return np.concatenate([*inner, breakpoints[-1:]])


def _equal_times(profile: SpeedProfile, breakpoints: FloatArray, count: int, graded: tuple[bool, bool]) -> FloatArray:
    """Nodes at about equal times within each piece, the breakpoints among them."""
    passed = profile.times[np.searchsorted(profile.nodes, breakpoints)]
    times = _subdivided(passed, passed, count)
    if graded[0]:
        times = _graded(times)
    if graded[1]:
        times = -_graded(-times[::-1])[::-1]
    nodes = profile.parameters(times)
    after = np.searchsorted(breakpoints, nodes).clip(1, breakpoints.size - 1)
    apart = np.minimum(nodes - breakpoints[after - 1], breakpoints[after] - nodes)
    inner = nodes[apart > SAME_NODE * (breakpoints[after] - breakpoints[after - 1])]
    return np.union1d(inner, breakpoints)


def _graded(times: FloatArray) -> FloatArray:
    """More and shorter intervals at the start, for a path whose q' is zero there: b is large and steep."""
    last = min(GRADED, times.size - 1)
    count = GRADING * last
    return np.concatenate([times[0] + (times[last] - times[0]) * (np.arange(count) / count) ** 2, times[last:]])


def _solved(
    prepared: PreparedPath,
    intervals: Intervals,
    limits: JointLimits,
    motors: PathTorques | None,
    ceiling: SpeedProfile | None,
    expected: FloatArray | None,
) -> SpeedProfile:
    """The profile of least time, to first order around the squares that are expected, (N + 1,); or about equal."""
    fixed = _fixed(prepared, intervals.nodes)
    every_row = limit_rows(intervals, limits)
    if ceiling is not None:
        below = np.interp(intervals.nodes, ceiling.nodes, ceiling.squares)
        every_row = np.append(every_row, ceiling_rows(below), axis=1)
    if limits.jerk is not None:
        every_row = np.append(every_row, steady_jerk_rows(intervals, limits.jerk, STEADY_JERK), axis=1)
    if motors is not None:
        around = _largest(every_row, fixed) if expected is None else expected
        every_row = np.append(every_row, torque_rows(motors, intervals, around, fixed == 0.0), axis=1)
    scale = _largest(every_row, fixed)
    if expected is None:
        expected = np.maximum(1.0, scale / (UNBOUNDED * scale.min()))
    interval, rows = necessary(every_row)
    solution = _maximised(_savings(intervals, expected) * scale, interval, rows, scale, fixed)
    if solution is not None:
        return SpeedProfile(intervals.nodes, solution)
    if np.nanmax(fixed, initial=0.0) > 0.0:
        raise InvalidProblem("rates", "the limits allow no motion along the path with these velocities at its ends")
    shape = np.where(np.isnan(fixed), 1.0, 0.0)
    most = (rows[:, 0] * shape[interval] + rows[:, 1] * shape[interval + 1]).max()
    return SpeedProfile(intervals.nodes, shape / most)


def _fixed(prepared: PreparedPath, nodes: FloatArray) -> FloatArray:
    """The squares that are given, (N + 1,): at corners and at ends where q' is not zero; else nan."""
    fixed = np.full(nodes.size, np.nan)
    fixed[np.searchsorted(nodes, prepared.path.breakpoints[prepared.corners])] = 0.0
    for end, resting, rate in zip((0, -1), prepared.resting, prepared.rates, strict=True):
        if not resting:
            fixed[end] = rate**2
    return fixed


def _largest(rows: FloatArray, fixed: FloatArray) -> FloatArray:
    """What each square can be at most, (N + 1,), as single rows (N, rows, 2) say."""
    positive = np.where(rows.min(axis=2, keepdims=True) >= 0.0, rows, 0.0).max(axis=1)
    tightest = np.maximum(np.append(positive[:, 0], 0.0), np.insert(positive[:, 1], 0, 0.0))
    near = np.maximum(maximum_filter1d(tightest, 2 * NEAR + 1, mode="nearest"), tightest.max() / UNBOUNDED**3)
    scale = 1.0 / np.maximum(tightest, near / UNBOUNDED)
    return np.asarray(np.where(fixed > 0.0, fixed, scale))


def _savings(intervals: Intervals, expected: FloatArray) -> FloatArray:
    """How much time a little more of each square saves, (N + 1,)."""
    speed = np.sqrt(np.maximum(expected, 1e-12 * expected.max()))
    per_interval = intervals.lengths / (speed[:-1] + speed[1:]) ** 2
    return np.asarray((np.append(per_interval, 0.0) + np.insert(per_interval, 0, 0.0)) / speed)


def _maximised(
    weights: FloatArray, interval: FloatArray, rows: FloatArray, scale: FloatArray, fixed: FloatArray
) -> FloatArray | None:
    """The squares (N + 1,) with the largest weighted sum of their shares of the scale; None where there are none."""
    columns = np.stack([interval, interval + 1], axis=1)
    moving = np.nanmax(fixed, initial=0.0) > 0.0
    bound = _bounds_of_rows(rows, columns, fixed) if moving else np.ones(len(rows))
    starts = 2 * np.arange(len(rows) + 1)
    matrix = csr_array(((rows * scale[columns]).ravel(), columns.ravel(), starts), (len(rows), fixed.size))
    given = fixed / scale
    box = np.stack([np.nan_to_num(given, nan=0.0), np.where(np.isnan(given), 1.0, given)], axis=1)
    solution = minimizer(-weights / weights.max(), matrix, bound, box)
    return None if solution is None else solution.clip(0.0) * scale


def _bounds_of_rows(rows: FloatArray, columns: FloatArray, fixed: FloatArray) -> FloatArray:
    """Right-hand sides a little below 1, but for a row in which a given square is at its limit already."""
    reached = (rows * np.nan_to_num(fixed, nan=0.0)[columns]).max(axis=1)
    return np.where(reached <= 1.0 + MARGIN, np.maximum(1.0 - MARGIN, reached), 1.0 - MARGIN)
