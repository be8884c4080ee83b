"""``tpbso simulate``: what it writes, says and returns."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.running import result_of, status
from helpers.scenes import CART, COURSES, SHORT_ARM, TURN, toml
from helpers.simulations import replan_at
from scipy.interpolate import PPoly

from tpbso_casadi.cli.commands import audit, simulate
from tpbso_casadi.cli.commands.simulate import ReplanLines
from tpbso_casadi.display.console import OutputConsole

MOVE = {"arm": SHORT_ARM, "task": TURN, "solver": {"seed": 3}}
SIMULATION = {"seconds": 0.8, "evaluations": 200} | COURSES


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("scene.toml").write_text(toml(**MOVE, obstacles=[CART], simulation=SIMULATION))


def rows(name: str) -> list[dict[str, str]]:
    with Path("out", name).open() as file:
        return list(csv.DictReader(file))


def test_a_run_folder_holds_motion_replans_obstacles_and_result_and_no_plan(capsys: pytest.CaptureFixture[str]) -> None:
    assert status(simulate.main, "scene.toml", "--out", "out") == 0
    printed = capsys.readouterr().out
    assert printed.startswith("a simulation of the planner: no robot was driven; 0.8 s\n")
    for line in ("collisions while moving", "contacts while standing", "largest jump", "deadlines met", "to out\n"):
        assert line in printed
    assert {path.name for path in Path("out").iterdir()} == {
        "result.json", "trajectory.csv", "replans.csv", "obstacles.csv", "simulation.png", "simulation.html",
    }  # fmt: skip
    content = result_of("out")
    assert set(content["files"]) == {path.name for path in Path("out").iterdir()} - {"result.json"}
    assert content["what"] == "a simulation of the planner: no robot was driven"
    assert content["seed"] == 3
    summary = content["summary"]
    assert summary["replans"] == len(rows("replans.csv")) == 8
    assert summary["new"] + summary["old"] + summary["stop"] == 8
    assert summary["collisions"] == summary["unproven"] == 0
    assert max(summary["largest_jumps"]) < 1e-9
    assert all(limit["satisfied"] for limit in content["limits"])
    executed = PPoly(np.array(content["executed"]["coefficients"]), np.array(content["executed"]["breakpoints"]))
    for row in rows("trajectory.csv"):
        assert executed(float(row["t"])) == pytest.approx([float(row["q1"]), float(row["q2"])], abs=1e-12)
    times = np.linspace(0.0, 0.8, 5000)  # the limits, at each of them
    assert np.abs(executed(times, 1)).max() <= 3.0 * (1.0 + 1e-9)
    assert np.abs(executed(times, 2)).max() <= 15.0 * (1.0 + 1e-9)
    assert np.abs(np.diff(executed(times), axis=0)).max() <= 3.0 * times[1] * (1.0 + 1e-9)
    assert executed(0.0) == pytest.approx([-0.6, 0.4])
    assert audit.main(["out"]) == 2
    [line] = capsys.readouterr().err.splitlines()
    file = Path("out", "result.json")
    assert line == f"error: {file}: what: a simulation of the planner, as it was written; it holds no plan"
    file.write_text(json.dumps(content | {"seed": 99}))
    assert audit.main(["out"]) == 2
    assert capsys.readouterr().err == f"error: {file}: seed: was changed after the file was written\n"


def test_the_command_line_overrides_the_table_or_does_without(capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--seconds", "0.4", "--every", "0.2", "--evaluations", "50", "--within", "0.1", "--no-plots", "--quiet"]
    assert status(simulate.main, "scene.toml", "--out", "out", *options) == 0
    table = result_of("out")["scenario"]["simulation"]
    assert (table["seconds"], table["every"], table["evaluations"], table["within"]) == (0.4, 0.2, 50, 0.1)
    assert result_of("out")["summary"]["replans"] == 2
    assert {path.suffix for path in Path("out").iterdir()} == {".json", ".csv"}
    assert capsys.readouterr().out == ""
    Path("scene.toml").write_text(toml(**MOVE))
    assert status(simulate.main, "scene.toml", "--seconds", "0.3", "--no-plots") == 0
    assert "written to runs/scene-simulated-3" in capsys.readouterr().out
    assert "no robot was driven" in " ".join(simulate.parser().format_help().split())


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
