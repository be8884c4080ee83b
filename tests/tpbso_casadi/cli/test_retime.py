"""``python -m tpbso_casadi.retime``: waypoints, recordings and runs as fast as can be; one line for what is wrong."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal, result_of, status

from problems import Trajectory
from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.cli.commands.retime import main
from tpbso_casadi.storage import read_run

ARM = "[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = [2.0, 3.0]\nmax_acceleration = [10.0, 8.0]\n"
MOTORS = "link_masses = [2.0, 1.0]\nmax_torque = [18.0, 6.0]\n"
ROWS = np.array([[0.0, 0.5], [0.6, 0.9], [1.0, 0.2], [1.5, 0.4]])


pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("arm.toml").write_text(ARM)
    write_rows(ROWS)


def write_rows(rows: np.ndarray, header: str = "q1,q2") -> None:
    np.savetxt("path.csv", rows, delimiter=",", header=header, comments="")


def run(*arguments: str) -> int:
    return status(main, *arguments, "--quiet")


def check_limits(trajectory: Trajectory) -> None:
    """Independently, at 20,000 times."""
    times = np.linspace(0.0, trajectory.duration, 20_001)
    assert (np.abs(trajectory.at(times, 1)) <= np.array([2.0, 3.0]) * (1.0 + 1e-9)).all()
    assert (np.abs(trajectory.at(times, 2)) <= np.array([10.0, 8.0]) * (1.0 + 1e-9)).all()


def nearest(trajectory: Trajectory, row: np.ndarray) -> float:
    times = np.linspace(0.0, trajectory.duration, 20_001)
    return float(np.abs(trajectory.at(times) - row).max(axis=1).min())


def test_waypoints_are_passed_within_the_limits_and_audited() -> None:
    assert run("path.csv", "--robot", "arm.toml", "--out", "out", "--no-plots") == 0
    trajectory = read_run(Path("out")).motion.trajectory
    check_limits(trajectory)
    assert max(nearest(trajectory, row) for row in ROWS) < 1e-3
    np.testing.assert_allclose(trajectory.at(np.array([0.0, trajectory.duration])), ROWS[[0, -1]], atol=1e-9)
    assert audit.main(["out"]) == 0
    content = result_of("out")  # which says nothing of a search
    assert [content[key] for key in ("solver", "seed", "cost", "stop_reason")] == [None] * 4
    assert (content["evaluations"], content["iterations"]) == (0, 0)
    assert content["history"] == {"evaluations": [], "cost": []}
    assert content["objective"]["value"] == content["solution"]["breakpoints"][-1]
    assert {"polish", "retiming"}.isdisjoint(content)


def test_blends_stay_near_the_lines_and_are_faster_than_stops() -> None:
    assert run("path.csv", "--robot", "arm.toml", "--blend", "0.05", "--out", "out", "--no-plots") == 0
    assert run("path.csv", "--robot", "arm.toml", "--blend", "0", "--out", "stops", "--no-plots") == 0
    blended, stopping = (read_run(Path(name)).motion.trajectory for name in ("out", "stops"))
    check_limits(blended)
    assert 0.01 < max(nearest(blended, row) for row in ROWS) <= 0.05 + 1e-3
    assert max(nearest(stopping, row) for row in ROWS) < 1e-3
    assert blended.duration < stopping.duration


def test_ends_in_motion() -> None:
    assert run("path.csv", "--robot", "arm.toml", "--start-speed", "0.5", "--out", "out", "--no-plots") == 0
    trajectory = read_run(Path("out")).motion.trajectory
    velocity = trajectory.at(np.array([0.0, trajectory.duration]), 1)
    np.testing.assert_allclose(np.linalg.norm(velocity, axis=1), [0.5, 0.0], atol=1e-9)


def test_figures_a_film_and_exports() -> None:
    options = ["--out", "out", "--animate", "out/film.html", "--export", "csv", "--export", "npz", "--rate", "50"]
    assert run("path.csv", "--robot", "arm.toml", *options) == 0
    names = {path.name for path in Path("out").iterdir()}
    expected = {"result.json", "trajectory.csv", "path.png", "joints.png", "limits.png", "film.html"}
    assert names == expected | {"joint_trajectory.csv", "joint_trajectory.npz"}
    assert audit.main(["out"]) == 0


@pytest.mark.slow
def test_a_run_is_retimed_on_its_own_path_and_no_slower() -> None:
    options = ["rotation-3", "--solver", "pso", "--evaluations", "1000", "--formulation", "reduced", "--no-plots"]
    assert solve.main([*options, "--no-retime", "--quiet", "--out", "before"]) == 0
    assert run("before", "--out", "after", "--no-plots") == 0
    before, after = read_run(Path("before")).motion, read_run(Path("after")).motion
    assert after.trajectory.duration < before.trajectory.duration
    assert audit.main(["after"]) == 0
    assert run("after", "--out", "again", "--no-plots") == 0
    assert result_of("again")["objective"]["value"] <= after.trajectory.duration * (1.0 + 1e-6)


def test_a_run_of_a_given_path_is_retimed_on_the_path_that_was_given() -> None:
    Path("arm.toml").write_text(ARM + "max_jerk = 100.0\n")
    write_rows(ROWS[:3])
    assert run("path.csv", "--robot", "arm.toml", "--out", "run", "--no-plots") == 0
    assert run("run", "--out", "again", "--no-plots") == 0
    assert run("again", "--out", "thrice", "--no-plots") == 0
    assert result_of("again")["solution"] == result_of("thrice")["solution"] == result_of("run")["solution"]
    assert audit.main(["thrice"]) == 0
    assert run("run", "--start-speed", "0.2", "--out", "moving", "--no-plots") == 0  # from where the run is at rest
    velocity = read_run(Path("moving")).motion.trajectory.at(np.zeros(1), 1)
    assert np.linalg.norm(velocity) == pytest.approx(0.2, abs=1e-9)


def test_a_scenario_file_says_the_same() -> None:
    Path("s.toml").write_text(ARM + '[task]\nkind = "joint-path"\njoints = "path.csv"\n')
    assert solve.main(["s.toml", "--quiet", "--no-plots", "--out", "solved"]) == 0
    assert run("path.csv", "--robot", "arm.toml", "--out", "out", "--no-plots") == 0
    assert result_of("solved")["solution"] == result_of("out")["solution"]


def test_degrees_are_those_of_the_robots_file() -> None:
    Path("deg.toml").write_text(
        'unit = "deg"\n[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 100.0\nmax_acceleration = 500.0\n'
        '[task]\nkind = "joint-path"\njoints = "path.csv"\n'
    )
    write_rows(np.degrees(ROWS))
    assert run("path.csv", "--robot", "deg.toml", "--out", "out", "--no-plots") == 0
    assert solve.main(["deg.toml", "--quiet", "--no-plots", "--out", "solved"]) == 0
    for name in ("out", "solved"):
        trajectory = read_run(Path(name)).motion.trajectory
        np.testing.assert_allclose(trajectory.at(np.array([0.0, trajectory.duration])), ROWS[[0, -1]], atol=1e-9)


def test_a_blend_is_held_against_the_lines_that_were_stated() -> None:
    Path("deg.toml").write_text(
        'unit = "deg"\n[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 100.0\nmax_acceleration = 500.0\n'
    )
    write_rows(np.degrees(ROWS))
    assert run("path.csv", "--robot", "deg.toml", "--blend", "2.0", "--out", "out", "--no-plots") == 0
    lines = next(row for row in result_of("out")["constraints"] if row["name"] == "lines")
    assert 0.0 < lines["worst"] <= lines["bound"] == pytest.approx(np.radians(2.0), rel=1e-6)
    motion = read_run(Path("out")).motion.trajectory
    times = np.linspace(0.0, motion.duration, 501)
    on_lines = np.concatenate([a + (b - a) * np.linspace(0.0, 1.0, 1_001)[:, None] for a, b in pairwise(ROWS)])
    nearest = np.abs(motion.at(times)[:, None] - on_lines).max(axis=2).min(axis=1)
    assert nearest.max() <= np.radians(2.0) + 1e-3


def test_a_path_through_an_obstacle_is_written_and_not_certified(capfd: pytest.CaptureFixture[str]) -> None:
    Path("arm.toml").write_text(ARM + "[[obstacles]]\ncenter = [0.55, 0.75]\nsemi_axes = [0.1, 0.1]\n")
    assert run("path.csv", "--robot", "arm.toml", "--out", "out", "--no-plots") == 1
    assert "the path as it is cannot be run: its clearance" in capfd.readouterr().err
    assert result_of("out")["certificate"]["verdict"] == "violated"


WRONG = [
    (["path.csv"], "path.csv: says nothing of a robot; say --robot ARM.toml"),
    (["path.csv", "--robot", "none.toml"], "none.toml: cannot be read"),
    (["none.csv", "--robot", "arm.toml"], "none.csv: cannot be read"),
    (["path.csv", "--robot", "path.csv"], "path.csv: not TOML"),
    (["path.csv", "--robot", "empty.toml"], "empty.toml: arm: missing key"),
    (["path.csv", "--robot", "three.toml"], "task.joints: a path of 2 joints for a robot of 3"),
    (["path.csv", "--robot", "arm.toml", "--blend", "-1"], "--blend: -1 is not 0 or a positive number"),
    (["path.csv", "--robot", "arm.toml", "--interpolation", "blend"], "task.tolerance: missing key"),
    (["path.csv", "--robot", "arm.toml", "--start-speed", "9"], "task.start_speed: joint"),
    (["path.csv", "--robot", "arm.toml", "--out", "."], "is the working folder"),
    (["nothing", "--out", "x"], "nothing/result.json: cannot be read"),
    (["still.csv", "--robot", "arm.toml"], "still.csv line 3: the same joint angles as in the line before"),
    (["path.csv", "--robot", "arm.toml", "--payload", "1"], "payload"),  # of links without masses
    (["path.csv", "--robot", "motors.toml", "--payload", "-1"], "--payload: -1 is not 0 or a positive number"),
    (  # level but for 0.5 rad: (1 kg 0.25 m + 5 kg 0.5 m) 9.81 m/s^2 cos(0.5)
        ["path.csv", "--robot", "motors.toml", "--payload", "5"],
        "joint 2 has to give 23.67 N m to hold the arm 0% along the path, and may give 6 N m",
    ),
]


def test_what_is_wrong_takes_one_line(capfd: pytest.CaptureFixture[str]) -> None:
    Path("empty.toml").write_text("")
    Path("three.toml").write_text("[arm]\nlink_lengths = [1.0, 1.0, 1.0]\nmax_speed = 1.0\nmax_acceleration = 1.0\n")
    Path("still.csv").write_text("q1,q2\n0,0\n0,0\n")
    Path("nothing").mkdir()
    Path("motors.toml").write_text(ARM + MOTORS)
    for arguments, expected in WRONG:
        assert expected in refusal(capfd, main, *arguments, "--quiet"), arguments
    Path("s.toml").write_text(ARM + '[task]\nkind = "joint-path"\njoints = "path.csv"\n')
    reason = "solver: 'joint-path' is timed; there is nothing to search for"
    assert reason in refusal(capfd, solve.main, "s.toml", "--solver", "pso")


def test_a_jerk_limited_arm_may_move_at_the_end_of_a_curved_path() -> None:
    Path("arm.toml").write_text(ARM + "max_jerk = 100.0\n")
    assert run("path.csv", "--robot", "arm.toml", "--goal-speed", "0.3", "--out", "run", "--no-plots") == 0


SETTINGS = '[robot]\nmodel = "planar"\n[robot.settings]\npayload = { mass = 0.2 }\n' + (ARM + MOTORS).partition("\n")[2]
NAMES = ("free", "empty", "loaded", "same", "unloaded", "setting", "unset")


def torque_row(name: str) -> dict[str, Any]:
    (row,) = (row for row in result_of(name)["constraints"] if row["name"] == "torque")
    return dict(row)


def test_torques_are_kept_with_what_the_tool_carries() -> None:
    write_rows(ROWS[:3])
    Path("motors.toml").write_text(ARM + MOTORS)
    Path("loaded.toml").write_text(ARM + MOTORS + "payload = { mass = 0.4 }\n")
    Path("settings.toml").write_text(SETTINGS)
    for name, *options in (
        ("free", "--robot", "arm.toml"),
        ("empty", "--robot", "motors.toml"),
        ("loaded", "--robot", "loaded.toml"),
        ("same", "--robot", "motors.toml", "--payload", "0.4"),
        ("unloaded", "--robot", "loaded.toml", "--payload", "0"),
        ("setting", "--robot", "settings.toml", "--payload", "0.4"),
        ("unset", "--robot", "settings.toml", "--payload", "0.00"),
    ):
        assert run("path.csv", *options, "--out", name, "--no-plots") == 0
    durations = {name: result_of(name)["objective"]["value"] for name in NAMES}
    assert durations["free"] < durations["empty"] < durations["loaded"]
    assert durations["same"] == durations["setting"] == durations["loaded"]
    assert durations["unloaded"] == durations["unset"] == durations["empty"]
    row = torque_row("loaded")
    assert row["satisfied"]
    assert 0.995 < abs(row["worst"] / row["bound"]) <= 1.0
    assert audit.main(["loaded"]) == 0


@pytest.mark.slow
def test_a_run_is_timed_anew_with_another_payload() -> None:
    Path("motors.toml").write_text(ARM + MOTORS)
    assert run("path.csv", "--robot", "motors.toml", "--out", "out", "--no-plots") == 0
    assert run("out", "--payload", "0.4", "--out", "anew", "--no-plots") == 0
    assert result_of("anew")["objective"]["value"] > result_of("out")["objective"]["value"]
    assert torque_row("anew")["satisfied"]
