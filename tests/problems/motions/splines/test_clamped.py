"""Clamped splines: lines, ends, the local form, the exact pieces; against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from problems.base import as_array
from problems.motions.splines import ClampedSpline

UNEVEN = np.array([0.0, 0.1, 0.15, 0.5, 0.9, 1.0])
SPLINE = ClampedSpline(UNEVEN)
POINTS = np.random.default_rng(0).normal(size=(SPLINE.size, 2))
U = np.linspace(0.0, 1.0, 41)


def test_greville_abscissae_by_hand() -> None:
    """Means of three consecutive knots: 0 0 0 .1, 0 .1 .15, ..."""
    assert SPLINE.size == 8
    expected = [0.0, 0.1 / 3, 0.25 / 3, 0.25, 1.55 / 3, 0.8, 2.9 / 3, 1.0]
    assert SPLINE.greville == pytest.approx(np.array(expected), abs=1e-15)


def test_control_points_on_a_line_make_that_line() -> None:
    line = np.column_stack([1.0 + 2.0 * SPLINE.greville, -SPLINE.greville])
    assert SPLINE.curve(line)(U) == pytest.approx(np.column_stack([1.0 + 2.0 * U, -U]), abs=1e-14)


@pytest.mark.parametrize("order", range(4))
def test_all_forms_are_the_same_spline(order: int) -> None:
    knots = np.concatenate([[0.0] * 3, UNEVEN, [1.0] * 3])
    inside = U[:-1]
    expected = BSpline(knots, POINTS, 3)(inside, order)
    scale = 1e-12 * np.abs(expected).max()
    assert as_array(SPLINE.sampling_matrix(inside, order)) @ POINTS == pytest.approx(expected, abs=scale)
    assert SPLINE.curve(POINTS)(inside, order) == pytest.approx(expected, abs=scale)
    basis, first = SPLINE.local_basis(inside, order)
    local = np.einsum("ni,nik->nk", basis, POINTS[first[:, None] + np.arange(4)])
    assert local == pytest.approx(expected, abs=scale)


def test_it_begins_and_ends_at_its_control_points() -> None:
    assert (SPLINE.curve(POINTS)(np.array([0.0])) == POINTS[:1]).all()
    assert SPLINE.curve(POINTS)(np.array([1.0])) == pytest.approx(POINTS[-1:], abs=1e-14)
    assert (SPLINE.curve(POINTS).x == UNEVEN).all()
