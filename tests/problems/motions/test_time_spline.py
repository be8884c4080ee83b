"""Splines over time: the quintic between two states, ends that control points fix, and how smooth they are."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from problems.families.time_splines.motion import FIXED, TimeSpline
from problems.motions.splines import SplineShape

ROBOT = equal_links(2)
pieces = st.integers(1, 8)
seconds = st.floats(0.2, 20.0)
seeds = st.integers(0, 2**32 - 1)


def test_one_piece_is_the_quintic_by_hand() -> None:
    points = TimeSpline(ROBOT, 1, 4).quintic @ np.eye(4)
    # Bernstein coefficients: q, q + v/5, q + 2v/5 + a/20, and three times the goal
    expected = [[1, 0, 0, 0], [1, 1 / 5, 0, 0], [1, 2 / 5, 1 / 20, 0], *[[0, 0, 0, 1]] * 3]
    assert points == pytest.approx(np.array(expected), abs=1e-14)


@given(pieces, seeds)
def test_any_number_of_pieces_gives_the_same_quintic(count: int, seed: int) -> None:
    q, v, a, goal = np.random.default_rng(seed).normal(size=4)
    motion = TimeSpline(ROBOT, count, 4)
    curve = motion.spline.curve(motion.quintic @ np.array([[q], [v], [a], [goal]]))
    oracle = BPoly.from_derivatives([0.0, 1.0], [[q, v, a], [goal, 0.0, 0.0]])
    u = np.linspace(0.0, 1.0, 41)
    assert curve(u)[:, 0] == pytest.approx(oracle(u), abs=1e-12)


@given(pieces, seconds, seeds)
def test_inner_control_points_change_nothing_at_the_ends(count: int, duration: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    q, v, a, goal = rng.normal(size=(4, 2))
    motion = TimeSpline(ROBOT, count, 6)
    points = motion.quintic @ np.array([q, v * duration, a * duration**2, goal])
    points[FIXED:-FIXED] += rng.normal(size=(motion.inner, 2))
    trajectory = motion.trajectory(SplineShape(ca.DM(points), ca.DM(duration)))
    start, end = (np.array([trajectory.at(t, n)[0] for n in range(3)]) for t in ([0.0], [trajectory.duration]))
    assert trajectory.duration == pytest.approx(duration)
    assert start == pytest.approx(np.array([q, v, a]), abs=1e-7)
    assert end == pytest.approx(np.array([goal, 0.0 * goal, 0.0 * goal]), abs=1e-7)
    assert motion.inner == count - 1


def test_four_derivatives_are_continuous() -> None:
    motion = TimeSpline(ROBOT, 5, 10)
    points = np.random.default_rng(3).normal(size=(motion.spline.size, 2))
    trajectory = motion.trajectory(SplineShape(ca.DM(points), ca.DM(1.7)))
    for order in range(5):
        curve = trajectory.derivative(order)
        before = [curve(np.nextafter(t, 0.0)) for t in trajectory.breakpoints[1:-1]]
        assert np.array(before) == pytest.approx(curve(trajectory.breakpoints[1:-1]), rel=1e-6, abs=1e-6)


def test_rows_of_a_table_hold_the_samples() -> None:
    motion = TimeSpline(ROBOT, 3, 7)
    trajectory = motion.trajectory(SplineShape(ca.DM.ones(motion.spline.size, 2), ca.DM(2.0)))
    times = motion.row_times(trajectory, 50)
    assert times.size >= 50
    assert np.isin(np.round(2.0 * motion.parameters_u, 12), np.round(times, 12)).all()
