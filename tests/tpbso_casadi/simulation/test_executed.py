"""Parts of motions against SciPy's own polynomials."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import Trajectory
from tests.helpers.quintic_planner import quintic_to
from tpbso_casadi.simulation import stands
from tpbso_casadi.simulation.record import joined, jumps_between, part, rest_time

BREAKS = np.array([0.0, 0.5, 0.75, 2.0])


def motion(seed: int = 1, order: int = 6) -> Trajectory:
    """Polynomials that have nothing to do with each other: they jump at the breakpoints."""
    return Trajectory(BREAKS, np.random.default_rng(seed).normal(size=(order, 3, 2)))


@settings(max_examples=40, deadline=None)
@given(first=st.floats(0.0, 2.5), length=st.floats(0.01, 2.0), seed=st.integers(0, 50))
def test_a_part_is_the_same_motion_later_and_stands_at_its_end(first: float, length: float, seed: int) -> None:
    whole = motion(seed)
    cut = part(whole, first, first + length)
    assert cut.duration == pytest.approx(length)
    times = np.linspace(0.0, length, 41)[1:-1]
    times = times[np.abs((first + times)[:, None] - BREAKS).min(axis=1) > 1e-9]
    before = first + times < whole.duration
    for order in range(4):
        expected = whole.at(first + times[before], order)
        assert cut.at(times[before], order) == pytest.approx(expected, rel=1e-9, abs=1e-9)
        still = cut.at(times[~before], order)
        end = whole.at(np.array([2.0]))[0] if order == 0 else np.zeros(2)
        assert still == pytest.approx(np.tile(end, (len(still), 1)))


def test_parts_make_up_the_whole() -> None:
    whole = motion()
    again = joined([part(whole, first, last) for first, last in ((0.0, 0.2), (0.2, 0.75), (0.75, 2.0))])
    assert again.breakpoints == pytest.approx([0.0, 0.2, 0.5, 0.75, 2.0])
    times = np.linspace(0.01, 1.99, 200)
    assert again.at(times, 2) == pytest.approx(whole.at(times, 2))


def test_a_breakpoint_that_is_meant_makes_no_tiny_piece() -> None:
    assert part(motion(), 0.5 - 1e-13, 2.0).breakpoints == pytest.approx([0.0, 0.25, 1.5], abs=1e-12)
    assert part(motion(), 0.0, 0.5 + 1e-13).breakpoints.size == 2


def test_motions_of_different_orders_are_joined() -> None:
    still, moving = Trajectory.standing(np.array([1.0, 2.0]), 0.5), motion()
    both = joined([still, moving])
    assert both.at(np.array([0.2]))[0] == pytest.approx([1.0, 2.0])
    assert both.at(np.array([0.7]))[0] == pytest.approx(moving.at(np.array([0.2]))[0])


def test_jumps_are_those_of_angle_speed_and_acceleration() -> None:
    before = Trajectory(np.array([0.0, 1.0]), np.array([[[1.0, 0.0]], [[0.0, 2.0]], [[0.0, 0.0]]]))  # t^2 and 2 t
    after = Trajectory(np.array([0.0, 1.0, 2.0]), np.zeros((3, 2, 2)))
    after.coefficients[:, 1] = [[1.5, 0.0], [2.0, 1.75], [1.125, 2.0]]  # from t = 1 on
    assert jumps_between(before, after, 1.0) == pytest.approx((0.125, 0.25, 1.0))


def test_what_is_taken_over_smoothly_does_not_jump() -> None:
    before = motion()
    state = [before.at(np.array([0.3]), order)[0] for order in range(3)]
    follows = Trajectory(np.array([0.0, 1.0]), quintic_to(state, np.ones(2), 1.0)[:, None])
    after = joined([part(before, 0.0, 0.3), follows])
    assert max(jumps_between(before, after, 0.3)) < 1e-12
    assert max(jumps_between(before, before, 0.3)) < 1e-12


def test_when_a_motion_has_come_to_rest() -> None:
    moving = Trajectory(np.array([0.0, 1.0]), np.ones((2, 1, 2)))
    still = Trajectory.standing(np.zeros(2), 0.5)
    assert stands(joined([still, moving, still])).tolist() == [True, False, True]
    assert rest_time(joined([still, moving, still, still])) == 1.5
    assert rest_time(joined([still, still])) == 0.0
    assert rest_time(moving) == 1.0
