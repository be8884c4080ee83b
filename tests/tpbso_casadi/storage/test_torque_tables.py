"""Torques in tables and exports: against Lagrange's equations by hand, read back, and where masses are not known."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.massive import by_lagrange, massive_arm, massive_motion
from helpers.space_plans import space_plan

from tpbso_casadi.planning import Motion
from tpbso_casadi.scenario import InputFolder, read_joint_rows
from tpbso_casadi.storage import EXPORTS, export_motion, table_of, write_motion
from tpbso_casadi.storage.recomputation import Contradiction
from tpbso_casadi.storage.stored_run import check_table


def rewritten(path: Path, columns: slice, row: int | None = None, change: float = 0.0) -> None:
    """A table with some of its columns, the last of a row changed."""
    with path.open(newline="") as file:
        cells = [line[columns] for line in csv.reader(file)]
    if row is not None:
        cells[row][-1] = repr(float(cells[row][-1]) + change)
    path.write_text("".join(",".join(line) + "\n" for line in cells))


def of_an_arm_without_masses() -> Motion:
    motion = massive_motion()
    robot = massive_arm(link_masses=None, max_torque=None, viscous_friction=None, coulomb_friction=None)
    task = replace(motion.problem.task, robot=robot)
    return replace(motion, problem=replace(motion.problem, task=task))


def test_torques_stand_after_everything_else() -> None:
    motion = massive_motion()
    header, rows = table_of(motion, motion.times)
    assert header == ["t", "q1", "q2", "qd1", "qd2", "qdd1", "qdd2", "x", "y", "tau1", "tau2"]
    np.testing.assert_allclose(rows[:, 9:], by_lagrange(rows[:, 1:3], rows[:, 3:5], rows[:, 5:7]), atol=1e-12)


def test_an_arm_without_masses_has_none(tmp_path: Path) -> None:
    motion = of_an_arm_without_masses()
    header, rows = table_of(motion, motion.times)
    assert header[-2:] == ["x", "y"] and rows.shape[1] == 9
    message = json.loads(export_motion(tmp_path, motion, "ros-json").read_text())
    assert all(point["effort"] == [] for point in message["points"])
    assert "tau" not in np.load(export_motion(tmp_path, motion, "npz"))


def test_every_export_has_the_same_torques(tmp_path: Path) -> None:
    motion = massive_motion()
    paths = {kind: export_motion(tmp_path, motion, kind, 50.0) for kind in EXPORTS}
    arrays, message = np.load(paths["npz"]), json.loads(paths["ros-json"].read_text())
    expected = by_lagrange(arrays["q"], arrays["qd"], arrays["qdd"])
    np.testing.assert_allclose(arrays["tau"], expected, atol=1e-12)
    np.testing.assert_array_equal([point["effort"] for point in message["points"]], arrays["tau"])
    assert yaml.safe_load(paths["ros-yaml"].read_text()) == message
    assert np.loadtxt(paths["csv"], delimiter=",", skiprows=1)[:, -2:] == pytest.approx(arrays["tau"], abs=0.0)


def test_an_audit_reads_torques_and_finds_a_changed_one(tmp_path: Path) -> None:
    motion = massive_motion()
    path = write_motion(tmp_path / "trajectory.csv", motion, motion.times)
    check_table(path, motion)
    rewritten(path, slice(None), row=4, change=1e-3)
    with pytest.raises(Contradiction, match=r"line 5: tau2 = "):
        check_table(path, motion)


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


def test_friction_does_not_hang_on_the_rounding_of_a_joint_at_rest() -> None:
    motion = massive_motion()
    ends = motion.trajectory.breakpoints[[0, -1]]
    still = motion.torques(ends)
    moved = motion.trajectory.coefficients + 0.0
    for speed in (1e-17, -1e-17):  # at the start
        moved[-2, 0] = speed
        nudged = replace(motion, trajectory=replace(motion.trajectory, coefficients=moved.copy()))
        np.testing.assert_allclose(nudged.torques(ends), still, atol=1e-12)


@pytest.mark.parametrize("motion", [massive_motion(), space_plan().motion, of_an_arm_without_masses()])
def test_a_table_of_a_run_is_a_path_to_be_timed(tmp_path: Path, motion: Motion) -> None:
    write_motion(tmp_path / "trajectory.csv", motion, motion.times)
    rows = read_joint_rows(InputFolder(tmp_path), "trajectory.csv")
    np.testing.assert_array_equal(rows, motion.trajectory.at(motion.times))
