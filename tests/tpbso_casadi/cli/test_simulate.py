"""``python -m tpbso_casadi.simulate``: what it writes, says and returns."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal, result_of, status
from helpers.simulations import replan_at
from scipy.interpolate import PPoly

from tpbso_casadi.cli.commands import audit, simulate
from tpbso_casadi.cli.commands.simulate import ReplanLines
from tpbso_casadi.display.console import OutputConsole

ARM = """[arm]
link_lengths = [0.5, 0.4]
max_speed = 3.0
max_acceleration = 15.0
[task]
kind = "point-to-point"
start = { joints = [-0.6, 0.4] }
goal = { joints = [0.8, -0.3] }
[solver]
seed = 3
"""
CART = """[[obstacles]]
shape = "box"
center = [1.05, -0.6]
size = [0.1, 0.1]
velocity = [0.0, 0.2]
"""
TABLE = "[simulation]\nseconds = 0.8\nevaluations = 200\n"
CHANGES = "changes_every = 0.3\ncourse_rate = 0.5\nregion = [[0.9, -1.0], [1.3, 1.0]]\n"
AWAY = "[simulation]\nregion = [[2.0, 2.0], [3.0, 3.0]]\ncourse_rate = 1.0\n"


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("scene.toml").write_text(ARM + CART + TABLE + CHANGES)


def run(*arguments: str) -> int:
    return status(simulate.main, "scene.toml", "--quiet", *arguments)


def rows(name: str) -> list[dict[str, str]]:
    with Path("out", name).open() as file:
        return list(csv.DictReader(file))


def test_a_run_folder_holds_motion_replans_obstacles_and_result() -> None:
    assert run("--out", "out") == 0
    assert {path.name for path in Path("out").iterdir()} == {
        "result.json", "trajectory.csv", "replans.csv", "obstacles.csv", "simulation.png", "simulation.html",
    }  # fmt: skip
    content = result_of("out")
    assert content["what"] == "a simulation of the planner: no robot was driven"
    assert content["seed"] == 3
    summary = content["summary"]
    assert summary["replans"] == len(rows("replans.csv")) == 8
    assert summary["new"] + summary["old"] + summary["stop"] == 8
    assert summary["collisions"] == summary["unproven"] == 0
    assert max(summary["largest_jumps"]) < 1e-9
    assert all(limit["satisfied"] for limit in content["limits"])
    check_motion(content)
    check_obstacle(content)


def check_motion(content: dict[str, Any]) -> None:
    """The table of the motion is that of the exact one, which stays within the limits at 5,000 times."""
    executed = PPoly(np.array(content["executed"]["coefficients"]), np.array(content["executed"]["breakpoints"]))
    for row in rows("trajectory.csv"):
        assert executed(float(row["t"])) == pytest.approx([float(row["q1"]), float(row["q2"])], abs=1e-12)
    times = np.linspace(0.0, 0.8, 5000)
    assert np.abs(executed(times, 1)).max() <= 3.0 * (1.0 + 1e-9)
    assert np.abs(executed(times, 2)).max() <= 15.0 * (1.0 + 1e-9)
    assert np.abs(np.diff(executed(times), axis=0)).max() <= 3.0 * times[1] * (1.0 + 1e-9)
    assert executed(0.0) == pytest.approx([-0.6, 0.4])


def check_obstacle(content: dict[str, Any]) -> None:
    """The cart keeps to its region and, between two rows, to what a velocity of at most 0.25 m/s allows."""
    table = np.array([[float(row[name]) for name in ("t", "x1", "y1")] for row in rows("obstacles.csv")])
    assert table[0] == pytest.approx([0.0, 1.05, -0.6])
    speeds = np.linalg.norm(np.diff(table[:, 1:], axis=0), axis=1) / np.diff(table[:, 0])
    assert speeds.max() <= 0.25 + 1e-9
    assert (table[:, 1:] >= [0.95 - 1e-9, -0.95 - 1e-9]).all()
    [course] = content["courses"]
    assert course["obstacle"] == 1
    breaks, pieces = course["true"]["motion"]["breaks"], np.array(course["true"]["motion"]["pieces"])
    displacement = PPoly(pieces.transpose(2, 1, 0), np.array(breaks))
    exact = np.array([1.05, -0.6]) + displacement(table[:, 0])
    assert table[:, 1:] == pytest.approx(exact, abs=1e-9)


def timeless(content: dict[str, Any]) -> dict[str, Any]:
    """Without what a clock on the wall says."""
    summary = {key: value for key, value in content["summary"].items() if "ms" not in key and key != "deadlines_met"}
    return {key: value for key, value in content.items() if key not in ("seal", "files")} | {"summary": summary}


def test_the_same_seed_is_the_same_simulation() -> None:
    for name, seed in (("out", "5"), ("same", "5"), ("other", "6")):
        assert run("--out", name, "--seed", seed, "--seconds", "0.4", "--no-plots") in (0, 1)
    assert timeless(result_of("out")) == timeless(result_of("same"))
    assert result_of("out")["courses"] != result_of("other")["courses"]


def test_the_command_line_overrides_the_table() -> None:
    assert (
        run(
            "--out", "out", "--seconds", "0.4", "--every", "0.2", "--evaluations", "50", "--within", "0.1", "--no-plots"
        )
        == 0
    )
    table = result_of("out")["scenario"]["simulation"]
    assert (table["seconds"], table["every"], table["evaluations"], table["within"]) == (0.4, 0.2, 50, 0.1)
    assert result_of("out")["summary"]["replans"] == 2


def test_without_a_table_goal_and_start_are_visited() -> None:
    Path("scene.toml").write_text(ARM)
    assert run("--seconds", "0.3") == 0
    content = result_of("runs/scene-simulated-3")
    assert [goal["joints"] for goal in content["scenario"]["simulation"]["goals"]] == [[0.8, -0.3], [-0.6, 0.4]]
    assert content["courses"] == []
    assert content["summary"]["closest"]["distance"] is None


def test_what_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        simulate.main(["--help"])
    assert "no robot was driven" in " ".join(capsys.readouterr().out.split())
    assert simulate.main(["scene.toml", "--out", "out", "--seconds", "0.3"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("a simulation of the planner: no robot was driven; 0.3 s\n")
    for line in ("collisions while moving", "contacts while standing", "largest jump", "deadlines met"):
        assert line in out
    assert "written to out" in out


WRONG = [
    (ARM + CART + "[simulation]\nchanges_every = 1.0\n", "scene.toml: simulation.course_rate: missing key"),
    (ARM + CART + AWAY, "scene.toml: obstacles.0: is not within the simulation.region"),
    (ARM + "[simulation]\nsecond = 1.0\n", "scene.toml: simulation.second: unknown key; did you mean seconds?"),
    (ARM.replace("kind", 'via = [[0.5, 0.5]]\nkind'), "scene.toml: task.via: is for a move from rest to rest"),
    (ARM + "[simulation]\ngoals = [[5.0, 0.0]]\n", "scene.toml: simulation.goals.0: (5.0, 0.0) is 5 m from the base"),
    (ARM + "[simulation]\nevery = 0.0001\n", "scene.toml: simulation.every: "),
]  # fmt: skip


def test_bad_scenes_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    for text, message in WRONG:
        Path("scene.toml").write_text(text)
        assert refusal(capsys, simulate.main, "scene.toml", "--out", "out").startswith(message)
    Path("scene.toml").write_text(ARM)
    Path("out").mkdir()
    Path("out/mine.txt").write_text("mine")  # the folder of something else
    assert "holds mine.txt" in refusal(capsys, simulate.main, "scene.toml", "--out", "out")


def test_an_audit_says_that_it_is_no_plan(capsys: pytest.CaptureFixture[str]) -> None:
    run("--out", "out", "--seconds", "0.2", "--no-plots")
    assert audit.main(["out"]) == 2
    [line] = capsys.readouterr().err.splitlines()
    file = Path("out", "result.json")
    assert line == f"error: {file}: what: a simulation of the planner, as it was written; it holds no plan"
    file.write_text(json.dumps({**result_of("out"), "seed": 99}))
    assert audit.main(["out"]) == 2
    assert capsys.readouterr().err == f"error: {file}: seed: was changed after the file was written\n"


SLOW_AND_LOUD = """
from tpbso_casadi.cli import entry
from tpbso_casadi.cli.commands import simulate

