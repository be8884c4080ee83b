"""Paths through waypoints: which points they pass, how smooth they are, how far they leave the straight lines."""

from __future__ import annotations

import numpy as np
import pytest

from problems import InvalidProblem, Trajectory
from problems.base import FloatArray
from problems.motions import JointPath

WAYPOINTS = np.random.default_rng(3).uniform(-2.0, 2.0, (7, 3))


def largest_jump(path: JointPath, derivative: int) -> float:
    inner = path.breakpoints[1:-1]
    before = path.at(inner - 1e-12, derivative)
    return float(np.abs(before - path.at(inner, derivative)).max(initial=0.0))


def test_spline_passes_the_waypoints_smoothly() -> None:
    path = JointPath.through(WAYPOINTS)
    np.testing.assert_allclose(path.at(path.breakpoints), WAYPOINTS, atol=1e-13)
    np.testing.assert_allclose(np.diff(path.breakpoints), np.linalg.norm(np.diff(WAYPOINTS, axis=0), axis=1))
    assert [largest_jump(path, n) < 1e-9 for n in range(5)] == [True] * 5
    np.testing.assert_allclose(path.at(path.breakpoints[[0]], 3), 0.0, atol=1e-11)


def test_spline_through_points_of_a_parabola_is_the_parabola() -> None:
    x = np.array([0.0, 0.3, 1.0, 1.1, 2.0])
    far = 1e-4  # so flat that the chords are as long as the differences of x
    path = JointPath.through(np.column_stack([x, far * x**2]))
    u = np.linspace(0.0, path.breakpoints[-1], 50)
    passed = path.at(u)
    np.testing.assert_allclose(passed[:, 1], far * passed[:, 0] ** 2, atol=1e-9)


def test_two_waypoints_are_a_line() -> None:
    for path in (JointPath.through(WAYPOINTS[:2]), JointPath.blended(WAYPOINTS[:2], 0.1)):
        middle = path.at(path.breakpoints.mean(keepdims=True))
        np.testing.assert_allclose(middle, WAYPOINTS[:2].mean(axis=0, keepdims=True), atol=1e-14)


def test_a_right_angle_uses_its_whole_tolerance() -> None:
    path = JointPath.blended(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), 0.03)
    middle = path.at(np.array([path.breakpoints.mean()]))
    np.testing.assert_allclose(middle, [[1.0 - 0.03, 0.03]], atol=1e-14)


def test_a_line_between_blends_may_vanish_and_waypoints_on_it_need_none() -> None:
    zigzag = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 2.0], [1.0, 2.0], [1.0, 3.0], [1.0, 2.0]])
    path = JointPath.blended(zigzag, 5.0)
    assert path.breakpoints.size - 1 == 6  # two lines at the start, four pieces: blend, blend, blend, line
    assert [largest_jump(path, n) < 1e-6 for n in range(3)] == [True] * 3


def test_path_of_a_motion_is_its_curve() -> None:
    motion = Trajectory(np.array([0.0, 2.0]), np.array([[[1.0]], [[0.5]], [[0.0]]]))
    np.testing.assert_allclose(JointPath.of(motion).at(np.array([0.0, 1.0, 2.0])), motion.at(np.array([0.0, 1.0, 2.0])))


@pytest.mark.parametrize(
    ("waypoints", "message"),
    [
        (WAYPOINTS[:1], "waypoints: a path needs two waypoints at least"),
        (WAYPOINTS[0], "waypoints: a path needs two waypoints at least"),
        (WAYPOINTS[[0, 1, 1, 2]], "waypoints: numbers 2 and 3 are the same"),
        (
            np.where(np.arange(7)[:, None] == 4, np.nan, WAYPOINTS),
            "waypoints: number 5 has a joint angle that is no number",
        ),
    ],
)
def test_waypoints_that_make_no_path(waypoints: FloatArray, message: str) -> None:
    for make in (JointPath.through, lambda points: JointPath.blended(points, 0.1)):
        with pytest.raises(InvalidProblem, match=f"^{message}$"):
            make(waypoints)


@pytest.mark.parametrize("tolerance", [-0.1, np.nan, np.inf])
def test_tolerance_is_a_number_from_zero_on(tolerance: float) -> None:
    with pytest.raises(InvalidProblem, match=r"^tolerance: "):
        JointPath.blended(WAYPOINTS, tolerance)
