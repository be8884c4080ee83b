"""The command line of ``solve``: what it leaves, what it says, how it ends."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import pytest
from helpers.running import refusal, result_of, status
from helpers.scenes import SWING, TWO_LINKS, toml
from oracles.csv_checker import check_run

import tpbso_casadi as tp
from tpbso_casadi.cli.commands.solve import main

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def run(*arguments: str) -> int:
    return status(main, *arguments)


def test_what_a_newcomer_gets(capfd: pytest.CaptureFixture[str]) -> None:
    assert run() == 0
    folder = Path("runs/time-3-abso-1")
    pictures = {"convergence.png", "joints.png", "limits.png", "path.png"}
    assert {path.name for path in folder.iterdir()} == {*pictures, "result.json", "trajectory.csv"}
    printed = capfd.readouterr()
    assert "holds" in printed.out and str(folder) in printed.out and printed.err == ""
    check_run(folder)


def outcome(folder: str, *arguments: str) -> tuple[dict[str, object], str]:
    assert run("time-2", "--evaluations", "400", "--no-plots", "--quiet", "--out", folder, *arguments) == 0
    result = result_of(folder)
    del result["seconds"], result["polish"]["seconds"], result["seal"]
    return result, (Path(folder) / "trajectory.csv").read_text()


def test_same_seed_same_files_other_seed_others_no_number_loses_anything_and_a_result_runs_again() -> None:
    first, again, other = outcome("a"), outcome("b"), outcome("c", "--seed", "2")
    assert first == again
    assert first[1] != other[1]
    assert first[0]["seed"] == 1
    last = [float(cell) for cell in first[1].splitlines()[-1].split(",")]
    assert last[0] == first[0]["objective"]["value"]  # type: ignore[index]
    assert all(math.isfinite(cell) for cell in last)
    again = tp.plan(tp.parse_scenario(json.loads(json.dumps(other[0]["scenario"]))))
    assert again.objective == other[0]["objective"]["value"]  # type: ignore[index]
    assert other[1].count("\n") == len(again.times) + 1


def test_an_accuracy_that_nothing_met_is_said_and_written(capfd: pytest.CaptureFixture[str]) -> None:
    Path("way.csv").write_text("1,0\n1,1\n0,1.5\n-1,1\n-1,0.2")
    task = {"kind": "path", "accuracy": 1e-6, "points": "way.csv", "count": 40}
    arm = TWO_LINKS | {"link_lengths": [1.0, 1.0, 1.0]}
    Path("way.toml").write_text(toml(arm=arm, task=task, model={"motion": "paper"}, solver={"name": "bso"}))
    assert run("way.toml", "--evaluations", "100", "--no-plots", "--quiet", "--out", "out") == 1
    error = capfd.readouterr().err
    assert error.count("\n") == 1 and "accuracy is" in error and "1e-06 is the limit" in error
    result = result_of("out")
    assert result["feasible"] is False
    assert not next(c for c in result["constraints"] if c["name"] == "accuracy")["satisfied"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read anything")
def test_a_file_that_may_not_be_read(capfd: pytest.CaptureFixture[str]) -> None:
    Path("mine.toml").write_text(toml(arm=TWO_LINKS, task=SWING))
    Path("mine.toml").chmod(0)
    assert "cannot be read" in refusal(capfd, main, "mine.toml")
