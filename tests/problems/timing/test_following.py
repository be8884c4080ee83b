"""How far a motion leaves a path, and how its duration compares with that of other planners."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from benchmarks.peers.report import certified, excess
from problems import Trajectory
from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing import departure, deviation, retime
from problems.timing.free_space import rest_to_rest

ROUNDING = 1e-9
LIMITS = JointLimits(speed=(2.0, 3.0), acceleration=(10.0, 8.0))


def spline(seed: int, count: int = 6) -> JointPath:
    waypoints = np.cumsum(np.random.default_rng(seed).normal(size=(count, 2)), axis=0)
    cubic = CubicSpline(np.arange(count), waypoints)
    return JointPath(cubic.x, cubic.c)


def quintic(*way: float) -> Trajectory:
    """From rest to rest in 1 s: its parameter starts from a standstill."""
    rest = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
    return Trajectory.from_pieces(np.ones(1), [rest[:, None] * np.array(way)])


@settings(deadline=None, max_examples=6)
@given(seed=st.integers(0, 1000), slower=st.floats(0.1, 10.0))
def test_a_retimed_path_is_followed_whatever_its_speed(seed: int, slower: float) -> None:
    path = spline(seed)
    assert departure(path, retime(path, LIMITS).time_scaled(slower)) < ROUNDING


def test_a_motion_follows_its_own_path() -> None:
    motion = quintic(1.0, -0.5)
    assert departure(JointPath.of(motion), motion) < ROUNDING
    assert departure(JointPath.of(motion), retime(JointPath.of(motion), LIMITS)) < ROUNDING


@settings(deadline=None, max_examples=20)
@given(seed=st.integers(0, 1000), tolerance=st.floats(0.0, 0.5))
def test_a_blend_leaves_the_lines_by_what_it_is_allowed(seed: int, tolerance: float) -> None:
    waypoints = np.random.default_rng(seed).normal(size=(5, 3))
    path = JointPath.blended(waypoints, tolerance)
    away = deviation(path, waypoints)
    assert away <= tolerance + ROUNDING
    corners = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1))])
    u = np.sort(np.concatenate([corners, np.linspace(0.0, corners[-1], 3_001)]))[:-1]
    lines = np.stack([np.interp(u, corners, column) for column in waypoints.T], axis=1)
    assert away == pytest.approx(np.abs(path.at(u) - lines).max(), abs=1e-9)


@pytest.mark.parametrize("shift", [1e-8, 0.3])
def test_what_is_shifted_is_seen_and_bounded(shift: float) -> None:
    path, motion = spline(3), retime(spline(3), LIMITS)
    coefficients = motion.coefficients.copy()
    coefficients[-1, :, 1] += shift
    away = departure(path, Trajectory(motion.breakpoints, coefficients))
    assert away >= 0.3 * shift  # a joint moves along the path as well, which makes some of it good


def test_a_bulge_between_two_nodes_is_seen() -> None:
    motion = retime(spline(5), LIMITS)
    coefficients = np.concatenate([np.zeros((7, *motion.coefficients.shape[1:])), motion.coefficients])
    piece = int(np.argmax(np.diff(motion.breakpoints)))
    h = motion.breakpoints[piece + 1] - motion.breakpoints[piece]
    bulge = np.poly([0.0, h / 4.0, h / 2.0, 3.0 * h / 4.0, h])  # zero at the five nodes
    largest = np.abs(np.polyval(bulge, np.linspace(0.0, h, 101))).max()
    coefficients[-bulge.size :, piece, 0] += 1e-3 * bulge / largest
    assert departure(spline(5), Trajectory(motion.breakpoints, coefficients)) > 5e-4


def test_half_the_way_is_not_the_path() -> None:
    whole, half = quintic(1.0, -0.5), quintic(0.5, -0.25)
    assert departure(JointPath.of(whole), half) > 0.1


def test_what_is_no_number_is_infinitely_far() -> None:
    motion = quintic(1.0, 1.0)
    coefficients = motion.coefficients.copy()
    coefficients[0, 0, 0] = np.nan
    with np.errstate(all="ignore"):
        assert departure(JointPath.of(motion), Trajectory(motion.breakpoints, coefficients)) == np.inf


@pytest.mark.parametrize(
    ("waypoints", "jerk"),
    [
        ([[0.0, 0.3], [0.4, 0.3], [0.1, 0.3], [0.8, 0.3]], (100.0, 90.0)),  # one joint that turns back: q' is zero
        ([[0.0, 0.0], [0.1, 0.2], [0.5, 1.0], [0.6, 1.2]], (100.0, 90.0)),  # a line of several pieces
        ([[0.0, 0.0], [1e-3, 0.0], [1.0, 0.5], [1.0, 0.501], [0.2, -0.4]], None),  # short and long: wide loops
    ],
)
def test_reversals_lines_and_uneven_waypoints_are_followed(waypoints: list[list[float]], jerk: Any) -> None:
    path = JointPath.through(np.array(waypoints))
    assert departure(path, retime(path, replace(LIMITS, jerk=jerk))) < ROUNDING


def test_a_loop_that_is_left_out_is_seen() -> None:
    rectangle = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0], [-1.0, 0.5]])
    around, past = JointPath.blended(rectangle, 0.0), JointPath.blended(rectangle[[0, 5]], 0.0)
    assert departure(around, retime(past, LIMITS)) > 0.1


ONES = JointLimits(speed=(1.0, 1.0), acceleration=(2.0, 2.0), jerk=(8.0, 8.0))


def test_excess_is_what_a_limit_is_broken_by() -> None:
    move = rest_to_rest(np.zeros(2), np.array([3.0, 1.0]), ONES)
    assert excess(move.at, move.duration, ONES) == 0.0
    assert certified(move, ONES)
    faster = move.time_scaled(1.0 / 1.1)
    assert excess(faster.at, faster.duration, ONES) == pytest.approx(1.1**3 - 1.0, rel=1e-6)
    assert not certified(faster, ONES)


def test_a_path_is_as_fast_as_toppras() -> None:
    pytest.importorskip("toppra")
    from benchmarks.peers.waypoint_paths import METHODS, timings  # noqa: PLC0415 - an extra

    results = dict(zip(METHODS, timings(11), strict=True))
    assert results["ours"].excess == 0.0
    assert results["ours"].certified
    assert results["ours"].duration == pytest.approx(results[METHODS[2]].duration, rel=3e-3)
