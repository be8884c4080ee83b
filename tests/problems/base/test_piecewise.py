"""Piecewise polynomials, B-splines and their roots, held against SciPy: the same bits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline as SciPySpline
from scipy.interpolate import PPoly, make_interp_spline
from scipy.optimize import minimize_scalar

from problems.base import BSpline, PiecewisePolynomial, bounded_minimum, real_roots

SEEDS = st.integers(0, 2**32 - 1)
ORDERS = range(5)


@given(SEEDS)
def test_piecewise_polynomials_have_the_values_and_derivatives_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, p, k = rng.integers(1, 8), rng.integers(1, 6), rng.integers(1, 8)
    c = rng.normal(size=(n, p, k)) * 10.0 ** rng.integers(-3, 4, size=(n, 1, 1))
    x = np.concatenate([[0.0], np.cumsum(rng.uniform(0.01, 1.0, p))])
    ours, theirs = PiecewisePolynomial(c, x), PPoly(c, x)
    places = np.concatenate([rng.uniform(-0.1, x[-1] + 0.1, 9), x]).reshape(1, -1)
    for order in ORDERS:
        assert np.array_equal(ours(places, order), theirs(places, order))
        assert np.array_equal(ours(0.3, order), theirs(0.3, order))
        assert np.array_equal(ours.derivative(order)(places), (theirs.derivative(order) if order else theirs)(places))
    integral, size = theirs.antiderivative()(places), np.abs(c).sum() * (1.0 + x[-1]) ** n
    np.testing.assert_allclose(ours.antiderivative()(places), integral, rtol=1e-12, atol=1e-13 * size)


@given(SEEDS)
def test_splines_through_values_and_end_derivatives_are_those_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, degree = (
        np.cumsum(10.0 ** rng.integers(-3, 1) * rng.uniform(0.1, 1.0, rng.integers(3, 80))),
        int(rng.choice([3, 5])),
    )
    values, given = rng.normal(size=(x.size, 2)), np.arange(degree // 2 + 1, degree)[: degree // 2]
    ends, count = np.repeat(x[[0, -1]], degree + 1).reshape(2, -1), given.size
    slopes = rng.normal(size=(2, count, 2))
    ours = BSpline.through(
        np.concatenate([ends[0], x[1:-1], ends[1]]),
        np.concatenate([ends[0, :count], x, ends[1, :count]]),
        np.concatenate([values[:1], slopes[0], values[1:-1], slopes[1], values[-1:]]),
        degree,
        [0, *given, *[0] * (x.size - 2), *given, 0],
    )
    sides = [list(zip(given.tolist(), side, strict=True)) for side in slopes]
    theirs, places = make_interp_spline(x, values, degree, bc_type=tuple(sides)), np.linspace(*x[[0, -1]], 50)
    np.testing.assert_allclose(ours(places), theirs(places), rtol=1e-9, atol=1e-9 * np.abs(theirs.c).max())
    np.testing.assert_allclose(ours(x), values, rtol=1e-12, atol=1e-13 * np.abs(theirs.c).max())


def test_breakpoints_have_to_fit() -> None:
    with pytest.raises(ValueError, match="breakpoints of shape"):
        PiecewisePolynomial(np.zeros((2, 3, 1)), np.arange(3.0))


@given(SEEDS)
def test_roots_are_those_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    c = rng.normal(size=rng.integers(2, 8))
    c[: rng.integers(0, 2)] = 0.0
    low, high = np.cumsum(rng.uniform(0.1, 2.0, 2))
    found = real_roots(c[:, None], np.array([low]), np.array([high]))
    theirs = PPoly(c[:, None], np.array([low, high])).roots(discontinuity=False, extrapolate=False)
    assert np.unique(found) == pytest.approx(np.unique(theirs[np.isfinite(theirs)]), rel=1e-12, abs=0.0)
    assert np.polyval(c, found - low) == pytest.approx(0.0, abs=1e-9 * (1.0 + np.abs(c).sum() * high ** len(c)))


@pytest.mark.parametrize(
    ("powers", "roots"),
    [
        ([0.0, 0.0, 0.0], []),
        ([5.0], []),
        ([2.0, -1.0], [0.5]),
        ([1.0, 0.0, 1.0], []),
        ([1.0, -2.0, 1.0], [1.0]),
        ([1.0, -3.0, 2.0], [1.0, 2.0]),
        ([1.0, 3.0, 2.0], []),
        ([1.0, -6.0, 11.0, -6.0], [1.0, 2.0, 3.0]),
        ([1.0, 0.0, 0.0, 0.0, -16.0], [2.0]),
    ],
)
def test_roots_between_two_numbers(powers: list[float], roots: list[float]) -> None:
    found = np.unique(real_roots(np.array(powers)[:, None], np.zeros(1), np.full(1, 4.0)))
    assert found == pytest.approx(np.array(roots))


@given(SEEDS)
def test_roots_of_many_are_those_of_each(seed: int) -> None:
    rng = np.random.default_rng(seed)
    c = rng.normal(size=(rng.integers(2, 7), 20)) * (rng.random(20) < 0.9)
    c[: rng.integers(0, len(c)), rng.random(20) < 0.5] = 0.0
    low = rng.uniform(-1.0, 1.0, 20)
    high = low + rng.uniform(0.1, 3.0, 20)
    each = [real_roots(c[:, [column]], low[[column]], high[[column]]) for column in range(20)]
    assert np.array_equal(np.sort(real_roots(c, low, high)), np.sort(np.concatenate(each)))


@given(SEEDS)
def test_splines_have_the_values_and_derivatives_of_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    k = int(rng.integers(1, 6))
    inner = np.sort(rng.uniform(0.0, 1.0, rng.integers(1, 9)))
    inner = np.sort(np.append(inner, inner[: rng.integers(0, 2)]))  # one is there twice
    t = np.concatenate([np.zeros(k + 1), inner, np.ones(k + 1)])
    c = rng.normal(size=(t.size - k - 1, 3))
    ours, theirs = BSpline(t, c, k), SciPySpline(t, c, k)
    places = np.concatenate([rng.uniform(-0.05, 1.05, 20), t])
    for order in range(k + 1):
        assert np.array_equal(ours(places, order), theirs(places, order))
    if k > 1:
        assert np.array_equal(ours.derivative()(places), theirs.derivative()(places))
    assert np.array_equal(ours(0.4), theirs(0.4))


@given(SEEDS)
def test_the_least_value_is_found_as_by_scipy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    powers, low = rng.normal(size=5), rng.uniform(-1.0, 0.0)
    high, resolution = low + rng.uniform(1e-4, 2.0), 10.0 ** rng.uniform(-9.0, -2.0)

    def function(x: float) -> float:
        return float(np.polyval(powers, x) + np.cos(7.0 * x))

    known = minimize_scalar(function, bounds=(low, high), method="bounded", options={"xatol": resolution})
    assert bounded_minimum(function, low, high, resolution) == (float(known.x), float(known.fun))


def test_splines_in_the_least_squares_are_those_of_dense_equations() -> None:
    rng, degree = np.random.default_rng(3), 5
    inner = np.sort(rng.uniform(0.1, 0.9, 30))
    t = np.concatenate([np.zeros(degree + 1), inner, np.ones(degree + 1)])
    at, values = np.linspace(0.0, 1.0, 700), rng.standard_normal((700, 2))
    design = SciPySpline.design_matrix(at, t, degree).toarray()
    right = values[1:-1] - design[1:-1, [0]] * values[0] - design[1:-1, [-1]] * values[-1]
    expected = np.linalg.lstsq(design[1:-1, 1:-1], right, rcond=None)[0]
    ours = BSpline.near(t, at, values, degree)
    np.testing.assert_allclose(ours.c, np.vstack([values[0], expected, values[-1]]), rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(ours(np.array([0.0, 1.0])), values[[0, -1]], atol=1e-14)


@given(SEEDS)
def test_a_root_at_the_end_of_an_interval_hides_no_other(seed: int) -> None:
    """Whether the value at such an end is just above or below zero is rounding, and differs with how it is computed."""
    rng = np.random.default_rng(seed)
    roots = np.sort(rng.uniform(-0.5, 1.0, rng.integers(3, 5)))
    end = abs(roots[-1])
    curve = np.poly(np.append(roots[:-1], end)) * rng.normal() * 10.0 ** rng.uniform(0.0, 5.0)
    found = real_roots(curve[:, None], np.zeros(1), np.array([end]))
    for root in roots[(roots > 1e-3) & (roots < end - 1e-3)]:
        assert np.abs(found - root).min() < 1e-6
