"""Taylor models hold what they stand for, whatever is computed with them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.base import FloatArray, as_array
from problems.certify.taylor import DEGREE, ENTRIES, Moments, TimeCells, modelled
from problems.certify.torque import extremes
from problems.motions import Trajectory

FORMULAS: dict[str, Callable[[Any], Any]] = {
    "sum": lambda x: x[0] + x[1] - 2.5,
    "product": lambda x: x[0] * x[1] * x[2],
    "square": lambda x: x[0] ** 2 - x[1] * 3.0,
    "sine": lambda x: ca.sin(x[0]) * x[1],
    "cosine": lambda x: -ca.cos(x[0] + x[1]) + 2.0 * x[2],
    "like a torque": lambda x: (2.0 + ca.cos(x[1])) * x[2] - ca.sin(x[1]) * (2.0 * x[0] * x[2] + x[2] ** 2),
    "a copy": lambda x: x[0],
    "a number": lambda x: ca.SX(3.0),
}
number = st.floats(-3.0, 3.0)
SHARES = np.linspace(-1.0, 1.0, 41)


def compiled(formula: Callable[[Any], Any]) -> ca.Function:
    x = ca.SX.sym("x", 3)
    return ca.Function("f", [x], [ca.densify(formula(x))])


def polynomial(model: FloatArray, shares: FloatArray) -> FloatArray:
    return np.asarray(np.polynomial.Polynomial(model[: DEGREE + 1])(shares))


@pytest.mark.parametrize("formula", FORMULAS.values(), ids=FORMULAS)
@settings(max_examples=30, deadline=None)
@given(
    st.lists(number, min_size=3 * (DEGREE + 1), max_size=3 * (DEGREE + 1)),
    st.lists(st.floats(0.0, 0.5), min_size=3, max_size=3),
    st.integers(0, 2**32 - 1),
)
def test_a_model_holds_every_function_that_it_stands_for(
    formula: Callable[[Any], Any], numbers: list[float], rests: list[float], seed: int
) -> None:
    function, models = compiled(formula), np.column_stack([np.reshape(numbers, (3, DEGREE + 1)), rests])
    found = as_array(modelled(function)(models.ravel())).ravel()
    away = np.random.default_rng(seed).uniform(-1.0, 1.0, (3, SHARES.size)) * np.array(rests)[:, None]
    inputs = np.array([polynomial(model, SHARES) for model in models]) + away
    values = as_array(function(inputs)).ravel()
    assert (np.abs(values - polynomial(found, SHARES)) <= found[-1] * (1.0 + 1e-12)).all()


def test_the_rest_shrinks_with_the_fourth_power_of_a_cell() -> None:
    function, rests = modelled(compiled(FORMULAS["like a torque"])), []
    for half in (0.1, 0.05, 0.025):
        models = np.zeros((3, ENTRIES))
        models[:, : DEGREE + 1] = np.array([[0.3, 1.0, 2.0, -1.0], [1.0, -0.5, 1.0, 0.2], [0.7, 2.0, 0.1, 1.0]])
        models[:, : DEGREE + 1] *= half ** np.arange(DEGREE + 1)
        rests.append(float(function(models.ravel())[ENTRIES - 1]))
    assert np.array(rests[:-1]) / np.array(rests[1:]) == pytest.approx(16.0, rel=0.15)


@given(st.lists(st.sampled_from([0.0, 1.0, -2.0, 0.3, 1e-9, 5.0]), min_size=4, max_size=4), st.floats(0.0, 1.0))
def test_extremes_of_a_model_are_those_of_its_polynomial_and_its_rest(coefficients: list[float], rest: float) -> None:
    model = np.array([*coefficients, rest])[:, None]
    (low, when_low), (high, when_high) = extremes(model)
    dense = polynomial(model[:, 0], np.linspace(-1.0, 1.0, 2001))
    for bound, when, value, sign in ((low, when_low, dense.min(), -1.0), (high, when_high, dense.max(), 1.0)):
        assert -1e-12 <= bound[0] * sign - rest - value * sign <= 1e-4
        assert polynomial(model[:, 0], when)[0] == pytest.approx(bound[0] - sign * rest, abs=1e-12)


# Motions as Taylor models


def motion(degree: int, seed: int = 3) -> Trajectory:
    """Two joints, three pieces that need not join."""
    return Trajectory(np.array([0.0, 0.3, 0.5, 2.0]), np.random.default_rng(seed).normal(size=(degree + 1, 3, 2)))


@pytest.mark.parametrize("degree", [0, 1, 2, 5, 9])
def test_cells_hold_angles_speeds_and_accelerations(degree: int) -> None:
    moving = motion(degree)
    cells = TimeCells.over(moving, 7).halved(np.arange(9) % 2 == 0)
    models = cells.models().reshape(3, 2, ENTRIES, len(cells))
    for share in (-1.0, -0.3, 0.0, 0.8, 1.0):
        values = cells.moments(np.full(len(cells), share)).derivatives().reshape(3, 2, len(cells))
        powers = share ** np.arange(DEGREE + 1)
        away = np.abs(values - np.einsum("ojpn,p->ojn", models[:, :, : DEGREE + 1], powers))
        assert (away <= models[:, :, -1]).all()


def test_cells_cross_no_breakpoint_and_leave_no_gap() -> None:
    moving = motion(2)
    cells = TimeCells.over(moving, 7)
    cells = cells.halved(np.full(len(cells), True))
    starts, ends = (cells.moments(np.full(len(cells), side)).times for side in (-1.0, 1.0))
    order = np.argsort(starts)
    assert ends[order][:-1] == pytest.approx(starts[order][1:], abs=1e-15)
    assert (starts.min(), ends.max()) == (0.0, pytest.approx(moving.duration))
    for time in moving.breakpoints:
        assert not ((starts < time - 1e-12) & (ends > time + 1e-12)).any()


def test_moments_are_what_a_motion_is_then_on_both_sides_of_breakpoints() -> None:
    moving = motion(5)
    found = Moments.at(moving, np.array([0.1, 0.5, 1.7]))
    assert found.times == pytest.approx([0.1, 0.5, 1.7, 0.0, 0.3, 0.5, 0.3, 0.5, 2.0])
    before = np.nextafter(moving.breakpoints[1:], 0.0)
    seen_from = np.concatenate([[0.1, 0.5, 1.7], moving.breakpoints[:-1], before])
    expected = np.concatenate([moving.at(seen_from, order).T for order in range(3)])
    assert found.derivatives() == pytest.approx(expected, rel=1e-9, abs=1e-9)
