"""Splines with corners: natural between them, by SciPy's own splines; exact pieces; local bases."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from problems.families.traced.motion import CornerSpline

KNOTS = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.62, 0.8, 0.9, 1.0])
CORNERS: list[tuple[int, ...]] = [(), (3,), (3, 4), (1, 7)]


def angles() -> np.ndarray:
    return np.random.default_rng(3).normal(size=(KNOTS.size, 2))


@pytest.mark.parametrize("corners", CORNERS, ids=str)
def test_each_stretch_is_the_natural_spline(corners: tuple[int, ...]) -> None:
    spline, given = CornerSpline(KNOTS, corners), angles()
    curve = spline.curve(np.asarray(spline.coefficients(ca.DM(given))))
    for first, last in spline.stretches:
        expected = CubicSpline(KNOTS[first : last + 1], given[first : last + 1], bc_type="natural")
        inside = np.linspace(KNOTS[first], KNOTS[last], 50)[1:-1]
        for order in range(4):
            scale = 1.0 + np.abs(expected(inside, order)).max()
            assert np.abs(curve(inside, order) - expected(inside, order)).max() <= 1e-10 * scale


@pytest.mark.parametrize("corners", CORNERS, ids=str)
@pytest.mark.parametrize("order", [0, 1, 2])
def test_four_local_functions_are_the_whole_basis(corners: tuple[int, ...], order: int) -> None:
    spline, u = CornerSpline(KNOTS, corners), np.linspace(0.0, 1.0, 57)
    coefficients = np.asarray(spline.coefficients(ca.DM(angles())))
    values, first = spline.local_basis(u, order)
    local = np.einsum("nb,nbk->nk", values, coefficients[first[:, None] + np.arange(4)])
    expected = spline.curve(coefficients)(u, order)
    assert np.abs(local - expected).max() <= 1e-11 * np.abs(expected).max()
