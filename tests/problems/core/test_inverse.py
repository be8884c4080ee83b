"""Postures of many poses at once, against NumPy's steps and the arm's own kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.core_robots import ROBOTS, postures, robot_of
from hypothesis import given
from hypothesis import strategies as st

from problems.core import steps_of
from problems.robots import JointTurns, NewtonSteps, Poses, SpatialArm, built_in, manipulability, spread_shares

pytestmark = pytest.mark.usefixtures("compiled")
TURN = 2.0 * np.pi


def poses_of(robot: SpatialArm, count: int, turned: bool = True) -> Poses:
    """Poses of random postures."""
    positions, rotations = robot.tool.at(postures(robot, np.random.default_rng(count), count))
    return Poses(positions, rotations if turned else None)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("turned", [True, False], ids=["pose", "point"])
def test_the_core_finds_the_postures_of_numpy_in_their_order(name: str, turned: bool) -> None:
    robot = robot_of(name)
    turns, poses = JointTurns.of(robot), poses_of(robot, 3, turned)
    low, high = np.where(np.isfinite(turns.low), turns.low, -3.0), np.where(np.isfinite(turns.high), turns.high, 3.0)
    starts = low + spread_shares(19, robot.dof) * (high - low)
    ours, theirs = (
        steps.inverse(poses, starts, turns, turns.middle) for steps in (steps_of(robot), NewtonSteps(robot))
    )
    assert np.abs(ours.counts - theirs.counts).sum() <= 1  # one that arrives within rounding of the tolerance
    for one, other in zip(ours.each, theirs.each, strict=True):
        if len(one) == len(other):
            np.testing.assert_allclose(one, other, atol=1e-6)
    positions, rotations = robot.tool.at(ours.theta)
    each = np.repeat(np.arange(len(poses)), ours.counts)
    np.testing.assert_allclose(positions, poses.positions[each], atol=2e-9)
    if poses.rotations is not None:
        np.testing.assert_allclose(rotations, poses.rotations[each], atol=3e-9)
    assert turns.are_kept(ours.theta).all()


def test_parts_of_many_poses_are_what_each_has_alone() -> None:
    robot = built_in("ur5e").arm()
    turns, poses = JointTurns.of(robot), poses_of(robot, 21)
    starts, steps = turns.within(spread_shares(13, robot.dof)), steps_of(robot)
    whole = steps.inverse(poses, starts, turns, turns.middle)
    for number, theta in enumerate(whole.each):
        alone = steps.inverse(poses.part(slice(number, number + 1)), starts, turns, turns.middle)
        np.testing.assert_array_equal(alone.theta, theta)


@pytest.mark.parametrize("name", ["ur5e", "panda"])
def test_manipulability_is_the_product_of_the_singular_values(name: str) -> None:
    robot = built_in(name).arm()
    turns = JointTurns.of(robot)
    for turned, rows in ((True, 6), (False, 3)):
        found = steps_of(robot).inverse(
            poses_of(robot, 4, turned), turns.within(spread_shares(16, robot.dof)), turns, turns.middle
        )
        _, jacobians, _ = NewtonSteps(robot).error(found.theta, np.zeros(3), np.eye(3))
        values = np.linalg.svd(jacobians[:, :rows], compute_uv=False)
        np.testing.assert_allclose(found.manipulability, values.prod(axis=1), rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(manipulability(jacobians[:, :rows]), values.prod(axis=1), rtol=1e-6, atol=1e-9)


def test_a_pose_out_of_reach_has_none_by_either() -> None:
    robot = built_in("panda").arm()
    turns, poses = JointTurns.of(robot), Poses(np.array([[3.0, 0.0, 0.0]]), np.eye(3)[None])
    for steps in (steps_of(robot), NewtonSteps(robot)):
        found = steps.inverse(poses, turns.within(spread_shares(5, robot.dof)), turns, turns.middle)
        assert found.theta.shape == (0, 7) and found.counts.tolist() == [0] and found.manipulability.shape == (0,)


@given(st.lists(st.floats(-20.0, 20.0), min_size=6, max_size=6))
def test_all_turns_of_a_posture_are_within_the_ranges_and_the_nearest_is_among_them(values: list[float]) -> None:
    turns, near = JointTurns.of(built_in("ur5e").arm()), np.array(values)
    theta = turns.nearest(np.clip(near, -3.0, 3.0)[None], np.zeros(6))[0]
    found = turns.all_of(theta)
    assert turns.are_kept(found).all()
    assert len(np.unique(found, axis=0)) == len(found)
    whole = (found - theta) / TURN
    np.testing.assert_allclose(whole, np.rint(whole), atol=1e-9)
    nearest = turns.nearest(theta[None], near)[0]
    assert np.abs(found - nearest).max(axis=1).min() < 1e-9


@pytest.mark.parametrize("dof", [1, 3, 7])
def test_starts_fill_their_cube_evenly_and_are_always_the_same(dof: int) -> None:
    shares = spread_shares(256, dof)
    assert shares.shape == (256, dof) and (shares >= 0.0).all() and (shares < 1.0).all()
    np.testing.assert_array_equal(shares, spread_shares(300, dof)[:256])
    counts = np.apply_along_axis(lambda part: np.histogram(part, 8, (0.0, 1.0))[0], 0, shares)
    assert counts.min() >= 25 and counts.max() <= 39  # of 32
