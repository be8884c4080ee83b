"""A robot that moves when it is asked for a plan, on the command line: planned, stored, read back, judged again."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import PPoly

from tpbso_casadi.cli.commands import audit, retime, solve

VELOCITY, ACCELERATION = [1.5, 0.0, -0.8], [4.0, -2.0, 3.0]
SCENARIO = f"""
[arm]
link_lengths = [0.7, 0.7, 0.6]
max_speed = 4.0
max_acceleration = 20.0
max_jerk = 400.0
[task]
kind = "point-to-point"
start = {{ joints = [-0.8, 0.6, 0.5] }}
goal = {{ joints = [0.8, 0.5, 0.6] }}
start_velocity = {VELOCITY}
start_acceleration = {ACCELERATION}
[[obstacles]]
center = [2.3, 1.2]
semi_axes = [0.15, 0.25]
velocity = [-0.3, 0.0]
[solver]
name = "pso"
evaluations = 2000
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("moving")
    (path / "moving.toml").write_text(SCENARIO)
    assert solve.main([str(path / "moving.toml"), "--out", str(path / "run"), "--quiet", "--no-plots"]) == 0
    return path


def test_the_motion_leaves_as_the_robot_moves(folder: Path) -> None:
    result = json.loads((folder / "run" / "result.json").read_text())
    solution = result["solution"]
    theta = PPoly(np.array(solution["coefficients"]), np.array(solution["breakpoints"]))
    assert [theta(0.0, order) for order in range(3)] == [
        pytest.approx(values, abs=1e-9) for values in ([-0.8, 0.6, 0.5], VELOCITY, ACCELERATION)
    ]
    assert theta(theta.x[-1]) == pytest.approx([0.8, 0.5, 0.6], abs=1e-9)
    times = np.linspace(0.0, theta.x[-1], 5000)
    for order, most in enumerate((4.0, 20.0, 400.0), start=1):
        assert np.abs(theta(times, order)).max() <= most
    assert result["feasible"]
    assert result.get("retiming") is None
    assert result["scenario"]["model"]["motion"] == "time-spline"
    assert "start acceleration" in [constraint["name"] for constraint in result["constraints"]]


def test_the_run_is_read_back_and_certified(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main([str(folder / "run")]) == 0
    said = capsys.readouterr().out
    assert "certified" in said
    assert "fastest of its path" not in said


def test_a_changed_acceleration_is_found_out(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "other"
    path.mkdir()
    result = json.loads((folder / "run" / "result.json").read_text())
    result["scenario"]["task"]["start_acceleration"] = [4.0, -2.0, 2.9]
    (path / "result.json").write_text(json.dumps(result))
    assert audit.main([str(path)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_scenario_is_audited_too(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main([str(folder / "moving.toml")]) == 0
    assert "no nonlinear program" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (["--retime"], "model.retime: motion = 'time-spline' keeps the timing that is searched"),
        (["--within", "1"], "solver.within: this task has no nonlinear program to descend"),
        (["--solver", "ipopt"], "solver.name: this task has no nonlinear program to descend"),
        (["--motion", "spline"], "task.start_acceleration: needs motion = 'time-spline' in [model]"),
    ],
)
def test_what_does_not_go_with_it(
    options: list[str], expected: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(folder / "moving.toml"), "--out", str(folder / "none"), "--no-plots", "--evaluations", "50"]
    assert solve.main([*arguments[:-2], *options]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert expected in said


def test_its_path_is_not_timed_anew(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert retime.main([str(folder / "run"), "--out", str(folder / "timed")]) == 2
    assert "leaves with an acceleration" in capsys.readouterr().err
