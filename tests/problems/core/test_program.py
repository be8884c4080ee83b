"""Linear programs of control points as the compiled core solves them, against HiGHS."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from problems.core import LinearProgram, SingleRows, WholeRows

HARD = 1e-7  # by how much a row may be broken that has to be kept
COST = 2e-6  # s: no cost is farther from the least one
DURATION, TRUST, FASTER, SLOWER = 1.3, 0.25, 0.2, 0.4
AT_REST = 3
WIDTH = 4  # control points in a row


@dataclass(frozen=True)
class Shape:
    """Joints, pieces of the spline, postures looked at in each, rows of clearances, and what is drawn."""

    joints: int
    pieces: int
    looks: int
    near: int
    seed: int


shapes = st.builds(
    Shape, st.integers(1, 8), st.integers(4, 24), st.integers(1, 4), st.integers(0, 60), st.integers(0, 10_000)
)


def of_four(pieces: int, u: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights of four control points in a derivative of a spline at parameters (m,), and the first of them."""
    knots = np.concatenate([np.zeros(3), np.linspace(0.0, 1.0, pieces + 1), np.ones(3)])
    first = np.minimum((u * pieces).astype(int), pieces - 1)
    every = BSpline(knots, np.eye(pieces + 3), 3)(u, nu=order)
    return np.take_along_axis(every, first[:, None] + np.arange(WIDTH), axis=1), first - AT_REST


def planned(shape: Shape) -> LinearProgram:
    """Of a motion within its limits: rows of two derivatives, clearances some of which lack a little, a box."""
    rng, k, n = np.random.default_rng(shape.seed), shape.joints, shape.pieces + 3 - 2 * AT_REST
    single = []
    for order in (1, 2):
        u = rng.uniform(0.0, 1.0, shape.pieces * shape.looks)
        weights, first = of_four(shape.pieces, u, order)
        joint = rng.integers(0, k, u.size)
        limit = rng.uniform(1.0, 3.0, k)[joint] * (10.0 * DURATION) ** order
        now = rng.uniform(-1.0, 1.0, u.size)
        for side in (1.0, -1.0):
            by_time = np.full(u.size, -order / DURATION)
            single.append((joint, first, side * weights / limit[:, None], by_time, 1.0 - side * now))
    u = rng.uniform(0.0, 1.0, shape.near)
    weights, first = of_four(shape.pieces, u, 0)
    slopes = rng.normal(size=(shape.near, k)) * 0.5
    whole = WholeRows(
        first=first,
        weights=-weights[:, :, None] * slopes[:, None],
        by_time=np.where(rng.random(shape.near) < 0.3, rng.normal(size=shape.near) * 0.1, 0.0),
        bound=rng.uniform(-0.03, 0.1, shape.near),
        price=np.where(rng.random(shape.near) < 0.2, np.inf, 10.0 ** rng.uniform(-1.0, 1.5, shape.near)),
    )
    whole = replace(whole, bound=np.where(np.isinf(whole.price), np.abs(whole.bound), whole.bound))
    box = np.full((n, k), TRUST)
    return LinearProgram(
        SingleRows(*(np.concatenate(each) for each in zip(*single, strict=True))), whole, -box, box, (-FASTER, SLOWER)
    )


def left_of(program: LinearProgram, x: np.ndarray, tau: float) -> tuple[np.ndarray, np.ndarray]:
    """By how much the rows of one joint, and of all joints, are broken."""
    one, every = program.single, program.whole
    padded = np.pad(x, ((WIDTH, WIDTH), (0, 0)))
    alone = padded[one.first[:, None] + np.arange(WIDTH) + WIDTH, one.joint[:, None]]
    together = padded[every.first[:, None] + np.arange(WIDTH) + WIDTH]
    return (
        (one.weights * alone).sum(axis=1) + one.by_time * tau - one.bound,
        (every.weights * together).sum(axis=(1, 2)) + every.by_time * tau - every.bound,
    )


def cost_of(program: LinearProgram, x: np.ndarray, tau: float) -> float:
    soft = np.isfinite(program.whole.price)
    missing = np.maximum(left_of(program, x, tau)[1], 0.0)
    return tau + float((program.whole.price[soft] * missing[soft]).sum())


