"""Steps onto a pose of the tool, against the robot's own kinematics and NumPy's steps."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.core_robots import ROBOTS, postures, robot_of
from scipy.spatial.transform import Rotation

from problems.base import FloatArray
from problems.core import steps_of
from problems.robots import SpatialArm, built_in
from problems.robots import postures as found_by
from problems.tasks import Pose

SOLVED = 1e-9  # m and rad

each_robot = pytest.mark.parametrize("name", ROBOTS)
turned_or_not = pytest.mark.parametrize("turned", [True, False], ids=["pose", "point"])


def target(robot: SpatialArm, seed: int) -> tuple[FloatArray, FloatArray]:
    position, rotation = robot.tool.at(postures(robot, np.random.default_rng(seed), 1))
    return position[0], rotation[0]


def wide(robot: SpatialArm) -> tuple[FloatArray, FloatArray]:
    return np.full(robot.dof, -3.0), np.full(robot.dof, 3.0)


@each_robot
@turned_or_not
def test_what_is_said_to_be_missing_is_what_the_tool_lacks(name: str, turned: bool) -> None:
    robot = robot_of(name)
    position, rotation = target(robot, 1)
    starts = postures(robot, np.random.default_rng(2), 83)
    found, missing = steps_of(robot)(starts, position, rotation if turned else None, wide(robot), 40)
    places, turns = robot.tool.at(found)
    away = np.linalg.norm(places - position, axis=1)
    angle = Rotation.from_matrix(rotation @ turns.transpose(0, 2, 1)).magnitude() if turned else 0.0
    near = missing < 1e-3
    np.testing.assert_allclose(missing[near], np.hypot(away, angle)[near], rtol=1e-4, atol=1e-12)
    assert (np.hypot(away, angle)[~near] > 1e-4).all()
    assert (found >= -3.0).all() and (found <= 3.0).all()
    if robot.dof >= 6:
        assert (missing <= SOLVED).any()


@pytest.mark.parametrize("model", ["ur5e", "panda"])
@turned_or_not
def test_the_same_postures_are_found_as_by_numpy(model: str, turned: bool) -> None:
    robot = built_in(model).arm()
    theta = np.array([0.4, -1.2, 1.4, -1.8, 1.1, 1.3, 0.2])[: robot.dof]
    position, rotation = (part[0] for part in robot.tool.at(theta[None]))
    kept = rotation if turned else None
    one, other = (
        found_by(robot, position, kept, np.random.default_rng(3), 60, theta, steps) for steps in (None, steps_of(robot))
    )
    assert len(one) > 2 and abs(len(one) - len(other)) <= 0.1 * len(one)
    np.testing.assert_allclose(other[0], one[0], atol=1e-7)
    if robot.dof == 6 and turned:  # finitely many: each is found by both
        apart = np.abs((one[:, None] - other[None] + np.pi) % (2.0 * np.pi) - np.pi).max(axis=2)
        assert (apart.min(axis=1) < 1e-6).all() and (apart.min(axis=0) < 1e-6).all()


def test_no_joint_leaves_its_bounds_and_others_do_its_part() -> None:
    robot = built_in("panda").arm()
    theta = np.array([0.3, 0.4, -0.2, -1.9, 0.3, 2.0, 0.5])
    position, rotation = (part[0] for part in robot.tool.at(theta[None]))
    low, high = theta - 0.5, theta + 0.5
    low[2] = high[2] = theta[2]  # fixed
    starts = np.random.default_rng(4).uniform(low, high, (50, 7))
    found, missing = steps_of(robot)(starts, position, rotation, (low, high), 60)
    assert (found >= low).all() and (found <= high).all()
    assert (missing <= SOLVED).mean() > 0.9


def test_a_tool_upside_down_is_turned_and_a_place_out_of_reach_is_not_reached() -> None:
    robot = built_in("panda").arm()
    theta = np.array([[0.3, 0.4, -0.2, -1.9, 0.3, 2.0, 0.5]])
    position, rotation = (part[0] for part in robot.tool.at(theta))
    over = rotation @ np.diag([1.0, -1.0, -1.0])
    starts = np.random.default_rng(5).uniform(*np.array(robot.position_limits).T, (100, 7))
    _, missing = steps_of(robot)(starts, position, over, wide(robot), 80)
    assert (missing <= SOLVED).any()
    found, missing = steps_of(robot)(starts, np.array([9.0, 0.0, 0.0]), None, wide(robot), 80)
    assert np.isfinite(found).all() and (missing > 7.0).all()


def test_what_counts_is_the_arm_and_its_tool_alone() -> None:
    robot = built_in("panda").arm()
    other = replace(robot, margin=0.1, spheres=())
    assert steps_of(robot) is steps_of(other)
    assert other.geometry == robot.geometry


def test_postures_of_a_pose_are_those_that_its_function_gives() -> None:
    robot = built_in("panda").arm()
    theta = np.array([0.3, 0.4, -0.2, -1.9, 0.3, 2.0, 0.5])
    position, rotation = robot.tool.at(theta[None])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation[0], position[0]
    place = Pose.from_matrix(matrix).on_branch(theta)
    chosen = np.random.default_rng(6).uniform(-1.0, 1.0, (40, 7))
    found, reached = place.postures(robot, chosen)
    x = ca.SX.sym("x", 7)
    posture = ca.Function("posture", [x], [place.posture(robot, x, 1.0, None)[0].T])
    expected = np.array(posture(chosen.T)).T
    expected_reached = np.abs(np.array(place.miss(robot, ca.DM(expected)))).max(axis=1) <= place.tolerance(robot)
    assert reached.sum() > 20 and (reached == expected_reached).mean() > 0.9
    both = reached & expected_reached
    np.testing.assert_allclose(found[both], expected[both], atol=1e-4)
    assert np.abs(np.array(place.miss(robot, ca.DM(found[reached])))).max() <= 1e-9
