"""Jumps of a motion: relative to what moves, but never to so much that a visible one is small."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin

from problems import CertificateStatus, PlanarArm, Trajectory
from problems.certify import limit_verdicts
from problems.limits.joint_limits import JerkLimit
from solvers import Box

ALLOWED = 1e-9  # what an audit accepts
REST = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])  # from rest to rest through 1 rad in 1 s, lowest power first


def pieces(*steps: tuple[float, float]) -> Trajectory:
    """From rest to rest: for each step the angle at which it begins and how far it goes."""
    coefficients = [np.column_stack([start * (np.arange(6) == 0) + way * REST]) for start, way in steps]
    return Trajectory.from_pieces(np.ones(len(steps)), coefficients)


@pytest.mark.parametrize("way", [1e-5, 1.0, 100.0])
def test_what_joins_has_no_jump(way: float) -> None:
    assert pieces((0.3, way), (0.3 + way, -way)).largest_jump() < 1e-10


def test_a_motion_that_stands_still_has_no_jump() -> None:
    assert pieces((0.3, 0.0), (0.3, 0.0)).largest_jump() == 0.0
    assert pieces((2.5, 1e-17), (2.5, -1e-17)).largest_jump() < ALLOWED


@pytest.mark.parametrize("turns", [0.1, 1.0, 1e4, 1e8, 1e12])
def test_no_number_of_turns_hides_half_a_radian(turns: float) -> None:
    way = 2.0 * np.pi * turns
    assert pieces((0.0, way), (way + 0.5, -way)).largest_jump() >= 0.49


@pytest.mark.parametrize("way", [1.0, 1e-3, 1e-6])
def test_a_small_motion_may_not_jump_by_a_part_of_itself(way: float) -> None:
    assert pieces((0.0, way), (way * 1.01, -way)).largest_jump() >= 0.0099


@pytest.mark.parametrize("order", [1, 2])
def test_nor_may_speed_or_acceleration_jump_beside_a_fast_piece(order: int) -> None:
    fast = 1e9 * REST
    jump = np.zeros(6)
    jump[order] = 0.5 * 2.0 ** (order - 1)  # 0.5 rad/s or 1 rad/s^2 at the start of the last piece
    last = jump - 0.5 * np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    trajectory = Trajectory.from_pieces(
        np.ones(3), [np.column_stack([c]) for c in (fast, -fast + 1e9 * (np.arange(6) == 0), last)]
    )
    assert trajectory.largest_jump() > 1e-3


def test_a_start_or_an_end_in_motion_counts() -> None:
    moving = Trajectory.from_pieces(np.ones(1), [np.array([[0.0], [1.0]])])
    assert moving.largest_jump() == pytest.approx(1.0)


@pytest.mark.parametrize("number", [np.inf, np.nan, 1e308, -1e308, 1e300, 1e160])
def test_what_is_no_motion_is_no_smooth_one(number: float) -> None:
    coefficients = np.zeros((6, 2, 1))
    coefficients[:, 0, 0] = number
    with np.errstate(over="raise"):
        assert Trajectory(np.array([0.0, 1.0, 2.0]), coefficients).largest_jump() > ALLOWED


@pytest.mark.parametrize("seconds", [1e-4, 1.0, 1e5])
@pytest.mark.parametrize("name", BUILTIN)
def test_the_motions_of_the_paper_join_at_any_speed(name: str, seconds: float) -> None:
    for formulation in ("paper", "reduced"):
        problem = builtin(name, formulation)
        for x in Box(*problem.bounds).sample(np.random.default_rng(0), 20):
            assert problem.trajectory(x).time_scaled(seconds).largest_jump() < 0.1 * ALLOWED


# What a motion promises: velocities of its own at the ends, accelerations that may jump


def uniform(*speeds: float) -> Trajectory:
    """One joint in steps of 1 s, from one speed to the next at constant acceleration."""
    angle, coefficients = 0.0, []
    for before, after in pairwise(speeds):
        coefficients.append(np.array([[angle], [before], [(after - before) / 2.0]]))
        angle += (before + after) / 2.0
    return Trajectory.from_pieces(np.ones(len(coefficients)), coefficients)


def test_velocities_of_the_task_at_the_ends_are_no_jumps() -> None:
    motion = uniform(0.5, 1.0, 0.25)
    assert motion.largest_jump(np.array([[0.5], [0.25]]), smooth_orders=2) < 1e-15
    assert motion.largest_jump(np.array([[0.5], [0.0]]), smooth_orders=2) == pytest.approx(0.25)
    assert motion.largest_jump(smooth_orders=2) == pytest.approx(0.5)


def test_accelerations_count_where_they_have_to_be_continuous() -> None:
    motion = uniform(0.0, 1.0, 0.0)
    assert motion.largest_jump(smooth_orders=2) < 1e-15
    assert motion.largest_jump() == pytest.approx(2.0)


def test_an_acceleration_just_before_its_jump_is_among_the_extremes() -> None:
    motion = uniform(0.0, 0.5, 3.0, 2.75)  # 0.5, 2.5, -0.25 rad/s^2
    assert np.abs(motion.at(motion.extreme_times(2), 2)).max() == pytest.approx(2.5)
    backwards = uniform(0.0, 3.0, 3.5)
    assert np.abs(backwards.at(backwards.extreme_times(2), 2)).max() == pytest.approx(3.0)
    ramp = Trajectory.from_pieces(np.ones(2), [np.array([[0.0], [0.0], [0.0], [1.0]]), np.array([[1.0], [3.0]])])
    assert np.abs(ramp.at(ramp.extreme_times(2), 2)).max() == pytest.approx(6.0)  # up to 6, then 0


def test_where_a_derivative_jumps_is_known() -> None:
    assert uniform(0.0, 1.0, 0.5).jump_time(1) is None
    assert uniform(0.0, 1.0, -1.0, 0.0).jump_time(2) == pytest.approx(1.0)
    assert pieces((0.0, 1.0), (1.0, -1.0)).jump_time(2) is None


def test_no_jerk_limit_holds_where_the_acceleration_jumps() -> None:
    robot = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0), max_jerk=(1e6, 1e6))
    jumping, smooth = (
        Trajectory(motion.breakpoints, np.repeat(motion.coefficients, 2, axis=2))
        for motion in (uniform(0.0, 1.0, 0.0), pieces((0.0, 1.0), (1.0, -1.0)))
    )
    [verdict] = limit_verdicts([JerkLimit(robot)], jumping)
    assert verdict.status is CertificateStatus.VIOLATED
    assert verdict.worst == np.inf
    assert limit_verdicts([JerkLimit(robot)], smooth)[0].satisfied


def test_a_moving_end_may_be_curved_but_not_accelerated() -> None:
    circle = np.array([[1.0, 0.0], [0.0, 0.5], [-0.5, 0.0]])[::-1]  # velocity (0, 0.5), acceleration (-1, 0) at t = 0
    across = Trajectory(np.array([0.0, 0.1]), circle[:, None])
    braking = Trajectory(np.array([0.0, 0.1]), (circle - np.array([[0.0, 0.25], [0.0, 0.0], [0.0, 0.0]]))[:, None])
    assert across._accelerations_along_ends()[0] == 0.0
    assert braking._accelerations_along_ends()[0] == pytest.approx(0.5)
    assert braking.jump_time(2) == 0.0


def test_an_acceleration_that_is_given_at_the_start_is_no_jump() -> None:
    ramp = Trajectory(np.array([0.0, 1.0]), np.array([[-1.0], [1.5], [0.0], [0.0]])[:, None])  # a = 3 - 6 t
    outside = np.array([[3.0], [-3.0]])
    assert ramp.jump_time(2) == 0.0
    assert ramp.jump_time(2, outside) is None
    assert ramp.jump_time(2, outside * [[1.0], [0.0]]) == 1.0
    rates = np.array([[0.0], [0.0]])
    assert ramp.largest_jump(rates, end_accelerations=outside) < 1e-12
    assert ramp.largest_jump(rates) == pytest.approx(3.0)  # relative to 1 rad / s^2, the most that counts
