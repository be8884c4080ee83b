"""Problems as scenarios: what is asked is what the files state; runs that fail are records; the command line."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from benchmarks.motion_bench_maker.__main__ import main
from benchmarks.motion_bench_maker.motors import Payload
from benchmarks.motion_bench_maker.ours import Question, judge_all, may_touch, runs_of
from benchmarks.motion_bench_maker.problem_file import read_problems
from benchmarks.motion_bench_maker.records import Records
from benchmarks.motion_bench_maker.setting import Setting
from problems.scene.solids import Box, Cylinder
from tpbso_casadi.judging.grid import parse_solvers
from tpbso_casadi.judging.run import Outcome
from tpbso_casadi.judging.store import RunStore


def test_a_scenario_is_the_problem(setting: Setting, folder: Path) -> None:
    (problem,) = read_problems(folder / "small.jsonl")
    stated = Question(setting, to_pose=False).scenario(problem).problem()
    robot = stated.criteria.robot
    assert robot.limits.speed == (2.0, 3.0, 3.0)
    assert (robot.limits.acceleration, robot.limits.jerk) == ((5.0,) * 3, (50.0,) * 3)
    assert robot.limits.position == ((-3.0, 3.0), (-3.0, 3.0), (-2.0, 2.0))
    box, cylinder = stated.criteria.task.obstacles
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
    goal = Question(setting, to_pose=True).scenario(problem).table()["task"]["goal"]
    pose = setting.kinematics.pose(np.array(problem.goal), "tool0")
    assert goal["position"] == pytest.approx(pose[:3, 3].tolist())
    assert Rotation.from_quat(goal["quaternion"]).as_matrix() == pytest.approx(pose[:3, :3])


def test_a_payload_is_carried_by_the_tool(setting: Setting, folder: Path) -> None:
    (problem,) = read_problems(folder / "small.jsonl")
    loaded = replace(setting, payload=Payload(2.0, (0.0, 0.1, 0.2)))
    stated = Question(loaded, to_pose=False).scenario(problem).table()["robot"]
    assert (stated["payload"]["mass"], stated["payload"]["center"]) == (2.0, [0.0, 0.1, 0.2])
    assert stated["tip_link"] == "tool0"
    digests = [one.digest(problem) for one in (setting, loaded, replace(setting, payload=Payload(3.0)))]
    assert len(set(digests)) == 3


def test_torques_are_kept_unless_that_is_not_asked_for(folder: Path) -> None:
    (problem,) = read_problems(folder / "small.jsonl")
    massive = Setting(folder / "massive.urdf", folder / "small.toml", (5.0,), (50.0,))
    free = replace(massive, keeps_torques=False)
    limits = [Question(one, to_pose=False).scenario(problem).problem().criteria.robot.limits for one in (massive, free)]
    assert [one.torque for one in limits] == [(10.0,) * 3, None]


def test_torques_of_a_motion_are_those_of_the_arm_and_its_payload(folder: Path) -> None:
    pytest.importorskip("pinocchio")
    payload = Payload(0.5, (0.1, 0.0, 0.0))
    setting = Setting(folder / "massive.urdf", folder / "small.toml", (5.0,), (50.0,), payload=payload)
    # stretched out and lifted at 2 rad/s^2: the lift's axis carries 1 kg at 0.5 m and 0.5 kg at 1.6 m, and nothing else
    own, carried = 1.0 * 0.5, 0.5 * 1.6
    torque = (own + carried) * 9.81 + (1.0 * 0.5**2 + 0.5 * 1.6**2) * 2.0

    def still(times: np.ndarray, order: int) -> np.ndarray:
        return np.tile([0.0, 2.0 if order == 2 else 0.0, 0.0], (len(times), 1))

    assert setting.excess(still, 1.0)[-1] == pytest.approx(torque / 10.0 - 1.0, rel=1e-3)


Said = Callable[..., tuple[int, str, str]]


@pytest.fixture
def said(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Said:
    """The status of the command line for the small robot, and what it prints on both streams."""

    def run(*arguments: str) -> tuple[int, str, str]:
        robot = ["--robot-urdf", str(folder / "small.urdf"), "--spheres", str(folder / "small.toml")]
        monkeypatch.setattr(sys, "argv", ["motion_bench_maker", *arguments, *robot])
        return main(), *capsys.readouterr()

    return run


def test_a_run_that_failed_is_a_record(setting: Setting, folder: Path) -> None:
    pytest.importorskip("ruckig")
    question = Question(setting, to_pose=False)
    runs = runs_of(question, read_problems(folder / "small.jsonl"), parse_solvers("lshade,pso"), [1])
    records = Records(folder / "records.jsonl")
    with RunStore(folder / "runs.sqlite") as store:
        store.add(runs[0][1], Outcome(None, 2.0, "ScenarioError: in collision"))
        for _ in range(2):
            (record,) = judge_all(setting, runs, store, records)
            assert (record.planner, record.error, record.seconds) == ("lshade", "ScenarioError: in collision", 2.0)
    assert len(Records(folder / "records.jsonl").every) == 1


@pytest.mark.process
@pytest.mark.slow
def test_a_file_is_planned_proven_and_not_planned_again(folder: Path, said: Said) -> None:
    pytest.importorskip("ruckig")
    arguments = [str(folder / "small.jsonl"), "--max-acceleration", "5", "--max-jerk", "50", "--tip", "tool0"]
    arguments += ["--evaluations", "3000", "--out", str(folder / "out")]
    status, first, _ = said(*arguments)
    assert status == 0
    assert "| lshade | 1 of 1 | 1 | 1 | 1 of 1 |" in first
    assert said(*arguments) == (0, first, "")
