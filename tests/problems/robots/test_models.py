"""The robots that are built in, against figures of their data sheets; orientations, against SciPy."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from problems import InvalidProblem
from problems.robots import BUILT_IN, Orientations, SpatialArm, angles_between, built_in, unit_quaternions
from problems.robots.transform import from_angles, matrix_of, quaternions_of, snapped, turn_of, turned_by


def tool(robot: SpatialArm, *theta: float) -> np.ndarray:
    return np.array(robot.tool.position(ca.DM([theta]))).ravel()


def test_panda() -> None:
    """Franka's Denavit-Hartenberg parameters at zero: 88 mm ahead, the flange 107 mm below the wrist."""
    robot = built_in("panda", tip_link="panda_link8").arm()
    assert tool(robot, *[0.0] * 7) == pytest.approx([0.088, 0.0, 0.333 + 0.316 + 0.384 - 0.107])
    assert robot.max_speed == (2.175,) * 4 + (2.61,) * 3
    assert robot.max_acceleration == (15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0)
    assert robot.max_jerk == (7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0)
    assert [joint.effort for joint in robot.chain.joints] == [87.0] * 4 + [12.0] * 3


def test_the_panda_has_its_hand() -> None:
    hand, flange = built_in("panda").arm(), built_in("panda", tip_link="panda_link8").arm()
    ready = (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)
    assert tool(flange, *ready)[2] - tool(hand, *ready)[2] == pytest.approx(0.1034, abs=1e-3)  # it points down
    carried = built_in("panda").chain.joints[6].inertia
    assert carried is not None
    assert carried.mass == pytest.approx(0.735522 + 0.73 + 2 * 0.015)


def test_ur5e() -> None:
    """Universal Robots' Denavit-Hartenberg parameters at zero; the controller's base is turned by half a turn."""
    robot = built_in("ur5e").arm()
    assert tool(robot, *[0.0] * 6) == pytest.approx([0.425 + 0.3922, 0.1333 + 0.0996, 0.1625 - 0.0997])
    assert tool(robot, 0.0, -np.pi / 2, 0.0, -np.pi / 2, 0.0, 0.0)[2] == pytest.approx(0.1625 + 0.425 + 0.3922 + 0.0997)
    assert sum(joint.inertia.mass for joint in robot.chain.joints if joint.inertia) == pytest.approx(17.7)


def test_iiwa14() -> None:
    """The data sheet's 1,306 mm from floor to flange, upright; 400 mm from shoulder and elbow to the wrist."""
    robot = built_in("iiwa14").arm()
    assert tool(robot, *[0.0] * 7) == pytest.approx([0.0, 0.0, 1.306])
    bent = tool(robot, 0.0, 0.0, 0.0, -np.pi / 2, 0.0, 0.0, 0.0)
    assert np.abs(bent) == pytest.approx([0.4 + 0.126, 0.0, 0.36 + 0.42])
    assert np.degrees(robot.max_speed) == pytest.approx([85, 85, 100, 75, 130, 135, 135])


@pytest.mark.parametrize("name", BUILT_IN)
def test_every_body_has_spheres(name: str) -> None:
    robot = built_in(name).arm()
    assert {sphere.link for sphere in robot.spheres} == set(range(robot.dof + 1))


def test_a_robot_may_be_cut_short() -> None:
    description = built_in("panda", tip_link="panda_link3")
    assert [joint.name for joint in description.chain.joints] == ["panda_joint1", "panda_joint2", "panda_joint3"]
    assert description.max_acceleration == (15.0, 7.5, 10.0)
    assert len(description.spheres) == len(built_in("panda").spheres)  # the rest is carried along, locked
    finger = built_in("panda", tip_link="panda_leftfinger")
    assert (len(finger.chain.joints), finger.max_acceleration) == (8, None)


@pytest.mark.parametrize(
    ("name", "tip", "message"),
    [
        ("puma", None, "model: 'puma' is not built in; there are panda, ur5e, iiwa14"),
        ("panda", "hook", "no link 'hook'"),
    ],
)
def test_what_is_not_built_in(name: str, tip: str | None, message: str) -> None:
    with pytest.raises(InvalidProblem, match=message):
        built_in(name, tip_link=tip)