def check(program: LinearProgram) -> None:
    """What has to be kept is kept, and it costs as little as with HiGHS."""
    found, other = program.solved(), program.by_highs()
    assert found is not None and other is not None
    x, tau = found
    assert (program.lower <= x).all() and (x <= program.upper).all()
    assert program.times[0] <= tau <= program.times[1]
    alone, together = left_of(program, x, tau)
    assert max(alone.max(initial=0.0), together[np.isinf(program.whole.price)].max(initial=0.0)) <= HARD
    assert cost_of(program, x, tau) == pytest.approx(cost_of(program, *other), abs=COST)


@settings(max_examples=40)
@given(shapes)
def test_programs_of_planners_cost_as_little_as_with_highs(shape: Shape) -> None:
    check(planned(shape))


def curved(shape: Shape) -> LinearProgram:
    """The same with squares, costs of points and another cost of the time."""
    program, rng = planned(shape), np.random.default_rng(shape.seed + 1)
    n, k = program.lower.shape
    u = rng.uniform(0.0, 1.0, 3 * shape.pieces)
    weights, first = of_four(shape.pieces, u, 0)
    squares = WholeRows(
        first=first,
        weights=weights[:, :, None] * rng.normal(size=(u.size, 1, k)),
        by_time=np.where(rng.random(u.size) < 0.5, rng.normal(size=u.size), 0.0),
        bound=0.1 * rng.normal(size=u.size),
        price=10.0 ** rng.uniform(-3.0, 1.0, u.size),
    )
    return replace(program, squares=squares, cost=0.1 * rng.normal(size=(n, k)), time_cost=rng.normal())


def tangent(program: LinearProgram, x: np.ndarray, tau: float) -> LinearProgram:
    """The linear program that costs no more anywhere, and at a point as much but for a constant."""
    rows, padded = program.squares, np.pad(x, ((WIDTH, WIDTH), (0, 0)))
    assert rows is not None and program.cost is not None
    near = rows.first[:, None] + np.arange(WIDTH) + WIDTH
    away = (rows.weights * padded[near]).sum(axis=(1, 2)) + rows.by_time * tau - rows.bound
    slopes = np.zeros_like(padded)
    np.add.at(slopes, near, rows.weights * (rows.price * away)[:, None, None])
    by_time = program.time_cost + float(rows.price @ (away * rows.by_time))
    return replace(program, squares=None, cost=program.cost + slopes[WIDTH:-WIDTH], time_cost=by_time)


def check_curved(program: LinearProgram, found: tuple[np.ndarray, float] | None) -> None:
    """What has to be kept is kept, and no point costs less: by HiGHS, of the tangent there."""
    assert found is not None
    alone, together = left_of(program, *found)
    assert max(alone.max(initial=0.0), together[np.isinf(program.whole.price)].max(initial=0.0)) <= HARD
    assert (program.lower <= found[0]).all() and (found[0] <= program.upper).all()
    linear = tangent(program, *found)
    least = linear.by_highs()
    assert least is not None and linear.cost is not None

    def cost(x: np.ndarray, tau: float) -> float:
        return cost_of(linear, x, tau) + (linear.time_cost - 1.0) * tau + float((linear.cost * x).sum())

    assert cost(*found) == pytest.approx(cost(*least), abs=5.0 * COST)


@settings(max_examples=30)
@given(shapes)
def test_nothing_costs_less_where_squares_count(shape: Shape) -> None:
    program = curved(shape)
    check_curved(program, program.solved())


def test_what_contradicts_itself_has_no_solution_with_squares_either() -> None:
    rows = [(0, 0, (1.0, 0.0, 0.0, 0.0), 0.0, -0.2), (0, 0, (-1.0, 0.0, 0.0, 0.0), 0.0, -0.2)]
    assert replace(with_single(nothing(2, 6), rows), squares=curved(Shape(2, 9, 2, 5, 1)).squares).solved() is None


@settings(max_examples=15)
@given(shapes, st.floats(0.05, 1.0))
def test_unknowns_whose_bounds_are_one_number_are_that_number(shape: Shape, share: float) -> None:
    program, rng = planned(shape), np.random.default_rng(shape.seed)
    fixed = rng.random(program.lower.shape) < share
    value = 0.01 * rng.uniform(-1.0, 1.0, fixed.shape)
    soft = replace(program.whole, price=np.where(np.isinf(program.whole.price), 10.0, program.whole.price))
    program = replace(
        program, lower=np.where(fixed, value, program.lower), upper=np.where(fixed, value, program.upper), whole=soft
    )
    check(program)
    found = program.solved()
    assert found is not None
    np.testing.assert_array_equal(found[0][fixed], value[fixed])


