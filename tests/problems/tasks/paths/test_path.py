"""Paths: shapes, corners, resampling, and what cannot be a path."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from problems import InvalidProblem, Path, closed_curve, pentagram


def test_pentagram_has_its_five_corners_on_the_circle() -> None:
    star = pentagram((0.5, -0.25), 1.2, 0.3, 50)
    corners = star.array[[0, *star.corners]]
    assert len(star.points) == 50
    assert len(star.corners) == 4
    assert np.hypot(*(corners - [0.5, -0.25]).T) == pytest.approx(1.2)
    assert star.points[0] == star.points[-1]
    sides = np.linalg.norm(np.diff(np.vstack([corners, corners[:1]]), axis=0), axis=1)
    assert sides == pytest.approx(2.0 * 1.2 * np.sin(2.0 * np.pi / 5.0))


def test_closed_curve_is_smooth_evenly_spaced_and_keeps_its_radius() -> None:
    curve = closed_curve((0.0, 0.0), 1.5, 0.0, 4, 0.2, 60)
    rho = np.hypot(*curve.array.T)
    steps = np.linalg.norm(np.diff(curve.array, axis=0), axis=1)
    assert curve.corners == ()
    assert rho.max() <= 1.5 * 1.2 + 1e-12
    assert rho.min() >= 1.5 * 0.8 - 1e-12
    assert steps.max() / steps.min() < 1.05


@pytest.mark.parametrize("count", [6, 7, 23, 50, 200])
def test_resampling_keeps_ends_corners_and_count(count: int) -> None:
    star = pentagram((0.0, 0.0), 1.0, 0.0, 400).resampled(count)
    assert len(star.points) == count
    assert np.hypot(*star.array[list(star.corners)].T) == pytest.approx(1.0)
    assert np.hypot(*star.array[[0, -1]].T) == pytest.approx(1.0)


def test_resampling_spreads_points_evenly_between_corners() -> None:
    corner = Path.through([(0.0, 0.0), (1.0, 0.0), (1.0, 3.0)]).resampled(9)
    assert corner.corners == (2,)
    assert np.linalg.norm(np.diff(corner.array, axis=0), axis=1) == pytest.approx(0.5)


def test_turn_of_45_degrees_is_a_corner_and_less_is_not() -> None:
    def bent(degrees: float) -> Path:
        angle = np.radians(degrees)
        return Path.through([(0.0, 0.0), (1.0, 0.0), (1.0 + np.cos(angle), np.sin(angle))])

    assert bent(46.0).corners == (1,)
    assert bent(-46.0).corners == (1,)
    assert bent(44.0).corners == ()


def test_closing_a_path_repeats_the_first_point_once() -> None:
    triangle = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)]
    assert Path.through(triangle, closed=True).points == (*triangle, triangle[0])
    assert Path.through([*triangle, triangle[0]], closed=True).points == (*triangle, triangle[0])


@given(arrays(np.int64, (5, 2), elements=st.integers(-40, 40), unique=True), st.integers(7, 60))
def test_resampled_points_lie_on_the_given_way(tenths: np.ndarray, count: int) -> None:
    points = tenths / 10.0
    path = Path.through(points)
    for x, y in path.resampled(count).points:
        distances = []
        for (ax, ay), (bx, by) in pairwise(points):
            dx, dy = bx - ax, by - ay
            square = max(dx * dx + dy * dy, 1e-300)
            share = np.clip(((x - ax) * dx + (y - ay) * dy) / square, 0.0, 1.0)
            distances.append(np.hypot(x - ax - share * dx, y - ay - share * dy))
        assert min(distances) < 1e-9


@pytest.mark.parametrize(
    ("points", "reason"),
    [
        ([(0.0, 0.0)], "at least 2 points"),
        ([(0.0, 0.0), (0.0, 0.0)], r"points\[0\] and points\[1\] are the same"),
        ([(0.0, 0.0), (1.0, float("nan"))], r"points\[1\]"),
        ([(0.0, 0.0), (1.0, float("inf"))], r"points\[1\]"),
    ],
)
def test_what_is_not_a_path(points: list[tuple[float, float]], reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        Path(tuple(points))


def test_too_few_points_for_the_corners() -> None:
    with pytest.raises(InvalidProblem, match="4 points cannot hold both ends and 4 corners"):
        pentagram((0.0, 0.0), 1.0, 0.0, 4)
