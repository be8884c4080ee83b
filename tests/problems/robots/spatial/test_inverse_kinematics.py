"""Postures for a pose: that all are found, that each is right, and that none is found twice."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.urdf import ARM
from scipy.spatial.transform import Rotation

from problems.robots import SpatialArm, built_in, postures, read_urdf
from problems.robots.inverse_kinematics import rotation_vectors


def pose(robot: SpatialArm, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    position, rotation = robot.tool_pose(ca.DM(theta).T)
    return np.array(position).ravel(), np.array(rotation).reshape(3, 3)


def check(robot: SpatialArm, found: np.ndarray, position: np.ndarray, rotation: np.ndarray | None) -> None:
    low, high = np.array(robot.position_limits).T
    assert ((found >= low) & (found <= high)).all()
    for theta in found:
        place, turn = pose(robot, theta)
        assert np.linalg.norm(place - position) <= 1e-9
        if rotation is not None:
            assert np.trace(turn.T @ rotation) >= 3.0 - 1e-12
    for number, theta in enumerate(found):
        assert (np.abs(found[:number] - theta).max(axis=1, initial=0.0) > 1e-3).all() or number == 0


def inside(robot: SpatialArm, seed: int) -> np.ndarray:
    low, high = np.array(robot.position_limits).T
    middle, half = (low + high) / 2, np.minimum((high - low) / 2, np.pi)
    return np.asarray(middle + 0.9 * half * np.random.default_rng(seed).uniform(-1.0, 1.0, len(low)))


@pytest.mark.parametrize("seed", range(4))
def test_a_ur5e_has_eight_postures_at_most_and_the_one_it_came_from_is_among_them(seed: int) -> None:
    robot = built_in("ur5e").arm()
    theta = inside(robot, seed)
    found = postures(robot, *pose(robot, theta), rng=np.random.default_rng(seed), near=theta)
    check(robot, found, *pose(robot, theta))
    assert len(found) in {2, 4, 6, 8}
    assert np.abs(found - theta).max(axis=1).min() < 1e-7


def test_all_eight_of_a_ur5e_are_found() -> None:
    robot = built_in("ur5e").arm()
    theta = np.array([0.4, -1.2, 1.4, -0.8, 1.1, 0.3])
    found = postures(robot, *pose(robot, theta), rng=np.random.default_rng(1))
    assert len(found) == 8
    elbows = np.sort(np.round(np.sin(found[:, 2]), 6))  # the elbow bends either way in pairs
    assert np.allclose(elbows, -elbows[::-1])


@pytest.mark.parametrize("name", ["panda", "iiwa14"])
def test_a_redundant_arm_has_families_of_postures(name: str) -> None:
    robot = built_in(name).arm()
    theta = inside(robot, 5)
    found = postures(robot, *pose(robot, theta), rng=np.random.default_rng(2))
    check(robot, found, *pose(robot, theta))
    assert len(found) > 20


@pytest.mark.parametrize("name", ["panda", "iiwa14"])
def test_where_a_redundant_arm_is_counts_too(name: str) -> None:
    robot = built_in(name).arm()
    theta = inside(robot, 6)
    found = postures(robot, *pose(robot, theta), rng=np.random.default_rng(3), starts=5, near=theta)
    assert np.abs(found[0] - theta).max() < 1e-9


def test_a_position_alone_leaves_the_rotation_free() -> None:
    robot = built_in("panda").arm()
    position, rotation = pose(robot, inside(robot, 6))
    found = postures(robot, position, None, np.random.default_rng(3), starts=50)
    check(robot, found, position, None)
    assert len(found) > 25
    assert any(np.trace(pose(robot, theta)[1].T @ rotation) < 1.0 for theta in found)


def test_a_tool_upside_down_is_no_solution() -> None:
    """Errors by cross products of axes vanish at half a turn; here none of the postures is turned by it."""
    robot = built_in("ur5e").arm()
    position, rotation = pose(robot, np.array([0.4, -1.2, 1.4, -0.8, 1.1, 0.3]))
    flipped = rotation @ np.diag([1.0, -1.0, -1.0])
    for theta in postures(robot, position, flipped, np.random.default_rng(4)):
        assert np.trace(pose(robot, theta)[1].T @ flipped) > 2.9


def test_base_and_tool_are_respected() -> None:
    arm = built_in("ur5e").arm()
    quarter = ((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    robot = replace(arm, base_translation=(1.0, 2.0, 0.5), base_rotation=quarter, tool_translation=(0.0, 0.05, 0.2))
    theta = np.array([0.4, -1.2, 1.4, -0.8, 1.1, 0.3])
    found = postures(robot, *pose(robot, theta), rng=np.random.default_rng(1))
    assert np.abs(found - theta).max(axis=1).min() < 1e-7


def test_turns_are_those_nearest_to_a_posture() -> None:
    robot = built_in("ur5e").arm()
    theta = np.array([0.4, -1.2, 1.4, -0.8, 1.1, 0.3])
    near = np.array([6.0, 0.0, 0.0, 0.0, -5.5, 0.0])
    found = postures(robot, *pose(robot, theta), rng=np.random.default_rng(1), near=near)
    check(robot, found, *pose(robot, theta))
    low, high = np.array(robot.position_limits).T
    for posture in found:
        for joint, angle in enumerate(posture):
            others = [angle + turn for turn in (-4 * np.pi, -2 * np.pi, 2 * np.pi, 4 * np.pi)]
            allowed = [other for other in others if low[joint] <= other <= high[joint]]
            assert all(abs(angle - near[joint]) <= abs(other - near[joint]) + 1e-9 for other in allowed)


def test_joints_stay_within_narrow_limits() -> None:
    ranges = [joint.position or (0.0, 0.0) for joint in built_in("panda").chain.joints]
    robot = built_in("panda").arm(position_limits=[(-0.5, 0.5), *ranges[1:]])
    theta = inside(robot, 7)
    check(robot, postures(robot, *pose(robot, theta), rng=np.random.default_rng(2)), *pose(robot, theta))


def test_what_is_out_of_reach_has_none() -> None:
    robot = built_in("panda").arm()
    assert postures(robot, (3.0, 0.0, 0.0), None, np.random.default_rng(1), starts=20).shape == (0, 7)


def test_a_joint_that_slides() -> None:
    robot = read_urdf(ARM, tip_link="tool0").arm(max_acceleration=1.0)
    found = postures(robot, (-0.5, 0.3, 1.7), None, np.random.default_rng(1), starts=20)
    assert found == pytest.approx(np.array([[np.pi / 2, 0.4]]), abs=1e-9)


def test_the_same_seed_finds_the_same() -> None:
    robot = built_in("panda").arm()
    target = pose(robot, inside(robot, 8))
    first, second = (postures(robot, *target, rng=np.random.default_rng(3), starts=50) for _ in range(2))
    assert np.array_equal(first, second)


def test_rotation_vectors_have_the_angle_for_their_length() -> None:
    vectors = np.random.default_rng(0).normal(size=(50, 3))
    vectors *= (np.linspace(0.0, np.pi, 50) / np.linalg.norm(vectors, axis=1))[:, None]
    found = rotation_vectors(Rotation.from_rotvec(vectors).as_matrix())
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.linspace(0.0, np.pi, 50), abs=1e-9)
    assert found[:-1] == pytest.approx(vectors[:-1], abs=1e-9)
    assert abs(found[-1] @ vectors[-1]) == pytest.approx(np.pi**2, abs=1e-6)  # half a turn: either way round
