"""The fastest motions through given postures."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from helpers.slow import slow_except
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from benchmarks.through import Case, by_nonlinear_program, published
from problems.base import FloatArray
from problems.motions import Trajectory
from problems.robots import JointLimits
from problems.timing import ThroughSettings, fastest_through, least_durations, rest_to_rest, through

LIN_OPTIMUM = 16.0375  # s, by IPOPT with 32 cells a segment
CASES = {case.name: case for case in published()}


def limits(rng: np.random.Generator, joints: int, with_jerk: bool = True) -> JointLimits:
    speed = rng.uniform(0.5, 3.0, joints)
    acceleration = speed * rng.uniform(1.0, 8.0, joints)
    jerk = tuple(acceleration * rng.uniform(1.0, 15.0, joints)) if with_jerk else None
    return JointLimits(speed=tuple(speed), acceleration=tuple(acceleration), jerk=jerk)


def found_through(
    postures: FloatArray, bounds: JointLimits, rates: FloatArray | None = None
) -> tuple[Trajectory, PPoly]:
    """The motion, and the same by SciPy."""
    found = fastest_through(postures, bounds, rates)
    assert found is not None
    return found, PPoly(found.coefficients, found.breakpoints)


def check(postures: FloatArray, bounds: JointLimits, rates: FloatArray | None = None) -> Trajectory:
    """Postures are passed in their order without jumps, and limits kept, as SciPy sees it."""
    found, theta = found_through(postures, bounds, rates)
    cells = (found.breakpoints.size - 1) // (len(postures) - 1)
    np.testing.assert_allclose(theta(found.breakpoints[::cells]), postures, atol=1e-9)
    times = np.linspace(0.0, found.duration, 5_000)
    for order, bound in enumerate(bounds.by_order, start=1):
        assert (np.abs(theta(times, order)) <= bound * (1.0 + 1e-8)).all()
        if order < len(bounds.by_order):
            before, after = (theta(found.breakpoints[1:-1] + side, order) for side in (-1e-9, 1e-9))
            np.testing.assert_allclose(before, after, atol=1e-6 * bound.max() + 1e-8 * max(map(max, bounds.by_order)))
    for order in range(1, len(bounds.by_order)):
        wanted = np.zeros((2, bounds.dof)) if rates is None else rates[:, order - 1]
        np.testing.assert_allclose(theta(found.breakpoints[[0, -1]], order), wanted, atol=1e-8)
    return found


@given(seed=st.integers(0, 10_000), with_jerk=st.booleans(), moving=st.booleans())
@settings(max_examples=12, deadline=None)
def test_postures_are_passed_within_the_limits_sooner_than_with_stops(seed: int, with_jerk: bool, moving: bool) -> None:
    rng = np.random.default_rng(seed)
    joints, count = int(rng.integers(1, 10)), int(rng.integers(2, 7))
    postures, bounds = rng.uniform(-2.0, 2.0, (count, joints)), limits(rng, joints, with_jerk)
    rates = rng.uniform(-0.2, 0.2, (2, 2, joints)) * bounds.by_order[:2] if moving else None
    found = check(postures, bounds, rates)
    if not moving:
        stopping = sum(rest_to_rest(*pair, bounds).duration for pair in pairwise(postures))
        ends = float(least_durations(postures[-1] - postures[0], bounds).max())
        assert ends * (1.0 - 1e-9) <= found.duration <= stopping * 1.01


@pytest.mark.parametrize("name", slow_except(CASES, "Piazzi and Visioli, after [2]"))
def test_no_nonlinear_program_is_faster(name: str) -> None:
    case = CASES[name]
    assert check(case.postures, case.limits).duration <= 1.0005 * by_nonlinear_program(case, 16)


def test_the_classical_problem_is_at_its_optimum() -> None:
    case = CASES["Lin 1983 [1]"]
    assert check(case.postures, case.limits).duration == pytest.approx(LIN_OPTIMUM, rel=1e-3)


def test_ends_that_move_are_no_slower_than_a_nonlinear_program() -> None:
    rng = np.random.default_rng(3)
    rates = np.array([[[0.1, -0.1], [0.3, 0.0]], [[0.2, 0.0], [-0.4, 0.2]]])
    case = Case("moving", rng.uniform(-1.0, 1.0, (3, 2)), limits(rng, 2), rates)
    assert check(case.postures, case.limits, case.rates).duration <= 1.0005 * by_nonlinear_program(case, 16)


@pytest.mark.parametrize(
    "on_the_way",
    [
        [],
        [41.0, 72.0],
        [30.0, 45.0, 69.0, 85.0],
        [41.0, 41.01, 41.03, 72.0],
        [15.0 + 1e-7, 41.0, 41.0 + 1e-4, 100.0 - 1e-7],
    ],
)
def test_postures_on_the_way_of_one_joint_cost_no_time(on_the_way: list[float]) -> None:
    """85 degrees at 100 deg/s and 150 deg/s^2 take 100 / 150 + 85 / 100 s."""
    postures = np.radians([[15.0], *([each] for each in on_the_way), [100.0]])
    bounds = JointLimits(speed=(float(np.radians(100.0)),), acceleration=(float(np.radians(150.0)),))
    assert check(postures, bounds).duration == pytest.approx(100.0 / 150.0 + 0.85, rel=2e-3)


def test_ranges_are_kept_that_the_motion_would_leave() -> None:
    rng = np.random.default_rng(8)
    postures, free = rng.uniform(-1.0, 1.0, (6, 3)), limits(rng, 3)
    box = JointLimits(
        speed=free.speed, acceleration=free.acceleration, jerk=free.jerk,
        position=tuple(zip(postures.min(axis=0) - 0.01, postures.max(axis=0) + 0.01, strict=True)),
    )  # fmt: skip
    found, (low, high) = check(postures, box), np.array(box.position).T
    theta = found.at(np.linspace(0.0, found.duration, 5_000))
    assert (theta >= low - 1e-9).all() and (theta <= high + 1e-9).all()
    outside, _ = found_through(postures, free)
    beyond = outside.at(np.linspace(0.0, outside.duration, 5_000))
    assert ((beyond < low) | (beyond > high)).any()
    assert outside.duration <= 1.001 * found.duration


def test_a_posture_twice_in_a_row_is_passed_once_and_one_alone_is_no_motion() -> None:
    rng = np.random.default_rng(5)
    postures, bounds = rng.uniform(-1.0, 1.0, (4, 3)), limits(rng, 3)
    once, twice = (found_through(each, bounds)[0] for each in (postures, np.repeat(postures, 2, axis=0)))
    assert once.duration == twice.duration
    assert fastest_through(postures[:1].repeat(3, axis=0), bounds) is None


@pytest.mark.parametrize("distance", [1e-7, 1e-9, 1e-12])
@pytest.mark.parametrize("number", [0, 3])
def test_a_posture_near_an_end_costs_no_time(number: int, distance: float) -> None:
    rng = np.random.default_rng(2)
    postures, bounds = rng.uniform(-1.0, 1.0, (4, 3)), limits(rng, 3)
    near = np.insert(postures, max(number, 1), postures[number] + distance, axis=0)
    without, with_it = (found_through(each, bounds)[0] for each in (postures, near))
    assert with_it.duration <= 1.005 * without.duration
    np.testing.assert_array_equal(with_it.at(np.array([0.0]))[0], postures[0])
    np.testing.assert_allclose(with_it.at(np.array([with_it.duration]))[0], postures[-1], atol=1e-12)


@pytest.mark.parametrize("distance", [1e-3, 1e-5, 1e-9])
def test_two_postures_near_each_other_take_no_longer_than_stops(distance: float) -> None:
    rng = np.random.default_rng(2)
    postures, bounds = rng.uniform(-1.0, 1.0, (3, 3)), limits(rng, 3)
    pair = np.insert(postures, 2, postures[1] + distance * (postures[2] - postures[0]), axis=0)
    found, _ = found_through(pair, bounds)
    assert found.duration <= 1.001 * sum(rest_to_rest(*each, bounds).duration for each in pairwise(postures))


def test_no_motion_is_searched_through_very_many_postures() -> None:
    rng = np.random.default_rng(5)
    postures, bounds = rng.uniform(-1.0, 1.0, (5, 3)), limits(rng, 3)
    assert fastest_through(postures, bounds, None, ThroughSettings(most_postures=4)) is None
    assert fastest_through(postures, bounds, None, ThroughSettings(most_postures=5)) is not None


def test_what_is_not_solved_and_slower_than_stops_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    postures, bounds = rng.uniform(-1.0, 1.0, (4, 3)), limits(rng, 3)
    monkeypatch.setattr(through.Passing, "_solved", lambda search, grid, start: (start, False))
    assert fastest_through(postures, bounds) is None


@given(seed=st.integers(0, 10_000), with_jerk=st.booleans())
@settings(max_examples=12, deadline=None)
def test_joints_turn_back_at_the_ends_of_their_ranges(seed: int, with_jerk: bool) -> None:
    """Each joint has vias at both ends of its range, and is faster than with stops."""
    rng = np.random.default_rng(seed)
    joints, count = int(rng.integers(1, 6)), int(rng.integers(4, 8))
    postures, free = rng.uniform(-1.0, 1.0, (count, joints)), limits(rng, joints, with_jerk)
    low, high = postures[1:-1].min(axis=0), postures[1:-1].max(axis=0)
    postures[[0, -1]] = low + rng.uniform(0.1, 0.9, (2, joints)) * (high - low)
    found = check(postures, replace(free, position=tuple(zip(low.tolist(), high.tolist(), strict=True))))
    theta = found.at(found.extreme_times(0))
    assert ((theta >= low - 1e-9) & (theta <= high + 1e-9)).all()
    stopping = sum(rest_to_rest(*pair, free).duration for pair in pairwise(postures))
    assert found.duration <= 1.001 * stopping


def test_a_range_costs_what_a_nonlinear_program_says() -> None:
    rng = np.random.default_rng(13)
    postures, free = rng.uniform(-1.0, 1.0, (4, 1)), limits(rng, 1)
    bounds = replace(free, position=((float(postures.min()) - 0.1, float(postures.max())),))
    case = Case("a via at the end of the range", postures, bounds)
    assert check(postures, bounds).duration <= 1.002 * by_nonlinear_program(case, 16)


def test_what_no_motion_keeps_is_none() -> None:
    """A joint arrives at the end of its range with a velocity that leads beyond it."""
    bounds = JointLimits(speed=(1.0,), acceleration=(1.0,), jerk=(1.0,), position=((0.0, 1.0),))
    postures = np.array([[0.5], [0.2], [1.0 - 1e-6]])
    assert fastest_through(postures, bounds, np.array([[[0.0], [0.0]], [[0.5], [0.0]]])) is not None
    assert fastest_through(postures, bounds, np.array([[[0.0], [0.0]], [[-0.5], [0.0]]])) is None


def test_without_a_core_there_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(through, "found_core", lambda: None)
    rng = np.random.default_rng(5)
    assert fastest_through(rng.uniform(-1.0, 1.0, (3, 2)), limits(rng, 2)) is None
