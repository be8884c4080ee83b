"""Tables and exports of motions: read back, against SciPy and Lagrange's equations by hand, and audited."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.massive import by_lagrange, massive_motion
from helpers.moving_plans import plane_plan
from helpers.space import small_arm
from helpers.space_plans import space_plan
from scipy.spatial.transform import Rotation

from tpbso_casadi.planning import ControllerRows, JudgedMotion, PlannedMotion
from tpbso_casadi.programs import exporter_at
from tpbso_casadi.programs.ros import message_yaml, ros_message
from tpbso_casadi.scenario import InputFolder, read_joint_rows
from tpbso_casadi.storage import table_of, write_motion
from tpbso_casadi.storage.recomputation import Contradiction
from tpbso_casadi.storage.stored_run import check_table

KINDS = ("ros-json", "ros-yaml", "csv", "npz")
POSE = ["x", "y", "z", "qx", "qy", "qz", "qw"]
MOTIONS: dict[
    str, tuple[Callable[[], JudgedMotion], list[str], float]
] = {  # what stands after the accelerations, and a rate
    "in the plane": (lambda: plane_plan().motion, ["x", "y"], 37.0),
    "with masses": (massive_motion, ["x", "y", "tau1", "tau2"], 100.0),
    "in space": (lambda: space_plan().motion, POSE, 50.0),
}


def planned(motion: JudgedMotion) -> PlannedMotion:
    return PlannedMotion(scenario=None, motion=motion)  # type: ignore[arg-type]


EACH_MOTION = pytest.mark.parametrize(("motion", "last", "rate"), MOTIONS.values(), ids=MOTIONS)


def table(path: Path) -> tuple[list[str], np.ndarray]:
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    return header, np.array(rows, dtype=np.float64)


def rewritten(path: Path, columns: slice, row: int | None = None, change: float = 0.0) -> None:
    """A table with some of its columns, the last of a row changed."""
    with path.open(newline="") as file:
        cells = [line[columns] for line in csv.reader(file)]
    if row is not None:
        cells[row][-1] = repr(float(cells[row][-1]) + change)
    path.write_text("".join(",".join(line) + "\n" for line in cells))


def turned_by_hand(theta: np.ndarray) -> tuple[np.ndarray, Rotation]:
    """Position and rotation of the small arm's tool with four joints, z y z y, by SciPy."""
    z, y = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0, 0.0])
    place, turn = np.zeros((len(theta), 3)), Rotation.identity(len(theta))
    for joint, (axis, length) in enumerate(zip((z, y, z, y), (0.3, 0.0, 0.4, 0.0), strict=True)):
        place = place + turn.apply(np.tile(length * z, (len(theta), 1)))
        turn = turn * Rotation.from_rotvec(theta[:, joint : joint + 1] * axis)
    return place + turn.apply(np.tile(0.15 * z, (len(theta), 1))), turn


@EACH_MOTION
def test_every_export_holds_the_same_motion(
    motion: Callable[[], JudgedMotion], last: list[str], rate: float, tmp_path: Path
) -> None:
    whole = motion()
    joints = range(1, whole.criteria.robot.dof + 1)
    paths = {kind: exporter_at(kind, rate).program(planned(whole)).write(tmp_path)[0] for kind in KINDS}
    header, rows = table(paths["csv"])
    arrays, message = np.load(paths["npz"]), json.loads(paths["ros-json"].read_text())
    assert header == ["t", *(f"{quantity}{joint}" for quantity in ("q", "qd", "qdd") for joint in joints), *last]
    times = arrays["t"]
    np.testing.assert_allclose(np.diff(times)[:-1], 1.0 / rate, rtol=1e-9)
    assert 0.0 < np.diff(times)[-1] <= 1.0 / rate * (1.0 + 1e-9)
    assert times[0] == 0.0 and times[-1] == whole.trajectory.duration
    kinds = [kind for kind in ("q", "qd", "qdd", "tip", "quaternion", "tau") if kind in arrays]
    np.testing.assert_array_equal(rows, np.hstack([times[:, None], *(arrays[kind] for kind in kinds)]))
    np.testing.assert_array_equal(arrays["coefficients"], whole.trajectory.coefficients)
    for order, kind in enumerate(("q", "qd", "qdd")):
        np.testing.assert_array_equal(arrays[kind], whole.trajectory.at(times, order))
    assert ("tau" in arrays) == ("tau1" in last)
    if "tau" in arrays:
        np.testing.assert_allclose(arrays["tau"], by_lagrange(*(arrays[kind] for kind in kinds[:3])), atol=1e-12)
    assert yaml.safe_load(paths["ros-yaml"].read_text()) == message
    assert set(message) == {"header", "joint_names", "points"}
    if last == POSE:
        assert message["joint_names"] == arrays["joint_names"].tolist() == ["joint_0", "joint_1", "joint_2", "joint_3"]
        assert message["header"]["frame_id"] == "base"
    else:
        assert message["joint_names"] == [f"joint_{joint}" for joint in joints]
    for key, kind in (("positions", "q"), ("velocities", "qd"), ("accelerations", "qdd"), ("effort", "tau")):
        expected = arrays[kind] if kind in arrays else np.empty((len(times), 0))
        np.testing.assert_array_equal([point[key] for point in message["points"]], expected)
    stamps = [point["time_from_start"] for point in message["points"]]
    np.testing.assert_allclose([s["sec"] + s["nanosec"] * 1e-9 for s in stamps], times, atol=1e-9)
    assert all(0 <= s["nanosec"] < 1_000_000_000 for s in stamps)


