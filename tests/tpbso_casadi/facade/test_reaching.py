"""Questions about an arm: where its tool is, which postures reach a pose, how much room they have, maps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracles import universal_robots
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp

TABLE = {"shape": "box", "center": [0.0, 0.0, -0.06], "size": [2.0, 2.0, 0.1]}
DOWN = (1.0, 0.0, 0.0, 0.0)
POSE = tp.Pose((0.4, 0.2, 0.4), DOWN)


def random_postures(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, 6))


@pytest.fixture(scope="module")
def arm() -> tp.StatedRobot:
    return tp.robot("ur5e")


def test_inverse_leads_where_forward_says(arm: tp.StatedRobot) -> None:
    found = arm.inverse(POSE)
    assert isinstance(found, np.ndarray) and found.shape == (8, 6)
    frames = arm.forward(found)
    np.testing.assert_allclose(frames[:, :3, 3], np.tile(POSE.point, (8, 1)), atol=2e-9)
    np.testing.assert_allclose(frames[:, :3, :3], np.tile(Rotation.from_quat(DOWN).as_matrix(), (8, 1, 1)), atol=3e-9)
    np.testing.assert_array_equal(frames[:, 3], np.tile([0.0, 0.0, 0.0, 1.0], (8, 1)))
    assert (np.diff(np.abs(found).max(axis=1)) >= 0.0).all()  # the nearest to the middle first
    np.testing.assert_array_equal(arm.inverse(frames[0]), arm.inverse(frames[:1])[0])


def test_the_closed_form_knows_the_arm_and_every_posture_it_came_from(arm: tp.StatedRobot) -> None:
    theta = random_postures(500, seed=0)
    poses = universal_robots.forward(theta)
    np.testing.assert_allclose(poses, arm.forward(theta), atol=1e-12)
    known = universal_robots.inverse(poses)
    assert max(map(len, known)) == 8
    for posture, pose, each in zip(theta, poses, known, strict=True):
        assert universal_robots.apart(posture[None], each).min() < 1e-9
        np.testing.assert_allclose(universal_robots.forward(each), np.tile(pose, (len(each), 1, 1)), atol=1e-10)


def in_space(count: int) -> np.ndarray:
    """Poses within 1 m of the base along each axis, turned in any way; most are out of reach."""
    rng, poses = np.random.default_rng(1), np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = Rotation.random(count, rng).as_matrix(), rng.uniform(-1.0, 1.0, (count, 3))
    return poses


@pytest.mark.parametrize(
    ("starts", "poses", "most_missed"),
    [
        (64, universal_robots.forward(random_postures(400, seed=2)), 2),
        (400, universal_robots.forward(random_postures(100, seed=3)), 0),
        (64, in_space(200), 0),
    ],
    ids=["random postures", "more starts", "in space"],
)
def test_inverse_finds_the_postures_of_the_closed_form_and_no_others(
    arm: tp.StatedRobot, starts: int, poses: np.ndarray, most_missed: int
) -> None:
    known, found = universal_robots.inverse(poses), arm.inverse(poses, touching=True, starts=starts)
    missed = 0
    for each, others in zip(known, found, strict=True):
        alike = universal_robots.apart(each, others) < 1e-6
        assert (alike.sum(axis=0) == 1).all() and (alike.sum(axis=1) <= 1).all()  # each is one of them, and told once
        missed += len(each) - len(others)
    assert sum(map(len, known)) > 100 and missed <= most_missed


def test_one_posture_is_told_by_numbers_without_an_axis_for_it(arm: tp.StatedRobot) -> None:
    theta = [0.3, -1.2, 1.4, -1.8, -1.5, 0.2]
    assert arm.forward(theta).shape == (4, 4)
    assert arm.jacobian(theta).shape == (6, 6)
    assert arm.manipulability(theta).shape == arm.clearance(theta).shape == ()
    assert arm.forward([theta] * 2).shape == (2, 4, 4)


def test_the_jacobian_is_how_the_pose_changes(arm: tp.StatedRobot) -> None:
    theta, step = np.array([0.3, -1.2, 1.4, -1.8, -1.5, 0.2]), 1e-6
    jacobian = arm.jacobian(theta)
    for joint in range(6):
        after, before = (arm.forward(theta + sign * step * np.eye(6)[joint]) for sign in (1.0, -1.0))
        velocity = (after[:3, 3] - before[:3, 3]) / (2.0 * step)
        turn = Rotation.from_matrix(after[:3, :3] @ before[:3, :3].T).as_rotvec() / (2.0 * step)
        np.testing.assert_allclose(jacobian[:, joint], [*velocity, *turn], atol=1e-8)
    assert float(arm.manipulability(theta)) == pytest.approx(abs(np.linalg.det(jacobian)))


def test_postures_near_one_and_in_all_turns(arm: tp.StatedRobot) -> None:
    known = arm.inverse(POSE)[5]
    first = arm.inverse(POSE, near=known + 0.01)[0]
    np.testing.assert_allclose(first, known, atol=1e-7)
    turned = arm.inverse(POSE, near=known, turns=True)
    assert len(turned) > len(arm.inverse(POSE)) and (np.abs(turned) <= 2.0 * np.pi).all()
    np.testing.assert_allclose(arm.forward(turned), np.tile(arm.forward(known), (len(turned), 1, 1)), atol=1e-8)


def test_what_touches_is_left_out_unless_it_is_asked_for(arm: tp.StatedRobot) -> None:
    low = tp.Pose((0.5, 0.1, 0.05), DOWN)
    every, clear = arm.inverse(low, touching=True), arm.inverse(low, clear_of=[TABLE])
    assert 0 < len(clear) < len(every)
    room = arm.clearance(every, [TABLE])
    assert (arm.clearance(clear, [TABLE]) >= 0.0).all()
    np.testing.assert_array_equal(np.sort(every[room >= 0.0], axis=0), np.sort(clear, axis=0))
    among = arm.among([TABLE])
    np.testing.assert_array_equal(among.inverse(low), clear)


def test_points_leave_the_rotation_free_and_several_poses_have_a_list(arm: tp.StatedRobot) -> None:
    several = arm.inverse([POSE, tp.Pose((3.0, 0.0, 0.0), DOWN)])
    assert isinstance(several, list) and [len(each) for each in several] == [8, 0]
    free = arm.inverse(tp.Pose((0.4, 0.2, 0.4)))
    assert len(free) > 8
    np.testing.assert_allclose(arm.forward(free)[:, :3, 3], np.tile(POSE.point, (len(free), 1)), atol=2e-9)


def test_of_a_cell_one_arm_is_asked_and_the_other_stays() -> None:
    cell = tp.cell({
        "left": tp.robot("ur5e"),
        "right": tp.robot("ur5e", base={"position": [1.2, 0.0, 0.0]}),
    })  # fmt: skip
    near = np.concatenate([[0.3, -1.2, 1.4, -1.8, -1.5, 0.2], [0.1, -1.0, 1.2, -1.7, -1.4, 0.4]])
    found = cell.among(tip="right").inverse(tp.Pose((0.8, 0.3, 0.4), DOWN), near=near)
    assert isinstance(found, np.ndarray) and len(found) > 0
    np.testing.assert_array_equal(found[:, :6], np.tile(near[:6], (len(found), 1)))


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        ({"pose": tp.Pose((0.4, 0.2))}, "pose: x, y, z are needed"),
        ({"pose": np.zeros((3, 3))}, "matrix: a homogeneous matrix is needed"),
        ({"pose": np.full((4, 4), 2.0)}, "matrix: a homogeneous matrix is needed"),
        ({"pose": []}, "matrix"),
        ({"pose": np.zeros((0, 4, 4))}, "pose: there is none"),
        ({"pose": [POSE, tp.Pose((0.4, 0.2, 0.4))]}, "pose: some have a quaternion"),
        ({"pose": tp.Pose((0.4, 0.2, 0.4), DOWN, within=0.1)}, "pose: within and free"),
        ({"pose": POSE, "near": [1.0]}, "postures: 6 finite numbers"),
        ({"pose": POSE, "near": ["one"] * 6}, "postures: numbers are needed"),
        ({"pose": POSE, "clear_of": [{"shape": "bx"}]}, "did you mean box"),
        ({"pose": POSE, "clear_of": 5}, "obstacles: obstacles are needed, not 5"),
        ({"pose": POSE, "starts": 0}, "starts: a whole number from 1"),
        ({"pose": POSE, "starts": 1.5}, "starts: a whole number from 1"),
    ],
)
def test_what_cannot_be_asked_is_said_in_one_line(arm: tp.StatedRobot, asked: dict[str, Any], reason: str) -> None:
    with pytest.raises(tp.ScenarioError, match=reason) as told:
        arm.inverse(asked.pop("pose"), **asked)
    assert "\n" not in str(told.value)


def test_of_no_postures_there_is_nothing_to_tell(arm: tp.StatedRobot) -> None:
    none = arm.inverse(tp.Pose((3.0, 0.0, 0.0), DOWN), turns=True)
    assert isinstance(none, np.ndarray) and none.shape == (0, 6)
    shapes = [getattr(arm, name)(none).shape for name in ("forward", "jacobian", "manipulability", "clearance")]
    assert shapes == [(0, 4, 4), (0, 6, 6), (0,), (0,)]


def test_arms_in_the_plane_and_moving_obstacles_are_refused() -> None:
    with pytest.raises(tp.ScenarioError, match="an arm in space is needed"):
        tp.robot([1.0, 1.0], max_speed=1.0, max_acceleration=1.0).forward([0.0, 0.0])
    moving = tp.MovingObstacle(
        tp.Box(center=(0.5, 0.0, 0.5), size=(0.1, 0.1, 0.1)), tp.ConstantVelocity((0.1, 0.0, 0.0))
    )
    with pytest.raises(tp.ScenarioError, match="moves"):
        tp.robot("ur5e").among([moving])


def test_a_map_tells_of_each_pose_what_inverse_tells(arm: tp.StatedRobot, tmp_path: Path) -> None:
    points = np.array([[0.5, 0.1, 0.05], [0.4, 0.2, 0.4], [2.0, 0.0, 0.0]])
    rotations = Rotation.random(4, rng=1).as_matrix()
    found = tp.reach(arm, points, rotations, [TABLE], starts=64)
    for place, point in enumerate(points):
        for way, rotation in enumerate(rotations):
            frame = np.eye(4)
            frame[:3, :3], frame[:3, 3] = rotation, point
            clear = arm.inverse(frame, clear_of=[TABLE])
            assert found.count[place, way] == len(clear)
            assert found.clear[place, way] == (len(clear) > 0)
            assert found.reached[place, way] == (len(arm.inverse(frame, touching=True)) > 0)
            best = arm.manipulability(clear).max() if len(clear) else 0.0
            assert found.manipulability[place, way] == pytest.approx(best, rel=1e-6)
    np.testing.assert_array_equal(found.share, found.clear.mean(axis=1))
    other = tp.reach(arm, points, rotations, [TABLE], starts=64, workers=1)
    np.testing.assert_array_equal(found.count, other.count)
    found.save(tmp_path / "map.npz")
    again = tp.read_reach(tmp_path / "map.npz")
    np.testing.assert_array_equal(again.manipulability, found.manipulability)
    found.show(tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 5_000


def test_maps_that_cannot_be_are_refused(arm: tp.StatedRobot, tmp_path: Path) -> None:
    turns = np.eye(3)[None]
    for points, rotations, reason in (
        (np.zeros((2, 2)), turns, "points: an array"),
        (np.full((1, 3), np.nan), turns, "points: an array"),
        (np.zeros((1, 3)), 2.0 * turns, "rotations: one is no rotation"),
        (np.zeros((1, 3)), np.zeros((1, 2, 2)), "rotations: matrices"),
    ):
        with pytest.raises(tp.ScenarioError, match=reason):
            tp.reach(arm, points, rotations)
    for workers in (0, "two"):
        with pytest.raises(tp.ScenarioError, match="workers"):
            tp.reach(arm, np.zeros((1, 3)), turns, workers=workers)  # type: ignore[arg-type]
    found = tp.reach(arm, np.array([[0.4, 0.2, 0.4]]), turns)
    with pytest.raises(tp.OutputError, match=r"\.npz"):
        found.save(tmp_path / "map.txt")
    with pytest.raises(tp.OutputError, match="png, pdf, svg"):
        found.show(tmp_path / "map.txt")
    (tmp_path / "other.npz").write_text("no map")
    with pytest.raises(tp.OutputError, match="no map"):
        tp.read_reach(tmp_path / "other.npz")


def test_the_nearest_posture_is_at_the_pose_or_as_near_as_the_arm_is_long(arm: tp.StatedRobot) -> None:
    among = arm.among()
    np.testing.assert_allclose(among.forward(among.nearest(POSE))[:3, 3], POSE.point, atol=1e-9)
    up = among.nearest(tp.Pose((0.0, 0.0, 3.0)))
    highest = arm.forward([0.0, -np.pi / 2, 0.0, 0.0, np.pi / 2, 0.0])[2, 3]  # upright, the tool 0.0996 m beside
    assert highest - 1e-6 <= among.forward(up)[2, 3] <= 3.0
    with pytest.raises(tp.InvalidProblem, match="pose: one is needed"):
        among.nearest([POSE, POSE])


@pytest.mark.parametrize("quaternion", [(1.0, 1.0, 0.0, 0.0), (0.0,) * 4, (np.nan, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0)])
def test_a_quaternion_has_length_one(arm: tp.StatedRobot, quaternion: tuple[float, ...]) -> None:
    with pytest.raises(tp.ScenarioError, match="is no quaternion x, y, z, w of length 1"):
        arm.inverse(tp.Pose((0.4, 0.2, 0.4), quaternion))  # type: ignore[arg-type]
