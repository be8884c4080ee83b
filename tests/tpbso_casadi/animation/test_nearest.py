"""The closest two in the plane against dense samples, and against what verdicts say."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.moving_plans import plane_plan
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.limits import Proximity
from tpbso_casadi.animation.player_data import closest_of, nearest

PLACE = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
SHARES = np.linspace(0.0, 1.0, 201)[:, None]


@settings(max_examples=40)
@given(PLACE, PLACE, st.lists(PLACE, min_size=2, max_size=5))
def test_no_two_samples_are_nearer(start, end, corners) -> None:
    near, far = nearest(np.array([start]), np.array([end]), np.array([corners]))
    gap = np.linalg.norm(far - near)
    one = np.array(start) + SHARES * (np.array(end) - start)
    lines = zip(np.array(corners)[:-1], np.array(corners)[1:], strict=True)
    two = np.concatenate([first + SHARES * (last - first) for first, last in lines])
    apart = np.linalg.norm(one[:, None] - two[None], axis=2)
    assert gap <= apart.min() + 1e-12
    assert gap >= apart.min() - 0.03  # half the distance between two samples, on both lines
    assert np.linalg.norm(one - near, axis=1).min() < 0.015 and np.linalg.norm(two - far, axis=1).min() < 0.015


@pytest.mark.parametrize(
    ("end", "near", "far"),
    [
        ((3.0, 1.0), (2.0, 1.0), (2.0, 1.0)),  # crosses
        ((1.0, 1.0), (1.0, 1.0), (2.0, 1.0)),  # ends before
        ((0.0, 5.0), (0.0, 2.0), (2.0, 2.0)),  # runs alongside: some two points, as far apart as all
    ],
)
def test_by_hand(end, near, far) -> None:
    found = nearest(np.array([[0.0, 1.0]]), np.array([end]), np.array([[[2.0, 0.0], [2.0, 2.0]]]))
    assert np.linalg.norm(found[1] - found[0]) == pytest.approx(np.linalg.norm(np.subtract(far, near)))
    if end[0]:
        np.testing.assert_allclose(np.array(found)[:, 0], [near, far], atol=1e-12)


def test_the_closest_two_are_as_far_apart_as_verdicts_say() -> None:
    plan = plane_plan()
    times = np.linspace(0.0, plan.trajectory.duration, 9)
    theta = plan.trajectory.at(times)
    closest = closest_of(plan.motion.problem, theta, times)
    assert closest is not None
    limits = [limit for limit in plan.motion.problem.limits if isinstance(limit, Proximity)]
    pairs = [pair.without_growth() for limit in limits for pair in limit.pairs]
    for row, time in enumerate(times):
        frames = plan.criteria.robot.positions(ca.DM(theta[row : row + 1]))
        apart = [pair.distance(frames, ca.DM(time)) for pair in pairs]
        assert closest.distances[row] == pytest.approx(min(apart), abs=2e-5)  # an ellipse is drawn with 360 corners
        assert str(closest.pairs[closest.numbers[row]]) == str(pairs[int(np.argmin(apart))])
        near, far = closest.points[row]
        assert np.linalg.norm(far - near) == pytest.approx(abs(min(apart)), abs=2e-5)