class Loud(simulate.ReplanLines):
    def __call__(self, replan):
        print(replan.tick, flush=True)

simulate.ReplanLines = Loud
entry.run("tpbso_casadi.cli.commands.simulate")
"""


@pytest.mark.process
def test_after_ctrl_c_there_is_what_was_simulated() -> None:
    command = [sys.executable, "-c", SLOW_AND_LOUD, "scene.toml", "--seconds", "300", "--quiet", "--out", "out"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    for line in process.stdout:
        if line.strip() == "2":
            process.send_signal(signal.SIGINT)
            break
    _, error = process.communicate(timeout=300)
    assert process.returncode == 130
    assert error.startswith("error: interrupted; the ")
    content = result_of("out")
    assert content["interrupted"]
    assert content["summary"]["replans"] == len(rows("replans.csv")) >= 3
    assert content["executed"]["breakpoints"][-1] == pytest.approx(0.1 * content["summary"]["replans"])


def test_changes_are_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    tell = ReplanLines(OutputConsole())
    kinds = ["new", "old", "stop", "stop", "new"]
    for tick, kind in enumerate(kinds):
        tell(replan_at(tick, kind=kind))
    tell(replan_at(5, certified=False, fail_safe=False))
    assert capsys.readouterr().out.splitlines() == [
        "t = 0.5 s: stops",
        "t = 1 s: goes on",
        "t = 1.25 s: goes on, not certified, no stop in time is proven",
    ]
