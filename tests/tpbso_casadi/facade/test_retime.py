"""``tp.retime``: paths of every kind as plans in the least time."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.cli.commands import solve

ROWS = np.array([[0.0, 0.5], [0.6, 0.9], [1.0, 0.2], [1.5, 0.4]])
SPEED, ACCELERATION = (2.0, 3.0), (10.0, 8.0)
ARM = tp.PlanarArm((0.5, 0.5), SPEED, ACCELERATION)


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    np.savetxt("path.csv", ROWS, delimiter=",", header="q1,q2", comments="")
    return tmp_path


def test_rows_a_file_and_a_path_are_the_same() -> None:
    paths: list[Any] = [ROWS, ROWS.tolist(), tp.JointPath.through(ROWS), "path.csv", Path("path.csv")]
    plans = [tp.retime(path, ARM) for path in paths]
    for plan in plans:
        assert plan.certified
        assert plan.duration == pytest.approx(plans[0].duration, rel=1e-9)
    times = np.linspace(0.0, plans[0].duration, 20_001)  # the limits, independently
    assert (np.abs(plans[0].trajectory.at(times, 1)) <= np.array(SPEED) * (1.0 + 1e-9)).all()
    assert (np.abs(plans[0].trajectory.at(times, 2)) <= np.array(ACCELERATION) * (1.0 + 1e-9)).all()
    for row in ROWS:
        assert np.abs(plans[0].trajectory.at(times) - row).max(axis=1).min() < 1e-3


def test_it_is_the_plan_of_the_command_line(folder: Path) -> None:
    Path("s.toml").write_text(
        "[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = [2.0, 3.0]\nmax_acceleration = [10.0, 8.0]\n"
        '[task]\nkind = "joint-path"\njoints = "path.csv"\n'
    )
    assert solve.main(["s.toml", "--quiet", "--no-plots", "--out", "solved"]) == 0
    tp.retime("path.csv", ARM).save("own", figures=())
    assert tp.read_run("own").result.solution == tp.read_run("solved").result.solution


def test_a_blend_leaves_the_lines_by_its_tolerance_at_most() -> None:
    plan = tp.retime(ROWS, ARM, interpolation="blend", tolerance=0.05)
    theta = plan.trajectory.at(np.linspace(0.0, plan.duration, 5001))
    away = [
        np.abs(theta - (a + np.clip((theta - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)[:, None] * (b - a))).max(
            axis=1
        )
        for a, b in pairwise(ROWS)
    ]
    assert 0.0 < np.min(away, axis=0).max() <= 0.05 + 1e-9


def test_a_plan_brings_its_robot_along() -> None:
    plan = tp.plan("time-3", solver="pso", evaluations=200, polish=False, retime=False)
    own = tp.retime(plan)
    assert own.duration < plan.duration
    assert own.motion.problem.robot == plan.motion.problem.robot
    plan.save("run", figures=())
    assert tp.retime("run").duration == pytest.approx(own.duration, rel=1e-12)
    faster = tp.robot([2.0 / 3.0] * 3, max_speed=8.0, max_acceleration=80.0)  # rates twice, their changes four times
    assert tp.retime("run", faster).duration == pytest.approx(own.duration / 2.0, rel=1e-6)
    assert tp.retime(plan.trajectory, faster).duration == pytest.approx(own.duration / 2.0, rel=1e-6)


def test_a_plan_brings_its_obstacles_along() -> None:
    far = tp.Rectangle((0.9, -0.9), (0.1, 0.1))
    plan = tp.plan("time-2", obstacles=[far], solver="pso", evaluations=100, polish=False, retime=False)
    assert tp.retime(plan).motion.problem.obstacles == (far,)
    assert tp.retime(plan, obstacles=[]).motion.problem.obstacles == ()


def test_what_is_asked_besides_is_kept() -> None:
    moving = tp.retime(ROWS, ARM, start_speed=0.5, total_time=(0.1, 9.0), margin=0.01)
    assert np.linalg.norm(moving.trajectory(0.0, 1)) == pytest.approx(0.5, rel=1e-9)
    assert moving.motion.problem.robot.margin == 0.01
    assert any(verdict.name == "total time" for verdict in moving.verdicts)
    wall = tp.retime(ROWS, ARM, obstacles=[tp.Rectangle((0.6, 0.6), (0.2, 0.2))])
    assert not wall.certified
    assert "clearance" in {verdict.name for verdict in wall.verdicts if not verdict.satisfied}


@pytest.mark.parametrize(
    "path", [[[0.0, 0.0], [1.0]], [["a", "b"]], ROWS * 1j, object(), {"a": 1}, ROWS * 1e9, ROWS[:1]]
)
def test_what_is_no_path_is_said(path: Any) -> None:
    with pytest.raises(tp.ScenarioError, match=r"^path: "):
        tp.retime(path, ARM)


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda: tp.retime(ROWS), r"robot: missing; say which robot runs the path"),
        (lambda: tp.retime(ROWS, tp.PlanarArm((1.0,) * 3, (1.0,) * 3, (1.0,) * 3)), "path: a path of 2 joints for"),
        (lambda: tp.retime("none.csv", ARM), "none.csv: cannot be read"),
        (lambda: tp.retime(ROWS, ARM, interpolation="cubic"), "interpolation: .* 'spline' or 'blend'"),
        (lambda: tp.retime(ROWS, ARM, interpolation="blend"), "tolerance: missing; say how far"),
        (lambda: tp.retime(ROWS, ARM, start_speed=9.0), "start_speed: joint 1 would have"),
        (lambda: tp.retime(tp.JointPath.through(ROWS), ARM, tolerance=0.1), "tolerance: the path is complete"),
        (lambda: tp.retime(ROWS[[0, 0]], ARM), "path: "),
    ],
)
def test_mistakes_take_one_line(call: Any, expected: str) -> None:
    with pytest.raises(tp.ScenarioError, match=f"^{expected}") as caught:
        call()
    assert "\n" not in str(caught.value)
