"""``tpbso certify``: verdicts, exit statuses, run folders that are audited; one line for what is wrong."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal, result_of, status

from tpbso_casadi.cli.commands import audit, retime, solve
from tpbso_casadi.cli.commands.certify import main
from tpbso_casadi.storage import read_run

ARM = "[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 2.0\nmax_acceleration = 10.0\n"
OBSTACLE = '[[obstacles]]\nshape = "box"\ncenter = [0.6, 0.6]\nsize = [0.2, 0.2]\n'

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("arm.toml").write_text(ARM)
    write_rows("good.csv", 2.0)
    write_rows("fast.csv", 0.6)


def write_rows(name: str, seconds: float, way: tuple[float, float] = (1.0, -0.4), columns: int = 7) -> None:
    u = np.linspace(0.0, 1.0, 9)
    shapes = (
        10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5,
        30.0 * u**2 * (1.0 - u) ** 2,
        60.0 * u - 180.0 * u**2 + 120.0 * u**3,
    )
    states = [np.outer(shape, way) / seconds**n for n, shape in enumerate(shapes)]
    table = np.column_stack([seconds * u, *states])[:, :columns]
    header = ",".join(["t", "q1", "q2", "qd1", "qd2", "qdd1", "qdd2"][:columns])
    np.savetxt(name, table, delimiter=",", header=header, comments="", fmt="%.17g")


def run(*arguments: str) -> int:
    return status(main, *arguments, "--quiet", "--no-plots")


def constraint(folder: str, name: str) -> dict[str, Any]:
    return next(row for row in result_of(folder)["constraints"] if row["name"] == name)


def test_a_motion_is_proven_written_and_audited() -> None:
    assert run("good.csv", "--robot", "arm.toml", "--out", "out") == 0
    content = result_of("out")
    assert content["certificate"]["verdict"] == "certified"
    assert content["scenario"]["task"]["times"] == np.linspace(0.0, 2.0, 9).tolist()
    assert content["solver"] is None
    trajectory = read_run(Path("out")).motion.trajectory
    u = np.linspace(0.0, 1.0, 1001)
    np.testing.assert_allclose(trajectory.at(2.0 * u)[:, 0], 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5, atol=1e-12)
    assert audit.main(["out", "--quiet"]) == 0


def test_what_is_broken_says_when_first_when_worst_and_where(capsys: pytest.CaptureFixture[str]) -> None:
    Path("cell.toml").write_text(OBSTACLE)
    arguments = ("fast.csv", "--robot", "arm.toml", "--scene", "cell.toml", "--out", "out")
    assert status(main, *arguments, "--no-plots") == 1
    out, err = capsys.readouterr()
    assert "a motion as it is stated: quintic between 9 rows" in out
    assert err.startswith(
        "error: the motion as it is cannot be run: its speed is 3.125 rad/s where 2 is the limit (joint 1, "
    )
    first = 0.6 * (1.0 - np.sqrt(0.2)) / 2.0  # where 30 u^2 (1 - u)^2 / 0.6 s is 2 rad/s
    assert constraint("out", "speed")["where"] == f"joint 1, t = 0.3 s; first at {first:.4g} s"
    clearance = constraint("out", "clearance")
    assert clearance["where"].startswith("link 2, obstacle 1, t = ")
    assert "; first at " in clearance["where"]
    assert clearance["worst"] < 0.0
    assert audit.main(["out", "--quiet"]) == 1


def test_limits_are_left_out_where_that_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    left_out = ["--without", "speed", "--without", "acceleration"]
    assert status(main, "fast.csv", "--robot", "arm.toml", *left_out, "--out", "out", "--no-plots") == 0
    assert "not judged: speed, as asked\nnot judged: acceleration, as asked\n" in capsys.readouterr().out
    assert result_of("out")["certificate"]["in_words"] == "certified without a verdict on speed, acceleration"
    assert audit.main(["out", "--quiet"]) == 0


def test_a_changed_motion_is_found_out() -> None:
    assert run("good.csv", "--robot", "arm.toml", "--out", "out") == 0
    path = Path("out/result.json")
    content = json.loads(path.read_text())
    content["solution"]["coefficients"][0][0][0] += 1e-3
    path.write_text(json.dumps(content))
    assert status(audit.main, "out") == 2


def test_figures_a_film_exports_and_json(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--out", "out", "--animate", "out/film.html", "--export", "ros-yaml"]
    assert status(main, "fast.csv", "--robot", "arm.toml", *options, "--quiet") == 1
    names = {path.name for path in Path("out").iterdir()}
    expected = {"result.json", "trajectory.csv", "path.png", "joints.png", "limits.png", "film.html"}
    assert names == expected | {"joint_trajectory.yaml"}
    assert run("out/joint_trajectory.yaml", "--robot", "arm.toml", "--out", "again") == 1
    assert audit.main(["out", "--quiet"]) == 1
    capsys.readouterr()
    assert status(main, "good.csv", "--robot", "arm.toml", "--json") == 0
    assert json.loads(capsys.readouterr().out)["certificate"]["verdict"] == "certified"


def test_interpolations_are_judged_apart() -> None:
    for kind, ended in (("linear", 1), ("cubic", 0), ("quintic", 0), ("auto", 0)):
        assert run("good.csv", "--robot", "arm.toml", "--interpolation", kind, "--out", kind) == ended
    assert constraint("linear", "acceleration")["worst"] is None
    assert constraint("linear", "acceleration")["where"].startswith("speeds jump, t = ")


def test_runs_are_judged_with_their_own_robot_or_with_another_payload() -> None:
    Path("s.toml").write_text(ARM + OBSTACLE.replace("0.6, 0.6", "-0.6, 0.6") + MOVE)
    assert solve.main(["s.toml", "--quiet", "--no-plots", "--out", "run", "--evaluations", "2000"]) == 0
    assert run("run", "--out", "again") == 0
    solved, again = result_of("run"), result_of("again")
    assert again["solution"]["coefficients"] == solved["solution"]["coefficients"]
    assert again["scenario"]["obstacles"] == solved["scenario"]["obstacles"]
    worst = {row["name"]: row["worst"] for row in again["constraints"]}
    assert worst["speed"] == pytest.approx(next(r["worst"] for r in solved["constraints"] if r["name"] == "speed"))
    assert run("run", "--robot", "arm.toml", "--out", "elsewhere") == 0
    assert result_of("elsewhere")["scenario"]["obstacles"] == []
    assert retime.main(["again", "--quiet", "--no-plots", "--out", "faster"]) == 0


MOVE = """
[task]
kind = "point-to-point"
start = { joints = [0.0, 0.5] }
goal = { joints = [0.8, 0.2] }
[model]
motion = "spline"
"""


def test_a_scenario_file_states_the_same() -> None:
    Path("s.toml").write_text(ARM + '[task]\nkind = "recorded-motion"\nfile = "good.csv"\n')
    assert solve.main(["s.toml", "--quiet", "--no-plots", "--out", "solved"]) == 0
    assert run("good.csv", "--robot", "arm.toml", "--out", "out") == 0
    assert result_of("solved")["solution"] == result_of("out")["solution"]


def test_a_motion_that_is_too_fast_is_repaired_beside_the_other(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ("fast.csv", "--robot", "arm.toml", "--out", "out", "--no-plots", "--repair")
    assert status(main, *arguments) == 0
    said = capsys.readouterr().err
    assert "slower all along by 1.5625: 0.9375 s, certified" in said
    assert "timed anew on its path: 0.7013" in said
    assert "repaired: 0.7013" in said
    assert audit.main(["out", "--quiet"]) == 1
    assert audit.main(["out-repaired", "--quiet"]) == 0
    assert result_of("out-repaired")["solution"]["breakpoints"][-1] == pytest.approx(0.7013, abs=1e-3)
    assert run("good.csv", "--robot", "arm.toml", "--out", "good", "--repair") == 0
    assert not Path("good-repaired").exists()


def test_a_repaired_motion_lies_beside_the_folder_that_was_written(capsys: pytest.CaptureFixture[str]) -> None:
    Path("slow.toml").write_text(ARM.replace("2.0", "1.9"))
    for arm in ("arm.toml", "slow.toml"):
        assert run("fast.csv", "--robot", arm, "--repair") == 0
    folders = {"fast-certified", "fast-certified-repaired", "fast-certified-2", "fast-certified-2-repaired"}
    assert {path.name for path in Path("runs").iterdir()} == folders
    Path("taken-repaired").write_text("of mine")
    line = refusal(capsys, main, "fast.csv", "--robot", "arm.toml", "--repair", "--out", "taken")
    assert line.startswith("taken-repaired: ")
    assert not Path("taken").exists() and Path("taken-repaired").read_text() == "of mine"


def test_where_time_does_not_help_it_is_said_what_would_have_to_move(capsys: pytest.CaptureFixture[str]) -> None:
    Path("cell.toml").write_text(OBSTACLE)
    arguments = ("fast.csv", "--robot", "arm.toml", "--scene", "cell.toml", "--out", "out", "--no-plots", "--repair")
    assert status(main, *arguments) == 1
    said = capsys.readouterr().err
    assert "time alone does not help; on this path would have to give way:\nclearance: link 2, obstacle 1, t = " in said
    assert not Path("out-repaired").exists()


WRONG = [
    (["good.csv", "--robot", "arm.toml", "--json", "--repair"], "--repair: needs a run folder; say --out DIR too"),
    ([""], "argument TRAJECTORY|RUN_FOLDER|FOLDER: a path is needed, not ''"),
    (["good.csv"], "good.csv: says nothing of a robot; say --robot panda, ARM.toml or ARM.urdf"),
    (["none.csv", "--robot", "arm.toml"], "none.csv: cannot be read: No such file or directory"),
    (["good.csv", "--robot", "panda"], "good.csv: task.positions: rows of 2 joints for a robot of 7"),
    (["good.csv", "--robot", "none.toml"], "none.toml: cannot be read: No such file or directory"),
    (["good.csv", "--robot", "arm.toml", "--scene", "none.toml"], "none.toml: cannot be read: No such file"),
    (
        ["good.csv", "--robot", "arm.toml", "--scene", "wrong.toml"],
        "wrong.toml: obstacles.0.shape: input should be",
    ),
    (
        ["good.csv", "--robot", "arm.toml", "--scene", "touching.toml"],
        "touching.toml: may_touch.0: nothing is called 'wall'; there are",
    ),
    (["two.csv", "--robot", "arm.toml"], "two.csv: task.times: have to increase; row 2 is at 0 s"),
    (["two.csv", "--robot", "arm.toml", "--interpolation", "cubic"], "two.csv: task."),
    (["good.csv", "--robot", "arm.toml", "--without", "x"], "good.csv: task.without: 'x' is no limit; there are speed"),
    (
        ["arm.toml", "--robot", "arm.toml"],
        "arm.toml: a motion is read from *.csv, *.npz, *.json, *.yaml, *.yml or *.mcap",
    ),
]


@pytest.mark.parametrize(("arguments", "reason"), WRONG)
def test_what_is_wrong_is_said_in_one_line(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("two.csv").write_text("t,q1,q2\n0,0,0\n0,1,1\n")
    Path("touching.toml").write_text('may_touch = [["wall", "link 1"]]\n' + OBSTACLE)
    Path("wrong.toml").write_text('[[obstacles]]\nshape = "banana"\n')
    line = refusal(capsys, main, *arguments)
    assert line.startswith(reason), line


@pytest.mark.process
@pytest.mark.parametrize("program", [["tpbso_casadi", "certify"], ["tpbso_casadi.certify"]])
def test_the_command_runs_as_a_process(program: list[str]) -> None:
    command = [sys.executable, "-m", *program, "good.csv", "--robot", "arm.toml", "--no-plots", "--out", "out"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, ""), ended
    assert "written to out" in ended.stdout
