"""Postures for a pose, all of them and once each, and Newton steps onto a position or a pose."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.urdf import ARM

from problems.robots import FixedFrame, SpatialArm, built_in, postures, project, read_urdf
from tests.helpers.space import sliding_arm, small_arm

BENT = np.array([0.4, -1.2, 1.4, -0.8, 1.1, 0.3])  # of a UR5e


def pose(robot: SpatialArm, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    position, rotation = robot.tool.pose(ca.DM(theta).T)
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


def solved(robot: SpatialArm, theta: np.ndarray, **more: Any) -> np.ndarray:
    """The postures at the pose of one, each of them right."""
    found = postures(robot, *pose(robot, theta), rng=np.random.default_rng(1), **more)
    check(robot, found, *pose(robot, theta))
    return found


@pytest.fixture(scope="module")
def ur5e() -> SpatialArm:
    return built_in("ur5e").arm()


@pytest.fixture(scope="module")
def panda() -> SpatialArm:
    return built_in("panda").arm()


def test_all_eight_of_a_ur5e_are_found(ur5e: SpatialArm) -> None:
    found = solved(ur5e, BENT)
    assert len(found) == 8
    elbows = np.sort(np.round(np.sin(found[:, 2]), 6))  # the elbow bends either way in pairs
    assert np.allclose(elbows, -elbows[::-1])


@pytest.mark.parametrize("name", ["panda", pytest.param("iiwa14", marks=pytest.mark.slow)])
def test_a_redundant_arm_has_families_of_postures_and_where_it_is_counts(name: str) -> None:
    robot = built_in(name).arm()
    theta = inside(robot, 6)
    assert len(solved(robot, theta)) > 20
    assert np.abs(solved(robot, theta, starts=5, near=theta)[0] - theta).max() < 1e-9


def test_a_position_alone_leaves_the_rotation_free_and_the_same_seed_finds_the_same(panda: SpatialArm) -> None:
    position, rotation = pose(panda, inside(panda, 6))
    found, again = (postures(panda, position, None, np.random.default_rng(3), starts=50) for _ in range(2))
    assert np.array_equal(found, again)
    check(panda, found, position, None)
    assert len(found) > 25
    assert any(np.trace(pose(panda, theta)[1].T @ rotation) < 1.0 for theta in found)


def test_a_tool_upside_down_is_no_solution(ur5e: SpatialArm) -> None:
    """Errors by cross products of axes vanish at half a turn; here none of the postures is turned by it."""
    theta = np.array([0.4, -1.0, 1.8, -0.8, 1.1, 0.3])  # where the arm reaches both
    position, rotation = pose(ur5e, theta)
    flipped = rotation @ np.diag([1.0, -1.0, -1.0])
    found = postures(ur5e, position, flipped, np.random.default_rng(4), near=theta)
    assert len(found) > 0
    check(ur5e, found, position, flipped)


def test_base_and_tool_are_respected(ur5e: SpatialArm) -> None:
    base = FixedFrame(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (1.0, 2.0, 0.5))
    robot = replace(ur5e, base_frame=base, tool_in_tip=FixedFrame(translation=(0.0, 0.05, 0.2)))
    assert np.abs(solved(robot, BENT) - BENT).max(axis=1).min() < 1e-7


def test_turns_are_those_nearest_to_a_posture(ur5e: SpatialArm) -> None:
    near = np.array([6.0, 0.0, 0.0, 0.0, -5.5, 0.0])
    low, high = np.array(ur5e.position_limits).T
    for posture in solved(ur5e, BENT, near=near):
        for joint, angle in enumerate(posture):
            others = [angle + turn for turn in (-4 * np.pi, -2 * np.pi, 2 * np.pi, 4 * np.pi)]
            allowed = [other for other in others if low[joint] <= other <= high[joint]]
            assert all(abs(angle - near[joint]) <= abs(other - near[joint]) + 1e-9 for other in allowed)


def test_joints_stay_within_narrow_limits() -> None:
    ranges = [joint.position or (0.0, 0.0) for joint in built_in("panda").chain.joints]
    robot = built_in("panda").arm(position_limits=[(-0.5, 0.5), *ranges[1:]])
    assert len(solved(robot, inside(robot, 7))) > 0


def test_what_is_out_of_reach_has_none(panda: SpatialArm) -> None:
    assert postures(panda, (3.0, 0.0, 0.0), None, np.random.default_rng(1), starts=20).shape == (0, 7)


def test_a_joint_that_slides() -> None:
    robot = read_urdf(ARM, tip_link="tool0").arm(max_acceleration=1.0)
    found = postures(robot, (-0.5, 0.3, 1.7), None, np.random.default_rng(1), starts=20)
    assert found == pytest.approx(np.array([[np.pi / 2, 0.4]]), abs=1e-9)


ARMS = [small_arm(), small_arm(6), sliding_arm()]


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("robot", ARMS[:2])
def test_five_steps_reach_what_is_near(robot: SpatialArm, turned: bool) -> None:
    rng = np.random.default_rng(2)
    for _ in range(10):
        there = rng.uniform(0.4, 1.2, robot.dof)  # bent, away from singular postures
        position, rotation = pose(robot, there)
        start = ca.DM(there + rng.uniform(-0.07, 0.07, robot.dof)).T
        found = project(robot, start, ca.DM(position), ca.DM(rotation) if turned else None, 5).full().ravel()
        position_found, rotation_found = pose(robot, found)
        assert position_found == pytest.approx(position, abs=1e-9)
        assert not turned or rotation_found == pytest.approx(rotation, abs=1e-9)


def test_limits_are_kept_and_no_step_is_long() -> None:
    robot = small_arm(position_limits=((-0.55, 0.55),) * 7)
    start = ca.DM(np.full(7, 0.5)).T
    for steps in (1, 20):
        found = project(robot, start, ca.DM([-3.0, 2.0, -5.0]), None, steps).full()
        assert np.all(np.abs(found) <= 0.55)
    free = small_arm(position_limits=None)
    moved = project(free, start, ca.DM([-3.0, 2.0, -5.0]), None, 1) - start
    assert np.abs(moved.full()).max() <= 0.6 + 1e-12


def test_a_posture_at_a_limit_can_be_reached_where_it_is_known() -> None:
    robot = small_arm(6)
    known = np.array([0.3, 0.8, 2.8, -0.9, 0.4, 0.7])  # the third joint at its limit
    position, rotation = pose(robot, known)
    start = ca.DM(known + 0.05 * np.array([1.0, -1.0, -1.0, 1.0, -1.0, 1.0])).T

    def missed(with_known: bool) -> float:
        given = ca.DM(known).T if with_known else None
        found = project(robot, start, ca.DM(position), ca.DM(rotation), 10, 0.01, given).full().ravel()
        assert np.all(np.abs(found) <= 2.8)
        return float(np.abs(pose(robot, found)[0] - position).max())

    assert missed(with_known=True) < 1e-9
    assert missed(with_known=False) > 1e-4
