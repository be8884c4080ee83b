"""The command line of ``solve``: what it leaves, what it says, how it ends."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import pytest
from helpers.running import refusal, result_of, status
from helpers.scenes import SWING, TWO_LINKS, toml
from helpers.slow import slow_except
from oracles.csv_checker import check_run

from solvers import SOLVERS
from tpbso_casadi import parse_scenario
from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario.cases import TITLES

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def run(*arguments: str) -> int:
    return status(main, *arguments)


CAPABLE = [solver for solver in SOLVERS if solver not in {"bas", "random"}]  # others need not find a feasible plan
ALL = [(case, solver) for case in TITLES for solver in CAPABLE]
IN_BRIEF = list(zip(("time-2", "rotation-4", "obstacle-3", "closed-curve-time", "time-5"), CAPABLE, strict=True))


@pytest.mark.parametrize(("case", "solver"), slow_except(ALL, IN_BRIEF))
def test_every_case_with_every_capable_solver_in_the_reduced_form(case: str, solver: str) -> None:
    quick = ["--evaluations", "2000", "--no-plots", "--quiet", "--out", "out", "--formulation", "reduced"]
    assert run(case, "--solver", solver, *quick) == 0
    result = check_run(Path("out"))
    assert result["feasible"]
    assert result["evaluations"] == 2000
    assert all(constraint["satisfied"] for constraint in result["constraints"])


LINKS = [["--links", str(k), "--objective", name] for k in (2, 3, 4, 5, 7) for name in ("time", "rotation")]
OTHERS = [[case] for case in TITLES if not case.startswith(("time", "rotation"))]


@pytest.mark.slow
@pytest.mark.parametrize("case", [*LINKS, *OTHERS], ids=" ".join)
@pytest.mark.parametrize("solver", CAPABLE)
def test_any_number_of_links_obstacles_and_paths_in_the_paper_form(solver: str, case: list[str]) -> None:
    assert run(*case, "--solver", solver, "--no-plots", "--quiet", "--out", "out") == 0
    check_run(Path("out"))


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
    again = plan(parse_scenario(json.loads(json.dumps(other[0]["scenario"]))))
    assert again.objective == other[0]["objective"]["value"]  # type: ignore[index]
    assert other[1].count("\n") == len(again.times) + 1


def test_a_scenario_file_with_everything() -> None:
    arm = TWO_LINKS | {"link_lengths": [1.0, 0.8, 0.7], "joint_limits": [[-3.0, 3.0], [-2.5, 2.5], [-2.6, 2.6]]}
    task = SWING | {"objective": "length", "elbow": "free"}
    oval = {"center": [0.8, 0.8], "semi_axes": [0.15, 0.25]}
    solver = {"name": "pso", "seed": 2, "evaluations": 600}
    tables: dict[str, Any] = {"obstacles": [oval], "model": {"formulation": "reduced"}, "solver": solver}
    Path("mine.toml").write_text(toml(arm=arm, task=task, **tables))
    assert run("mine.toml", "--no-plots", "--quiet", "--out", "out") == 0
    result = check_run(Path("out"))
    assert [c["name"] for c in result["constraints"]][:4] == ["speed", "acceleration", "joint range", "clearance"]


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