def test_where_the_time_is_one_number_only_prices_count() -> None:
    program = replace(planned(Shape(4, 12, 2, 40, 3)), times=(0.1, 0.1))
    check(program)
    found = program.solved()
    assert found is not None and found[1] == 0.1


def nothing(k: int, n: int) -> LinearProgram:
    """A box without a row."""
    none = np.empty(0)
    single = SingleRows(none.astype(np.int32), none.astype(np.int32), np.empty((0, WIDTH)), none, none)
    whole = WholeRows(none.astype(np.int32), np.empty((0, WIDTH, k)), none, none, none)
    return LinearProgram(single, whole, np.full((n, k), -0.5), np.full((n, k), 0.5), (-0.25, 1.0))


@pytest.mark.parametrize("n", [1, 2, 3, 4, 17])
@pytest.mark.parametrize("k", [1, 2, 7, 8, 9])
def test_without_rows_the_time_is_as_short_as_it_may_be(k: int, n: int) -> None:
    found = nothing(k, n).solved()
    assert found is not None and found[0].shape == (n, k)
    assert found[1] == pytest.approx(-0.25, abs=1e-6)
    assert (np.abs(found[0]) <= 0.5).all()


def with_single(program: LinearProgram, rows: list[tuple[int, int, tuple[float, ...], float, float]]) -> LinearProgram:
    joint, first, weights, by_time, bound = (np.array(column) for column in zip(*rows, strict=True))
    return replace(program, single=SingleRows(joint, first, weights.astype(float), by_time.astype(float), bound))


@pytest.mark.parametrize(
    "rows",
    [
        [(0, 0, (-1.0, 0.0, 0.0, 0.0), 0.0, -0.6)],
        [(0, 0, (1.0, 0.0, 0.0, 0.0), 0.0, -0.2), (0, 0, (-1.0, 0.0, 0.0, 0.0), 0.0, -0.2)],
        [(0, 0, (0.0, 0.0, 0.0, 0.0), 0.0, -1e-3)],
    ],
    ids=["the box", "one another", "nothing"],
)
def test_rows_that_contradict_what_has_to_be_kept_have_no_solution(
    rows: list[tuple[int, int, tuple[float, ...], float, float]],
) -> None:
    program = with_single(nothing(2, 6), rows)
    assert program.solved() is None
    assert program.by_highs() is None


@settings(max_examples=10)
@given(shapes)
def test_among_many_rows_one_that_cannot_be_kept_leaves_no_solution(shape: Shape) -> None:
    program = planned(replace(shape, near=shape.near + 1))
    whole, worst = program.whole, -3.0 * TRUST * np.abs(program.whole.weights[0]).sum() - 1.0
    bound, price = whole.bound.copy(), whole.price.copy()
    bound[0], price[0] = worst, np.inf
    assert replace(program, whole=replace(whole, bound=bound, price=price)).solved() is None


def test_a_box_that_is_empty_has_no_solution() -> None:
    program = nothing(2, 6)
    assert replace(program, lower=program.upper + 1e-6).solved() is None
    assert replace(program, times=(0.2, 0.1)).solved() is None


def test_numbers_that_are_none_are_told_from_solutions() -> None:
    program = planned(Shape(3, 10, 2, 20, 1))
    for bound in (np.nan, -np.inf):
        single = replace(program.single, bound=np.append(program.single.bound[:-1], bound))
        assert replace(program, single=single).solved() is None


@pytest.mark.parametrize("reach", [2, 4, 5])
@pytest.mark.parametrize("n", [6, 17, 200])
def test_rows_of_any_reach_and_costs_of_points_cost_as_little_as_with_highs(reach: int, n: int) -> None:
    rng = np.random.default_rng(n + reach)
    first = np.repeat(np.arange(n - reach + 1), 3)
    single = SingleRows(
        np.zeros_like(first), first, rng.normal(size=(first.size, reach)), -rng.random(first.size),
        rng.uniform(0.01, 0.3, first.size),
    )  # fmt: skip
    box, cost = np.ones((n, 1)), rng.normal(size=(n, 1)) / n
    program = LinearProgram(single, WholeRows.none(reach, 1), -box, box, (-0.2, 0.2), cost)
    found, other = program.solved(), program.by_highs()
    assert found is not None and other is not None
    one, two = (tau + float((cost * x).sum()) for x, tau in (found, other))
    assert one == pytest.approx(two, abs=COST)
