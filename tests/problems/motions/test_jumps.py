"""Jumps of a motion: relative to what moves, but never to so much that a visible one is small."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin

from problems import Trajectory
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
