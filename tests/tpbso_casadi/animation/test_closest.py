"""The closest two of a robot and what surrounds it: against dense samples, by hand, and against what verdicts say."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.moving_plans import IN_SPACE, moving_space_plan, plane_plan
from helpers.space_plans import SOLIDS, space_plan
from hypothesis import example, given, settings
from hypothesis import strategies as st

from problems.limits import Clearance, Proximity
from problems.scene.moving import MovingObstacle
from tpbso_casadi.animation.player_data import closest_of, nearest

PLACE = st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
SHARES = np.linspace(0.0, 1.0, 201)[:, None]


@settings(max_examples=15)
@example((0.0, 1.0), (3.0, 1.0), [(2.0, 0.0), (2.0, 2.0)])  # crosses
@example((0.0, 1.0), (0.0, 5.0), [(2.0, 0.0), (2.0, 2.0)])  # runs alongside
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


def test_the_closest_two_are_as_far_apart_as_verdicts_say() -> None:
    plan = plane_plan()
    times = np.linspace(0.0, plan.trajectory.duration, 9)
    theta = plan.trajectory.at(times)
    closest = closest_of(plan.motion.criteria, theta, times)
    assert closest is not None
    limits = [limit for limit in plan.motion.criteria.limits if isinstance(limit, Proximity)]
    pairs = [pair.without_growth() for limit in limits for pair in limit.pairs]
    for row, time in enumerate(times):
        frames = plan.criteria.robot.positions(ca.DM(theta[row : row + 1]))
        apart = [pair.distance(frames, ca.DM(time)) for pair in pairs]
        assert closest.distances[row] == pytest.approx(min(apart), abs=2e-5)  # an ellipse is drawn with 360 corners
        assert str(closest.pairs[closest.numbers[row]]) == str(pairs[int(np.argmin(apart))])
        near, far = closest.points[row]
        assert np.linalg.norm(far - near) == pytest.approx(abs(min(apart)), abs=2e-5)


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: type(solid).__name__)
def test_the_closest_points_lie_on_both_surfaces(solid) -> None:
    plan = space_plan()
    robot = plan.criteria.robot
    times = np.linspace(0.0, plan.trajectory.duration, 7)
    theta = plan.trajectory.at(times)
    criteria = replace(plan.motion.criteria, limits=(Clearance.for_robot(robot, (solid,)),))
    closest = closest_of(criteria, theta, times)
    assert closest is not None
    frames = [np.array(position) for position in robot.positions(ca.DM(theta))]
    balls = [pair.body for pair in criteria.limits[0].pairs]  # those that can reach it
    expected = [
        min(solid.distance_of(*(tuple(frames[ball.start][row]),) * 2) - ball.radius for ball in balls)
        for row in range(7)
    ]
    assert closest.distances == pytest.approx(expected, abs=1e-12)
    for row, (near, far) in enumerate(closest.points):
        body = closest.pairs[closest.numbers[row]].body
        center = frames[body.start][row]
        assert np.linalg.norm(near - center) == pytest.approx(body.radius)
        assert np.linalg.norm(far - near) == pytest.approx(closest.distances[row])
        assert float(solid.point_clearance(ca.DM([far]))) == pytest.approx(0.0, abs=2e-3 * np.linalg.norm(far - center))


def test_two_balls_of_the_robot_that_are_the_closest() -> None:
    plan = space_plan(obstacles=False)
    theta = plan.trajectory.at(np.zeros(1))
    closest = closest_of(plan.criteria, theta, np.zeros(1))
    assert closest is not None and [str(pair) for pair in closest.pairs] == ["foot, link_4"]
    positions = plan.criteria.robot.positions(ca.DM(theta))
    centers = [np.array(positions[5 + k])[0] for k in (0, 3)]
    away = centers[1] - centers[0]
    length = np.linalg.norm(away)
    assert closest.distances == pytest.approx([length - 0.13])
    ends = [centers[0] + 0.08 * away / length, centers[1] - 0.05 * away / length]
    np.testing.assert_allclose(closest.points[0], ends)


def test_the_closest_two_are_measured_at_their_time() -> None:
    plan = moving_space_plan()
    robot, ball = plan.criteria.robot, IN_SPACE[1]
    grown = MovingObstacle(ball.still, ball.motion, margin_rate=0.3)  # what is kept is no part of the distance
    criteria = replace(plan.motion.criteria, limits=(Clearance.for_robot(robot, (grown,)),))
    times = np.linspace(0.0, plan.trajectory.duration, 9)
    closest = closest_of(criteria, plan.trajectory.at(times), times)
    assert closest is not None
    frames = [np.array(position) for position in robot.positions(ca.DM(plan.trajectory.at(times)))]
    moved = [body for body in robot.bodies.each if body.name != "foot"]
    for row, time in enumerate(times):
        center = np.array([1.0, 0.9, 0.9]) + time * np.array([-0.8, -0.3, 0.0])
        apart = min(np.linalg.norm(frames[body.start][row] - center) - body.radius - 0.15 for body in moved)
        assert closest.distances[row] == pytest.approx(apart, abs=1e-9)
        near, far = closest.points[row]
        assert np.linalg.norm(far - center) == pytest.approx(0.15, abs=1e-9)
        assert np.linalg.norm(far - near) == pytest.approx(abs(apart), abs=1e-9)
