"""Problems as scenarios: what is asked is what the files state; runs that fail are records; the command line."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.motion_bench_maker.__main__ import main
from benchmarks.motion_bench_maker.ours import Question, judge_all, may_touch, runs_of
from benchmarks.motion_bench_maker.problem_file import read_problems
from benchmarks.motion_bench_maker.records import Records
from benchmarks.motion_bench_maker.setting import Setting
from benchmarks.peers.space.command import compare_in_space
from problems.scene.solids.box import Box
from problems.scene.solids.cylinder import Cylinder
from tpbso_casadi.campaign import parse_solvers
from tpbso_casadi.campaign.run import Outcome
from tpbso_casadi.campaign.store import Store


def test_a_scenario_is_the_problem(setting: Setting, folder: Path) -> None:
    (problem,) = read_problems(folder / "small.jsonl")
    stated = Question(setting, "tool0", to_pose=False).scenario(problem).problem()
    robot = stated.robot
    assert robot.limits.speed == (2.0, 3.0, 3.0)
    assert (robot.limits.acceleration, robot.limits.jerk) == ((5.0,) * 3, (50.0,) * 3)
    assert robot.limits.position == ((-3.0, 3.0), (-3.0, 3.0), (-2.0, 2.0))
    box, cylinder = stated.task.obstacles
    assert isinstance(box, Box)
    assert (tuple(box.center), tuple(box.size)) == ((0.0, 0.0, 3.0), (1.0, 1.0, 1.0))
    assert isinstance(cylinder, Cylinder)
    assert (cylinder.radius, cylinder.length) == (0.5, 1.0)


def test_links_that_are_near_or_meet_at_an_end_may_touch(setting: Setting, folder: Path) -> None:
    (problem,) = read_problems(folder / "small.jsonl")
    assert may_touch(setting.checker(problem)) == [("finger", "tool0")]
    (folder / "small.toml").write_text((folder / "small.toml").read_text().replace("radius = 0.05", "radius = 2.5"))
    wide = Setting(setting.urdf, setting.spheres_file, (5.0,), (50.0,))
    assert may_touch(wide.checker(problem)) == [("finger", "tool0"), ("foot", "tool0")]


def test_the_goal_may_be_the_pose_at_its_joints(setting: Setting, folder: Path) -> None:
    (problem,) = read_problems(folder / "small.jsonl")
    goal = Question(setting, "tool0", to_pose=True).scenario(problem).model_dump(mode="json")["task"]["goal"]
    pose = setting.kinematics.pose(np.array(problem.goal), "tool0")
    assert goal["position"] == pytest.approx(pose[:3, 3].tolist())
    assert Rotation.from_quat(goal["quaternion"]).as_matrix() == pytest.approx(pose[:3, :3])


def test_a_run_that_failed_is_a_record(setting: Setting, folder: Path) -> None:
    pytest.importorskip("ruckig")
    question = Question(setting, "tool0", to_pose=False)
    runs = runs_of(question, read_problems(folder / "small.jsonl"), parse_solvers("lshade,pso"), [1])
    records = Records(folder / "records.jsonl")
    with Store(folder / "runs.sqlite") as store:
        store.add(runs[0][1], Outcome(None, 2.0, "ScenarioError: in collision"))
        for _ in range(2):
            (record,) = judge_all(setting, runs, store, records)
            assert (record.planner, record.error, record.seconds) == ("lshade", "ScenarioError: in collision", 2.0)
    assert len(Records(folder / "records.jsonl").every) == 1


@pytest.mark.slow
def test_a_file_is_planned_proven_and_not_planned_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("ruckig")
    arguments = [str(folder / "small.jsonl"), "--robot-urdf", str(folder / "small.urdf"), "--spheres"]
    arguments += [str(folder / "small.toml"), "--max-acceleration", "5", "--max-jerk", "50", "--tip", "tool0"]
    arguments += ["--evaluations", "3000", "--out", str(folder / "out")]
    monkeypatch.setattr(sys, "argv", ["motion_bench_maker", *arguments])
    assert main() == 0
    first = capsys.readouterr()
    assert "| lshade | 1 of 1 | 1 | 1 | 1 of 1 |" in first.out
    assert main() == 0
    again = capsys.readouterr()
    assert (again.out, again.err) == (first.out, "")


def test_a_file_that_is_missing_is_one_line(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["x.jsonl", "--robot-urdf", str(folder / "small.urdf"), "--spheres", str(folder / "small.toml")]
    monkeypatch.setattr(sys, "argv", ["motion_bench_maker", *arguments])
    assert main() == 2
    assert capsys.readouterr().err.startswith("benchmarks.motion_bench_maker: x.jsonl: cannot be read: ")


def test_what_is_needed_or_unknown_is_said(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["motion_bench_maker", str(folder / "small.jsonl")])
    assert main() == 2
    assert capsys.readouterr().err == "benchmarks.motion_bench_maker: --robot-urdf: is needed\n"
    options = argparse.Namespace(planners="ompl,moveit")
    assert compare_in_space(options) == 2
    assert capsys.readouterr().err == "benchmarks.peers: --planners: 'moveit' is not one of ompl, drake\n"
