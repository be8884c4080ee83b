"""Smooth paths near rows: within the tolerance everywhere, through few of them, from the first to the last."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.base import InvalidProblem
from problems.timing import distinct_rows, fitted_path


def recording(seed: int, count: int) -> np.ndarray:
    """A quick motion there and back, as a controller would log it: rows are near each other at its ends."""
    u = np.linspace(0.0, 1.0, count)[:, None]
    course = 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5
    shapes = np.random.default_rng(seed).uniform(-0.5, 0.5, (3, 4))
    return np.asarray(sum(np.sin((number + 1) * np.pi * course) * shape for number, shape in enumerate(shapes)))


@given(st.integers(0, 1_000), st.sampled_from([1e-2, 1e-3, 1e-4]))
@settings(max_examples=8, deadline=None)
def test_a_fitted_path_is_near_the_lines_between_all_rows(seed: int, tolerance: float) -> None:
    rows = distinct_rows(np.round(recording(seed, 1_500), 9))
    path = fitted_path(rows, tolerance)
    np.testing.assert_allclose(path.at(path.breakpoints[[0, -1]]), rows[[0, -1]], atol=1e-12)
    assert path.breakpoints.size < 120
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rows, axis=0), axis=1))])
    u = np.linspace(0.0, path.breakpoints[-1], 20_001)
    lines = np.column_stack([np.interp(u, lengths, column) for column in rows.T])
    assert np.abs(path.at(u) - lines).max() <= tolerance


def test_noise_is_evened_out() -> None:
    exact = recording(0, 3_000)
    noisy = exact + 1e-4 * np.random.default_rng(0).standard_normal(exact.shape)
    path = fitted_path(noisy, 1e-3)
    assert path.breakpoints.size < 80  # a spline through rows needs several hundred
    knots = path.at(path.breakpoints)
    nearest = np.abs(knots[:, None] - exact[None]).max(axis=2).min(axis=1)
    assert nearest[1:-1].max() < 3e-4


def test_rows_that_no_smooth_path_is_near_are_refused() -> None:
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    with pytest.raises(
        InvalidProblem, match="tolerance: a smooth path through the rows leaves the lines between them by"
    ):
        fitted_path(corner, 1e-3)
    with pytest.raises(InvalidProblem, match="tolerance: 0 is not a positive number, in rad"):
        fitted_path(corner, 0.0)


@pytest.mark.parametrize("rows", [[[0.0], [0.0], [1.0], [1.0]], [[0.0], [1e-12], [1.0], [1.0 - 1e-12]]])
def test_rows_that_repeat_the_one_before_are_one(rows: list[list[float]]) -> None:
    np.testing.assert_array_equal(distinct_rows(np.array(rows)), [rows[0], rows[-1]])