def test_stamps_increase_in_a_ros_message() -> None:
    times = np.array([0.0, 0.9999999999, 1.0000000006])
    stamps = [point["time_from_start"] for point in ros_message(ControllerRows(plane_plan().motion, times))["points"]]
    assert stamps == [{"sec": 0, "nanosec": 0}, {"sec": 1, "nanosec": 0}, {"sec": 1, "nanosec": 1}]


@EACH_MOTION
def test_an_audit_reads_a_table_and_finds_a_changed_cell_and_it_is_a_path_to_be_timed(
    motion: Callable[[], JudgedMotion], last: list[str], rate: float, tmp_path: Path
) -> None:
    whole = motion()
    path = write_motion(tmp_path / "trajectory.csv", whole, whole.times)
    check_table(path, whole)
    np.testing.assert_array_equal(
        read_joint_rows(InputFolder(tmp_path), "trajectory.csv").positions, whole.trajectory.at(whole.times)
    )
    rewritten(path, slice(None), row=4, change=1e-3)
    with pytest.raises(Contradiction, match=rf"line 5: {last[-1]} = "):
        check_table(path, whole)


def test_a_table_from_before_torques_is_audited(tmp_path: Path) -> None:
    motion = massive_motion()
    path = write_motion(tmp_path / "trajectory.csv", motion, motion.times)
    rewritten(path, slice(-2))
    check_table(path, motion)
    rewritten(path, slice(None), row=4, change=1e-3)
    with pytest.raises(Contradiction, match=r"line 5: y = "):
        check_table(path, motion)
    rewritten(write_motion(path, motion, motion.times), slice(-1))  # one torque of two
    with pytest.raises(Contradiction, match="rows of t,q1"):
        check_table(path, motion)


def test_a_table_holds_numbers_as_they_were_written(tmp_path: Path) -> None:
    """Not as Python alone reads them."""
    motion = massive_motion()
    path = write_motion(tmp_path / "trajectory.csv", motion, motion.times)
    lines = path.read_text().splitlines(keepends=True)
    assert lines[1].startswith("0.0,")
    path.write_text("".join([lines[0], lines[1].replace("0.0,", "0_0.0,", 1), *lines[2:]]))
    with pytest.raises(Contradiction, match="not a table of numbers"):
        check_table(path, motion)


def test_the_table_has_the_pose_of_the_tool() -> None:
    motion = space_plan().motion
    _, rows = table_of(motion, motion.times)
    assert len(rows) >= 200 and rows[0, 0] == 0.0 and rows[-1, 0] == motion.trajectory.duration
    place, turn = turned_by_hand(rows[:, 1:5])
    np.testing.assert_allclose(rows[:, 13:16], place, atol=1e-12)
    quaternions = rows[:, 16:]
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, atol=1e-12)
    assert (Rotation.from_quat(quaternions) * turn.inv()).magnitude().max() < 1e-9
    assert np.abs(np.diff(quaternions, axis=0)).max() < 0.1  # no jumps to the opposite sign
    for tiny in (-1e-12, 0.0, 1e-12):  # nor does the sign of a half turn hang on rounding
        assert small_arm(2).tool.coordinates(np.array([[0.0, np.pi + tiny]]))["qy"][0] == pytest.approx(1.0)


def test_friction_does_not_hang_on_the_rounding_of_a_joint_at_rest() -> None:
    motion = massive_motion()
    ends = motion.trajectory.breakpoints[[0, -1]]
    moved = motion.trajectory.coefficients + 0.0
    for speed in (1e-17, -1e-17):  # at the start
        moved[-2, 0] = speed
        nudged = replace(motion, trajectory=replace(motion.trajectory, coefficients=moved.copy()))
        np.testing.assert_allclose(nudged.torques(ends), motion.torques(ends), atol=1e-12)


@pytest.mark.parametrize("name", ["yes", "1e3", "a: b", '"quoted" \\ \t', "Gelenk ä", "- x"])
def test_any_joint_name_survives_yaml(name: str) -> None:
    motion = space_plan().motion
    robot = motion.criteria.robot
    joints = (replace(robot.chain.joints[0], name=name), *robot.chain.joints[1:])
    task = replace(
        motion.criteria.task, robot=replace(robot, chain=replace(robot.chain, joints=joints, base_link=name))
    )
    named = replace(motion, criteria=replace(motion.criteria, task=task))
    message = yaml.safe_load(
        "".join(message_yaml(ros_message(ControllerRows(named, np.array([0.0, motion.trajectory.duration])))))
    )
    assert message["joint_names"][0] == message["header"]["frame_id"] == name
    numbers = [value for point in message["points"] for key in ("positions", "velocities") for value in point[key]]
    assert all(isinstance(value, float) for value in numbers)  # 1e-17 is no word
