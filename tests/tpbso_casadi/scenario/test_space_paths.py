"""Paths in space in scenario files: points and poses, in lists and in CSV files; what is wrong; a plan of one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal
from helpers.scenes import toml
from oracles.space import away_from_path, tool_poses

from problems.tasks import SpaceTracing
from tpbso_casadi import parse_scenario
from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.scenario import read_scenario

LINK = '<link name="link_{0}"/>'
JOINT = (
    '<joint name="joint_{0}" type="revolute"><parent link="link_{0}"/><child link="link_{1}"/>'
    '<origin xyz="0 0 {2}"/><axis xyz="{3}"/><limit lower="-2.8" upper="2.8" velocity="2" effort="10"/></joint>'
)
LENGTHS = (0.3, 0.0, 0.4, 0.0, 0.35, 0.0, 0.0)
AXES = ("0 0 1", "0 1 0")
URDF = (
    '<robot name="small arm">'
    + "".join(LINK.format(i) for i in range(9))
    + "".join(JOINT.format(i, i + 1, length, AXES[i % 2]) for i, length in enumerate(LENGTHS))
    + '<joint name="flange" type="fixed"><parent link="link_7"/><child link="link_8"/><origin xyz="0 0 0.15"/></joint>'
    "</robot>"
)
LINE = [[0.4, 0.0, 0.5], [0.4, 0.1, 0.5], [0.4, 0.1, 0.6]]
DOWN = [1.0, 0.0, 0.0, 0.0]
POSES = [point + DOWN for point in LINE]


@pytest.fixture
def folder(in_an_empty_folder: None) -> Path:
    """The working folder, with the robot in it."""
    Path("small.urdf").write_text(URDF)
    return Path()


def file(**task: Any) -> str:
    stated = {"kind": "path", "points": "way.csv", "accuracy": 0.005} | task
    robot = {"urdf": "small.urdf", "max_acceleration": 10.0}
    return toml(robot=robot, model={"self_collision": False}, task=stated)


def content(**task: Any) -> dict[str, Any]:
    stated = {"kind": "path", "points": LINE, "accuracy": 0.005} | task
    robot = {"urdf": "small.urdf", "urdf_text": URDF, "max_acceleration": 10.0}
    return {"robot": robot, "model": {"self_collision": False}, "task": stated}


def task_of(content: dict[str, Any]) -> SpaceTracing:
    task = parse_scenario(content).problem().criteria.task
    assert isinstance(task, SpaceTracing)
    return task


def test_points_and_poses_of_a_list() -> None:
    assert task_of(content()).path.orientations is None
    task = task_of(content(points=POSES, angular_accuracy=0.02, closed=True, count=9))
    assert task.angular_accuracy == 0.02
    assert len(task.path.points) == len(task.path.quaternions) == 9
    assert task.path.points[0] == task.path.points[-1] == (0.4, 0.0, 0.5)


def test_angular_accuracy_in_degrees() -> None:
    stated = content(points=POSES, angular_accuracy=1.0) | {"unit": "deg"}
    assert task_of(stated).angular_accuracy == pytest.approx(np.radians(1.0))


@pytest.mark.parametrize("heading", ["", "X, Y, Z, QX, QY, QZ, QW\n\n"])
def test_poses_are_read_from_beside_the_scenario(folder: Path, heading: str) -> None:
    (folder / "mine.toml").write_text(file(angular_accuracy=0.01))
    (folder / "way.csv").write_text(heading + "\n".join(",".join(map(str, pose)) for pose in POSES))
    scenario = read_scenario(folder / "mine.toml")
    assert scenario.task.points == [tuple(pose) for pose in POSES]
    assert parse_scenario(scenario.table()) == scenario


def test_a_plan_is_written_audited_and_near_the_path(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "mine.toml").write_text(file(angular_accuracy=0.05))
    (folder / "way.csv").write_text("\n".join(",".join(map(str, pose)) for pose in POSES))
    search = ["--solver", "pso", "--evaluations", "20", "--polish", "--no-retime", "--backend", "vm"]
    out = folder / "run"
    assert solve.main([str(folder / "mine.toml"), *search, "--no-plots", "--out", str(out)]) == 0
    assert "not polished: this task has no nonlinear program" in capsys.readouterr().out
    rows = np.loadtxt(out / "trajectory.csv", delimiter=",", skiprows=1)
    distance, angle = away_from_path(tool_poses(rows[:, 1:8]), np.array(LINE), np.array([DOWN] * 3))
    assert distance.max() <= 0.005
    assert angle.max() <= 0.05
    assert json.loads((out / "result.json").read_text()).get("polish") is None
    assert audit.main([str(out)]) == 0
    assert "there is no nonlinear program to judge by" in capsys.readouterr().out


def test_what_needs_a_nonlinear_program_is_refused_in_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "mine.toml").write_text(file())
    (folder / "way.csv").write_text("\n".join(",".join(map(str, point)) for point in LINE))
    for options in (["--solver", "ipopt"], ["--within", "2"]):
        error = refusal(capsys, solve.main, "mine.toml", *options, "--no-plots", "--out", "run")
        assert error.endswith("this task has no nonlinear program to descend")
