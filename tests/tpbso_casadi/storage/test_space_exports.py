"""Tables and exports of motions in space, read back."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.space import sliding_arm, small_arm
from helpers.space_plans import space_plan
from scipy.spatial.transform import Rotation

from tpbso_casadi.storage import EXPORTS, export_motion, write_motion
from tpbso_casadi.storage.exporting import message_yaml
from tpbso_casadi.storage.recomputation import Contradiction
from tpbso_casadi.storage.stored_run import check_table

POSE = ["x", "y", "z", "qx", "qy", "qz", "qw"]


def table(path: Path) -> tuple[list[str], np.ndarray]:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, dtype=np.float64)


def turned_by_hand(theta: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Position and rotation of the small arm's tool with four joints, z y z y, by SciPy."""
    z, y = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    place, turn = np.zeros((len(theta), 3)), Rotation.identity(len(theta))
    for joint, (axis, length) in enumerate(zip((z, y, z, y), (0.3, 0.0, 0.4, 0.0), strict=True)):
        place = place + turn.apply(np.tile(length * z, (len(theta), 1)))
        turn = turn * Rotation.from_rotvec(theta[:, joint : joint + 1] * axis)
    return place + turn.apply(np.tile(0.15 * z, (len(theta), 1))), turn


def test_the_table_has_the_pose_of_the_tool(tmp_path: Path) -> None:
    motion = space_plan().motion
    header, rows = table(write_motion(tmp_path / "trajectory.csv", motion, motion.times))
    assert header == ["t", *(f"{s}{j}" for s in ("q", "qd", "qdd") for j in range(1, 5)), *POSE]
    assert len(rows) >= 200 and rows[0, 0] == 0.0 and rows[-1, 0] == motion.trajectory.duration
    place, turn = turned_by_hand(rows[:, 1:5])
    np.testing.assert_allclose(rows[:, 13:16], place, atol=1e-12)
    quaternions = rows[:, 16:]
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=1e-12)
    assert (Rotation.from_quat(quaternions) * turn.inv()).magnitude().max() < 1e-9
    assert np.abs(np.diff(quaternions, axis=0)).max() < 0.1  # no jumps to the opposite sign


def test_the_sign_of_a_half_turn_does_not_hang_on_rounding() -> None:
    robot = small_arm(2)
    for tiny in (-1e-12, 0.0, 1e-12):
        pose = robot.pose(np.array([[0.0, np.pi + tiny]]))
        assert pose["qy"][0] == pytest.approx(1.0)


def test_an_audit_reads_the_pose_back(tmp_path: Path) -> None:
    motion = space_plan().motion
    path = write_motion(tmp_path / "trajectory.csv", motion, motion.times)
    check_table(path, motion)
    lines = path.read_text().splitlines()
    cells = lines[4].split(",")
    cells[-1] = repr(float(cells[-1]) + 1e-3)
    path.write_text("\n".join([*lines[:4], ",".join(cells), *lines[5:]]) + "\n")
    with pytest.raises(Contradiction, match=r"line 5: qw = "):
        check_table(path, motion)


def test_every_export_holds_the_same_motion(tmp_path: Path) -> None:
    motion = space_plan().motion
    paths = {kind: export_motion(tmp_path, motion, kind, 50.0) for kind in EXPORTS}
    header, rows = table(paths["csv"])
    arrays, message = np.load(paths["npz"]), json.loads(paths["ros-json"].read_text())
    assert header[-7:] == POSE
    parts = [arrays["t"][:, None], arrays["q"], arrays["qd"], arrays["qdd"], arrays["tip"], arrays["quaternion"]]
    np.testing.assert_array_equal(rows, np.hstack(parts))
    names = ["joint_0", "joint_1", "joint_2", "joint_3"]
    assert arrays["joint_names"].tolist() == message["joint_names"] == names
    assert message["header"]["frame_id"] == "base"
    np.testing.assert_array_equal([point["positions"] for point in message["points"]], arrays["q"])
    assert yaml.safe_load(paths["ros-yaml"].read_text()) == message


@pytest.mark.parametrize("name", ["yes", "1e3", "a: b", '"quoted" \\ \t', "Gelenk ä", "- x"])
def test_any_joint_name_survives_yaml(name: str) -> None:
    motion = space_plan().motion
    robot = motion.problem.robot
    joints = (replace(robot.chain.joints[0], name=name), *robot.chain.joints[1:])
    task = replace(motion.problem.task, robot=replace(robot, chain=replace(robot.chain, joints=joints, base_link=name)))
    named = replace(motion, problem=replace(motion.problem, task=task))
    message = yaml.safe_load("".join(message_yaml(named, np.array([0.0, motion.trajectory.duration]))))
    assert message["joint_names"][0] == message["header"]["frame_id"] == name
    numbers = [value for point in message["points"] for key in ("positions", "velocities") for value in point[key]]
    assert all(isinstance(value, float) for value in numbers)  # 1e-17 is no word


def test_joints_that_slide_are_in_metres() -> None:
    assert sliding_arm().joint_units == ("m", "rad", "rad", "rad")
    assert small_arm(2).joint_units == ("rad", "rad")
