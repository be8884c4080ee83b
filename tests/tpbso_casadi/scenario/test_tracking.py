"""``tracking_error`` of a [robot] table: what it states, what is planned and said of it."""

from __future__ import annotations

import numpy as np

import tpbso_casadi as tp
from problems.robots import SpatialArm, TrackingError
from problems.scene import Box

START, GOAL = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785], [1.2, -0.3, 0.1, -2.0, 0.1, 1.6, 0.5]
POST = Box(center=(0.45, 0.3, 0.4), size=(0.1, 0.1, 0.8))


def arm(error: object) -> SpatialArm:
    model = tp.robot("panda", tracking_error=error).model
    assert isinstance(model, SpatialArm)
    return model


def test_one_number_is_a_constant_of_every_joint_and_takes_from_the_ranges() -> None:
    exact = tp.robot("panda").model
    found = arm(0.01)
    assert found.tracking == TrackingError((0.01,) * 7, (0.0,) * 7, (0.0,) * 7)
    assert exact.limits.position is not None and found.limits.position is not None
    shrunk = np.array(exact.limits.position) - np.array(found.limits.position)
    np.testing.assert_allclose(shrunk, np.tile([-0.01, 0.01], (7, 1)), atol=1e-12)
    assert found.assumed == "within a tracking error of 0.01 rad" and exact.assumed == ""


def test_what_holds_for_the_plan_alone_is_listed() -> None:
    start = tp.Joints((0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785))
    goal, slow = tp.Joints((1.2, -0.3, 0.1, -2.0, 0.1, 1.6, 0.5)), [tp.ToolSpeed(max=1.5)]
    exact, loose = (
        tp.plan(tp.robot("panda", tracking_error=error), start=start, goal=goal, constraints=slow)
        for error in (None, 0.01)
    )
    assert not any("off the plan" in line for line in exact.not_judged)
    (line,) = (line for line in loose.not_judged if "off the plan" in line)
    limits = {"speed", "acceleration", "jerk", "torque", "tool speed", "and the path of the tool"}
    assert set(line.removesuffix(", of joints that are off the plan").split(", ")) == limits


def test_shares_of_speed_and_acceleration_count_at_their_limits_for_ranges() -> None:
    found = arm({"constant": 0.001, "speed": [0.001] * 7, "acceleration": 0.0001})
    assert found.tracking is not None and found.limits.position is not None and found.position_limits is not None
    most = 0.001 + 0.001 * np.array(found.max_speed) + 0.0001 * np.array(found.max_acceleration)
    np.testing.assert_allclose([low for low, _ in found.limits.position], np.array(found.position_limits)[:, 0] + most)
    allowed = found.tracking.at(np.full((1, 7), -2.0), np.full((1, 7), 3.0))
    np.testing.assert_allclose(allowed, 0.0033)


def test_a_plan_keeps_the_room_and_says_so() -> None:
    robot = tp.robot("panda", tracking_error={"constant": 0.004, "speed": 0.002})
    plan = tp.plan(robot, start=START, goal=GOAL, obstacles=[POST])
    assert plan.motion.feasible and "certified within a tracking error of" in repr(plan)
    trajectory, model, rng = plan.trajectory, robot.model, np.random.default_rng(0)
    assert isinstance(model, SpatialArm) and model.tracking is not None
    times = trajectory.times(400)
    allowed = model.tracking.at(trajectory.at(times, 1), trajectory.at(times, 2))
    spheres = np.array([sphere.radius for sphere in model.spheres])
    for _ in range(10):
        signs = rng.choice([-1.0, 1.0], (times.size, 7))
        centers = np.stack([np.asarray(place) for place in model.positions(trajectory.at(times) + signs * allowed)])
        away = np.abs(centers[8:-1] - np.array(POST.center)) - np.array(POST.size) / 2.0
        assert (np.linalg.norm(np.maximum(away, 0.0), axis=2) > spheres[:, None]).all()
