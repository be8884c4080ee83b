"""Motions of obstacles against SciPy: where a frame is, and how far its points move at most."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.moving import KINDS, random_motion

from problems import ConstantVelocity, Ellipse, InvalidProblem, MovingObstacle, Tabulated
from problems.base import Arguments, as_array

each_kind = pytest.mark.parametrize(("dim", "kind"), [(dim, kind) for dim in (2, 3) for kind in KINDS])
seeds = st.integers(0, 2**32 - 1)
TIMES = np.linspace(-3.0, 8.0, 57)


@each_kind
@settings(max_examples=8, deadline=None)
@given(seed=seeds)
def test_what_is_seen_and_placed_is_what_splines_and_rotations_say(dim: int, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion, oracle = random_motion(rng, kind, (0.0,) * dim)
    origins, axes = oracle(TIMES)
    points = rng.uniform(-2.0, 2.0, (len(TIMES), dim))
    seen = np.einsum("nij,ni->nj", axes, points - origins)
    assert as_array(motion.seen(ca.DM(points), ca.DM(TIMES))) == pytest.approx(seen, abs=1e-9)
    assert motion.frames(TIMES).seen(points) == pytest.approx(seen, abs=1e-9)
    for k in (0, 20, 56):
        there = points @ axes[k].T + origins[k]
        assert motion.placed(points, TIMES[k]) == pytest.approx(there, abs=1e-9)
        back = as_array(motion.seen(ca.DM(motion.placed(points, TIMES[k])), ca.DM(TIMES[k])))
        assert back == pytest.approx(points, abs=1e-9)


@each_kind
@settings(max_examples=8, deadline=None)
@given(seed=seeds)
def test_no_point_moves_farther_than_its_travel(dim: int, kind: str, seed: int) -> None:
    """Cells before the table, after it, within a piece, across many, and of no length."""
    rng = np.random.default_rng(seed)
    motion, oracle = random_motion(rng, kind, (0.0,) * dim)
    extent = float(rng.uniform(0.1, 2.0))
    starts = rng.uniform(-3.0, 7.0, 15)
    lengths = rng.choice([0.0, 0.01, 0.1, 1.0, 6.0], 15)
    cells = np.column_stack([starts, starts + lengths])
    travel = motion.travel(cells, extent)
    assert travel.shape == (15,)
    ways = rng.normal(size=(30, dim))
    points = extent * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    for (start, end), bound in zip(cells, travel, strict=True):
        times = np.append(np.linspace(start, end, 60), (start + end) / 2.0)
        origins, axes = oracle(times)
        places = np.einsum("nij,mj->nmi", axes, points) + origins[:, None]
        assert np.linalg.norm(places - places[-1], axis=2).max() <= bound + 1e-9


@each_kind
@settings(max_examples=8, deadline=None)
@given(seed=seeds)
def test_the_frame_is_never_farther_away_than_its_offset(dim: int, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion, oracle = random_motion(rng, kind, (0.0,) * dim)
    first, last = sorted(rng.uniform(-3.0, 8.0, 2))
    farthest = np.linalg.norm(oracle(np.linspace(first, last, 300))[0], axis=1).max()
    assert motion.offset(first, last) >= farthest - 1e-9


@each_kind
@settings(max_examples=5, deadline=None)
@given(seed=seeds)
def test_a_later_clock_tells_the_same_places(dim: int, kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion, oracle = random_motion(rng, kind, (0.0,) * dim)
    seconds = float(rng.uniform(0.0, 3.0))
    origins, axes = oracle(TIMES + seconds)
    frames = motion.later(seconds).frames(TIMES)
    assert frames.origins == pytest.approx(origins, abs=1e-9)
    assert frames.placed(np.eye(dim)) == pytest.approx(axes.transpose(0, 2, 1) + origins[:, None], abs=1e-9)


def test_small_cells_cost_what_the_frame_does_then_not_the_most_it_ever_does() -> None:
    """A start from rest: x = t^3 within one piece, v = 3 t^2, a = 6 t, by hand at t = 0.1 in a cell of 0.02 s."""
    motion = Tabulated.through([0.0, 1.0, 2.0, 3.0], np.array([[t**3, 0.0] for t in range(4)]))
    (travel,) = motion.travel(np.array([[0.09, 0.11]]), 1.0)
    assert travel == pytest.approx(0.03 * 0.01 + 6.0 * 0.02**2 / 8.0, rel=1e-9)  # the piece ends at t = 1: a = 6 there
    (across,) = motion.travel(np.array([[0.99, 1.01]]), 1.0)
    assert across == pytest.approx(12.0 * 0.01, rel=1e-9)  # v = 12 at t = 2, the end of the second piece


def test_it_stands_still_before_the_first_row_and_after_the_last() -> None:
    motion = Tabulated.through([1.0, 2.0], np.array([[0.0, 0.0], [1.0, 2.0]]))
    assert motion.travel(np.array([[-1.0, 1.0], [2.0, 9.0]]), 1.0).tolist() == [0.0, 0.0]
    assert motion.frames(np.array([-5.0, 9.0])).origins.tolist() == [[0.0, 0.0], [1.0, 2.0]]
    half = np.sqrt(5.0) * 0.5 * 2.0
    assert motion.travel(np.array([[0.5, 2.5]]), 1.0) == pytest.approx([half])


@each_kind
def test_numbers_become_symbols_of_the_same_formula(dim: int, kind: str) -> None:
    motion, _ = random_motion(np.random.default_rng(5), kind, (0.0,) * dim)
    arguments = Arguments()
    symbolic_copy = arguments.symbolic_copy(motion)
    points, time = ca.SX.sym("points", 1, dim), ca.SX.sym("time")
    function = ca.Function("seen", [points, time, arguments.symbols], [symbolic_copy.seen(points, time)])
    point = np.full((1, dim), 0.3)
    for at in (-2.0, 0.4, 6.0):
        expected = motion.frames(np.array([at])).seen(point)
        assert as_array(function(point, at, arguments.values)) == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("times", "places", "turns", "reason"),
    [
        ([0.0], [[0.0, 0.0]], None, "two rows"),
        ([0.0, 0.0], [[0.0, 0.0]] * 2, None, "times have to increase"),
        ([0.0, np.inf], [[0.0, 0.0]] * 2, None, "t = inf s is not within"),
        ([0.0, 1.0], [[0.0, np.nan]] * 2, None, "nan"),
        ([0.0, 1.0], [[0.0] * 3] * 2, [[0.0, 0.0, 0.0, 2.0]] * 2, "quaternion of length 2, not 1"),
        ([0.0, 1.0], [[0.0] * 3] * 2, [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]], "more than 90 degrees"),
    ],
)
def test_impossible_tables_are_named(times: list[float], places: Any, turns: Any, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        Tabulated.through(times, np.array(places), None if turns is None else np.array(turns))


def test_velocity_and_origin_are_of_one_dimension() -> None:
    with pytest.raises(InvalidProblem, match="velocity"):
        ConstantVelocity((1.0, 0.0), (0.0, 0.0, 0.0))


ROWS = [0.0, 1.0, 1.5, 4.0]
LINE_PLACES = np.array([[0.0, 0.0], [2.0, -1.0], [2.0, 1.0], [-3.0, 1.0]])
LINES = Tabulated.along_lines(ROWS, LINE_PLACES)


def place_at(motion: Tabulated, time: float) -> np.ndarray:
    return motion.placed(np.zeros((1, motion.dim)), time)[0]


@pytest.mark.parametrize("time", [-1.0, 0.0, 0.3, 1.0, 1.2, 1.5, 3.9, 4.0, 7.0])
def test_between_rows_it_goes_straight(time: float) -> None:
    expected = [np.interp(time, ROWS, LINE_PLACES[:, axis]) for axis in (0, 1)]
    assert place_at(LINES, time) == pytest.approx(expected)


def test_travel_is_bounded_by_the_fastest_line_that_is_met() -> None:
    speeds = np.linalg.norm(np.diff(LINE_PLACES, axis=0), axis=1) / np.diff(ROWS)
    cells = np.array([[0.2, 0.4], [1.1, 1.3], [2.0, 3.0], [0.9, 1.1]])
    expected = np.array([0.1 * speeds[0], 0.1 * speeds[1], 0.5 * speeds[2], 0.1 * speeds[1]])
    assert LINES.travel(cells, 1.0) == pytest.approx(expected)


@pytest.mark.parametrize(("first", "last", "kept"), [
    (0.2, 0.8, (0.0, 1.0)), (0.2, 1.2, (0.0, 1.0, 1.5)), (1.0, 1.5, (1.0, 1.5)), (5.0, 6.0, (1.5, 4.0)),
    (-2.0, -1.0, (0.0, 1.0)), (1.5, 1.5, (1.5, 4.0)), (-1.0, 9.0, (0.0, 1.0, 1.5, 4.0)),
])  # fmt: skip
def test_during_a_time_it_is_the_same_with_the_pieces_that_meet_it(
    first: float, last: float, kept: tuple[float, ...]
) -> None:
    fewer = LINES.during(first, last)
    assert fewer.breaks == kept
    for time in np.linspace(first, last, 7):
        assert place_at(fewer, time) == pytest.approx(place_at(LINES, time))


def test_a_moving_obstacle_is_the_same_during_a_time() -> None:
    still = Ellipse((1.0, 0.5), (0.3, 0.2), 0.4)
    obstacle = MovingObstacle(still, LINES)
    fewer = obstacle.during(1.1, 1.4)
    points, times = ca.DM([[0.3, 0.4]]), ca.DM([1.2])
    assert np.array(fewer.seen(points, times)) == pytest.approx(np.array(obstacle.seen(points, times)))
    assert len(fewer.motion.breaks) == 2  # type: ignore[attr-defined]
    motion = ConstantVelocity((1.0, 0.0))
    assert motion.during(0.0, 1.0) is motion
    assert still.during(0.0, 1.0) is still
