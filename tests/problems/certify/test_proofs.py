"""Statements for all inputs or all t: interval arithmetic, Bernstein bounds."""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import PPoly

from problems.base import bernstein, within
from problems.certify.interval import bounds

X = ca.SX.sym("x", 2)
EXPRESSIONS = {
    "arithmetic": (X[0] - 2.0 * X[1]) * X[0] + 3.0,
    "quotient": X[0] / (X[1] + 4.0) - 1.0 / (X[0] + 5.0),
    "powers": X[0] ** 2 + X[1] ** 3 - X[0] ** 4,
    "circles": ca.sin(X[0] * 3.0) * ca.cos(X[1]) + ca.cos(2.0 * X[0]),
    "roots": ca.sqrt(X[0] ** 2 + 1.0) + ca.log(X[1] ** 2 + 0.5) + ca.exp(X[0]),
    "inverse": ca.acos(X[0] / 4.0) + ca.atan2(X[1], X[0]) + ca.atan(X[0]) + ca.asin(X[1] / 9.0),
    "kinks": ca.fabs(X[0]) + ca.fmax(X[0], X[1]) - ca.fmin(0.5, X[1]) + ca.ceil(X[0]) + ca.sign(X[1]) + ca.floor(X[1]),
    "branches": ca.if_else(X[0] < X[1], X[0], -X[1]) + ca.logic_and(X[0] <= 1.0, ca.logic_not(X[1] < 0.0)),
}
corner = st.floats(-3.0, 3.0)


@pytest.mark.parametrize("expression", EXPRESSIONS.values(), ids=EXPRESSIONS)
@settings(max_examples=40, deadline=None)
@given(st.tuples(corner, corner), st.tuples(corner, corner), st.integers(0, 1000))
def test_values_stay_in_their_interval(
    expression: ca.SX, first: tuple[float, float], second: tuple[float, float], seed: int
) -> None:
    lower, upper = np.minimum(first, second), np.maximum(first, second)
    function = ca.Function("f", [X], [expression])
    least, most = bounds(function, lower, upper)
    for x in np.random.default_rng(seed).uniform(lower, upper, (30, 2)):
        value = float(function(x))
        assert least[0] - 1e-9 <= value <= most[0] + 1e-9


def test_intervals_by_hand() -> None:
    function = ca.Function("f", [X], [ca.vertcat(X[0] ** 2, ca.cos(X[0]), X[0] + X[1], 1.0 / X[0], ca.DM(7.0))])
    least, most = bounds(function, np.array([-1.0, 2.0]), np.array([2.0, 5.0]))
    assert least == pytest.approx([0.0, np.cos(2.0), 1.0, -np.inf, 7.0])
    assert most == pytest.approx([4.0, 1.0, 7.0, np.inf, 7.0])


@pytest.mark.parametrize("name", BUILTIN)
def test_intervals_hold_every_candidate_of_every_constraint(name: str) -> None:
    problem = builtin(name)
    lower, upper = problem.bounds
    rows = ca.densify(ca.veccat(*(constraint.expression for constraint in problem.constraints)))
    function = ca.Function("rows", [problem.model.x], [rows], {"cse": True})
    least, most = bounds(function, lower, upper)
    for x in np.random.default_rng(0).uniform(lower, upper, (50, lower.size)):
        values = np.asarray(function(x)).ravel()
        scale = 1e-9 * (1.0 + np.abs(values))
        assert (values >= least - scale).all()
        assert (values <= most + scale).all()


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 5))
def test_bernstein_bounds_decide_as_dense_samples_do(seed: int, degree: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(np.append(0.0, rng.uniform(0.2, 1.0, 3)))
    curve = PPoly(rng.normal(size=(degree + 1, 3, 2)), times)
    control = bernstein(curve.c, np.diff(times))
    t = np.concatenate([np.linspace(a, b, 5001)[:-1] for a, b in itertools.pairwise(times)])
    dense = np.concatenate([curve(t), curve(np.nextafter(times[1:], 0.0))])
    low, high = dense.min(axis=0), dense.max(axis=0)
    assert (control.min(axis=(0, 1)) <= low + 1e-9).all()
    assert (control.max(axis=(0, 1)) >= high - 1e-9).all()
    assert within(control, low - 1e-4, high + 1e-4)
    assert not within(control, low + 1e-6, high + 1.0)
    assert not within(control, low - 1.0, high - 1e-6)