def test_orientations_are_those_of_scipy_to_the_bit() -> None:
    turns = Rotation.random(60, rng=np.random.default_rng(4))
    angles = [*np.random.default_rng(5).uniform(-np.pi, np.pi, (60, 3)).tolist(), [np.pi / 2, 0.0, -np.pi]]
    for quaternion in turns.as_quat():
        assert matrix_of(quaternion) == snapped(Rotation.from_quat(quaternion).as_matrix())
    for each in angles:
        assert from_angles(each) == snapped(Rotation.from_euler("xyz", each).as_matrix())
    matrices = turns.as_matrix()
    found, expected = quaternions_of(matrices.reshape(-1, 9)), Rotation.from_matrix(matrices).as_quat()
    assert np.array_equal(found, np.where(np.sum(found * expected, axis=1, keepdims=True) < 0.0, -expected, expected))


def test_between_points_it_turns_evenly_about_one_axis() -> None:
    quaternions = Rotation.from_rotvec([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.5, 0.4, -1.0]]).as_quat()
    orientations = Orientations(quaternions)
    known, wanted = np.array([0.0, 2.0, 3.0]), np.array([0.0, 0.3, 1.9, 2.0, 2.5, 3.0])
    expected = Slerp(known, Rotation.from_quat(quaternions))(wanted)
    found = Rotation.from_quat(orientations.between(known, wanted))
    assert (expected.inv() * found).magnitude() == pytest.approx(0.0, abs=1e-12)
    assert orientations.angles[0] == pytest.approx(0.5)
    assert orientations.axes[0] == pytest.approx([1.0, 0.0, 0.0])


def test_where_it_does_not_turn_there_is_an_axis_all_the_same() -> None:
    still = Orientations(np.array([[0.0, 0.0, 0.0, 1.0]] * 3))
    assert still.angles.tolist() == [0.0, 0.0]
    assert np.linalg.norm(still.axes, axis=1).tolist() == [1.0, 1.0]


def test_a_quaternion_and_its_negative_are_the_same_orientation() -> None:
    assert Orientations(np.array([[0.0, 0.0, 0.6, 0.8], [0.0, 0.0, -0.6, -0.8]])).angles == pytest.approx([0.0])


@pytest.mark.parametrize("angle", [1e-9, 1e-3, 1.0, 3.0, np.pi])
def test_angles_between_matrices_are_exact_for_small_and_for_half_turns(angle: float) -> None:
    turned = Rotation.from_rotvec(angle * np.array([[0.36, 0.48, 0.8]])).as_matrix()
    assert angles_between(np.eye(3)[None], turned) == pytest.approx([angle], rel=1e-7)


def test_lengths_are_made_one_and_what_is_no_orientation_is_named() -> None:
    assert unit_quaternions([[0.0, 0.0, 0.0, 1.0005]]).tolist() == [[0.0, 0.0, 0.0, 1.0]]
    with pytest.raises(InvalidProblem, match=r"points\[1\]: its quaternion .* is not of length 1"):
        unit_quaternions([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    with pytest.raises(InvalidProblem, match=r"points\[0\] and points\[1\]: the tool turns by 3.142 rad"):
        unit_quaternions([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]])


def test_turns_and_rotations_are_those_of_scipy() -> None:
    turns = np.random.default_rng(4).normal(size=(200, 3)) * np.geomspace(1e-9, 1.7, 200)[:, None]
    turns = np.vstack([np.zeros(3), turns / np.maximum(1.0, np.linalg.norm(turns, axis=1) / 3.14)[:, None]])
    rotations = turned_by(turns)
    np.testing.assert_allclose(rotations, Rotation.from_rotvec(turns).as_matrix(), atol=1e-15)
    np.testing.assert_allclose([turn_of(each) for each in rotations], turns, atol=1e-14)
