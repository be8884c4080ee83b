"""The audit: what a scenario is made of, whether a run holds for all t, and that nothing false passes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

from benchmarks.certificates import check
from problems import CertificateStatus, Constraint
from problems.certify import freedom, structure_of
from problems.nlp import optimality
from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.audit_report import audit_scenario
from tpbso_casadi.cli.commands.audit import main
from tpbso_casadi.figures import write_run
from tpbso_casadi.planning import SearchedMotion, plan
from tpbso_casadi.scenario.cases import TITLES
from tpbso_casadi.storage import sealed


@cache
def planned(case: str, *, polish: bool = False, solver: str = "pso", formulation: str = "reduced") -> SearchedMotion:
    content = builtin(case).model_dump()
    content["model"]["formulation"] = formulation
    content["solver"] |= {"name": solver, "evaluations": 6000, "polish_starts": int(polish)}
    if solver == "ipopt":
        content["solver"] |= {"evaluations": None, "iterations": 3}
    return plan(parse_scenario(content))


def audit(capfd: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, Any]:
    """Exit status, and the JSON or the line of error."""
    try:
        status = int(main([*map(str, arguments), "--json"]))
    except SystemExit as end:
        status = int(end.code or 0)
    output = capfd.readouterr()
    if status == 2:
        assert output.out == ""
        assert output.err.startswith("error: ")
        assert output.err.count("\n") == 1
        return status, output.err
    return status, json.loads(output.out)


LONG = (
    "obstacle-4",
    "obstacle-5",
    "pentagram-time",
    "pentagram-rotation",
    "closed-curve-rotation",
    "rotation-4",
    "rotation-5",
)  # much like others, and seconds each


@pytest.mark.parametrize("case", [pytest.param(c, marks=pytest.mark.slow) if c in LONG else c for c in TITLES])
def test_every_case_is_audited(case: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, of_scenario = audit(capfd, case)
    assert status == 0
    assert of_scenario["search"]["degrees_of_freedom"] == of_scenario["search"]["variables"]
    assert of_scenario["program"]["degrees_of_freedom"] < of_scenario["program"]["variables"]
    for c in of_scenario["search"]["constraints"] + of_scenario["program"]["constraints"]:
        assert c["rows"] > 0
        assert c["formula"]
        assert c["depends_on"] or c["degree"] == "constant"
    for polish in (False, True):
        write_run(tmp_path / "run", planned(case, polish=polish), plots=False)
        status, of_run = audit(capfd, tmp_path / "run")
        assert status == 0
        assert of_run["certificate"]["verdict"] == "certified"
        assert all(c["margin"] >= -1e-9 for c in of_run["constraints"])
        assert (of_run["polish"] is not None) == polish


def test_a_polished_motion_is_a_kkt_point_and_a_beetle_is_not(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    conditions = {}
    for polish in (False, True):
        write_run(tmp_path / "run", planned("obstacle-3", polish=polish), plots=False)
        conditions[polish] = audit(capfd, tmp_path / "run")[1]["optimality"]
    assert conditions[True]["stationarity"] < 1e-3
    assert conditions[True]["stationarity"] < conditions[False]["stationarity"]
    assert conditions[True]["sensitivities"][0]["constraint"] in ("clearance", "swept clearance")


def test_sensitivities_are_what_a_looser_limit_buys() -> None:
    def least_time(acceleration: float) -> SearchedMotion:
        content = builtin("time-2").model_dump()
        content["arm"]["max_acceleration"] = [acceleration, 20.0]
        content["solver"] = {"name": "ipopt", "iterations": 6}
        return plan(parse_scenario(content))

    base = least_time(20.0)
    program = base.problem.nlp()
    judged = optimality(program, program.from_trajectory(base.trajectory), "s", base.problem.robot)
    promised = sum(s.per_unit for s in judged.sensitivities if (s.constraint, s.column) == ("acceleration", "joint 1"))
    bought = least_time(20.1).objective - least_time(19.9).objective
    assert promised < 0.0
    assert promised == pytest.approx(bought / 0.2, rel=0.1)


def test_structure_of_a_small_constraint() -> None:
    x = ca.SX.sym("x", 3)
    rows = ca.vertcat(x[0] + x[1], x[0] + x[1], ca.fabs(x[2]), ca.SX(1.0), x[0] ** 2)
    constraint = Constraint(name="c", unit="m", expression=rows, lower=None, upper=ca.DM([[5.0]]), columns=("c",))
    box = np.array([0.0, 0.0, 6.0]), np.array([1.0, 1.0, 7.0])
    structure = structure_of(constraint, x, ["a", "b", "c"], *box)
    assert (structure.rows, structure.nonzeros, structure.degree, structure.equality) == (5, 6, "nonlinear", False)
    assert structure.depends_on == ("a", "b", "c")
    assert (structure.constant_rows, structure.duplicate_rows, structure.never_met, structure.always_met) == (
        1,
        1,
        1,
        4,
    )
    assert structure.kinks == {"abs": 1}
    for expression, degree in ((x[0] * x[1], "quadratic"), (2.0 * x[0], "linear"), (ca.SX(2.0), "constant")):
        assert structure_of(replace(constraint, expression=expression), x, ["a", "b", "c"], *box).degree == degree
    equal = replace(
        constraint, expression=ca.vertcat(x[0] - x[1], x[0] - x[1]), lower=ca.DM([[5.0]]), upper=ca.DM([[5.0]])
    )
    assert freedom([equal], x) == 1


@pytest.mark.parametrize(
    ("case", "speed", "increments"), [("rotation-2", "(11)", "(9)"), ("pentagram-rotation", "(21)", "(20)")]
)
def test_equations_are_those_of_the_task(case: str, speed: str, increments: str) -> None:
    models = audit_scenario(builtin(case))
    search, program = (
        {c["name"]: c["equation"] for c in models[model]["constraints"]} for model in ("search", "program")
    )
    assert search["speed"] == f"{speed}, (16)"
    assert program["rotation forward"] == program["rotation backward"] == increments


def test_a_limit_that_nothing_meets_is_found(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "tight.toml"
    path.write_text(
        "[arm]\nlink_lengths = [1.0, 1.0]\nmax_speed = 4.0\nmax_acceleration = 20.0\n"
        "joint_limits = [[2.0, 2.2], [-3.0, 3.0]]\n"  # joint 1 starts at -0.5
        '[task]\nkind = "point-to-point"\nstart = [1.0, 0.5]\ngoal = [0.5, 1.5]\nelbow = "up"\n'
        '[model]\nmotion = "paper"\n'
    )
    status, report = audit(capfd, path)
    assert status == 1
    assert next(c["never_met"] for c in report["search"]["constraints"] if c["name"] == "joint range") > 0


def folder_of(case: str, tmp_path: Path) -> Path:
    write_run(tmp_path / "run", planned(case), plots=False)
    return tmp_path / "run"


def edit_json(folder: Path, edit: Callable[[dict[str, Any]], object]) -> None:
    """Edit a result as somebody would who computes its seal anew."""
    content = json.loads((folder / "result.json").read_text())
    edit(content)
    (folder / "result.json").write_text(json.dumps(sealed({k: v for k, v in content.items() if k != "seal"})))


EDITS: dict[str, Callable[[dict[str, Any]], object]] = {
    "objective": lambda r: r["objective"].update(value=r["objective"]["value"] * (1.0 - 1e-6)),
    "cost": lambda r: r.update(cost=r["cost"] * 0.999),
    "feasible": lambda r: r.update(feasible=False),
    "verdict": lambda r: r["certificate"].update(verdict="violated"),
    "worst": lambda r: r["constraints"][0].update(worst=0.1),
    "status": lambda r: r["constraints"][0].update(status="undecided"),
    "limit": lambda r: r["scenario"]["arm"].update(max_speed=3.0),
    "goal": lambda r: r["scenario"]["task"].update(goal=[0.4, 1.5]),
    "unknown key": lambda r: r["scenario"].update(robot=1),
    "variable": lambda r: r["solution"]["variables"][0].update(value=r["solution"]["variables"][0]["value"] + 1e-6),
    "fewer variables": lambda r: r["solution"]["variables"].pop(),
    "coefficient": lambda r: r["solution"]["coefficients"][0][0].__setitem__(0, 9.0),
    "breakpoint": lambda r: r["solution"]["breakpoints"].__setitem__(1, 0.0),
    "no coefficients": lambda r: r["solution"].pop("coefficients"),
    "text": lambda r: r["solution"].update(coefficients="none"),
    "not a number": lambda r: r["solution"]["breakpoints"].__setitem__(0, None),
    "no scenario": lambda r: r.pop("scenario"),
}


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_an_edited_result_is_refused(
    edit: Callable[[dict[str, Any]], object], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = folder_of("time-3", tmp_path)
    edit_json(folder, edit)
    status, error = audit(capfd, folder)
    assert status == 2
    assert "result.json" in error or "solution" in error or "trajectory.csv" in error


@pytest.mark.parametrize("line", [1, 2, 60, -1])
def test_an_edited_table_is_refused(line: int, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = folder_of("time-3", tmp_path)
    path = folder / "trajectory.csv"
    lines = path.read_text().splitlines()
    cells = lines[line].split(",")
    cells[3] = repr(float(cells[3]) + 1e-6)
    lines[line] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")
    status, error = audit(capfd, folder)
    assert status == 2
    assert f"trajectory.csv line {line % len(lines) + 1}: q3" in error


@pytest.mark.parametrize("spoil", ["missing", "text", "fewer rows", "empty", "no result", "not JSON"])
def test_a_spoilt_folder_is_refused(spoil: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = folder_of("time-3", tmp_path)
    table, result = folder / "trajectory.csv", folder / "result.json"
    {
        "missing": table.unlink,
        "text": lambda: table.write_text(table.read_text().replace("0.0", "zero", 1)),
        "fewer rows": lambda: table.write_text("\n".join(table.read_text().splitlines()[:-1])),
        "empty": lambda: table.write_text(""),
        "no result": result.unlink,
        "not JSON": lambda: result.write_text("{"),
    }[spoil]()
    assert audit(capfd, folder)[0] == 2


def pieces_of(result: dict[str, Any]) -> list[list[list[float]]]:
    coefficients: list[list[list[float]]] = result["solution"]["coefficients"]
    return coefficients


def with_a_third_piece(result: dict[str, Any]) -> None:
    """The arm stays at rest for a second more."""
    solution = result["solution"]
    ends = np.array(solution["coefficients"])
    h = np.diff(solution["breakpoints"])[-1]
    last = np.polynomial.polynomial.polyval(h, ends[::-1, -1])
    rest = np.zeros((ends.shape[0], 1, ends.shape[2]))
    rest[-1, 0] = last
    solution["coefficients"] = np.concatenate([ends, rest], axis=1).tolist()
    solution["breakpoints"].append(solution["breakpoints"][-1] + 1.0)


HOSTILE: dict[str, Callable[[dict[str, Any]], object]] = {
    "three pieces": with_a_third_piece,
    "a thousand zeros": lambda r: r["solution"].update(
        coefficients=np.concatenate([np.zeros((1000, 2, 3)), pieces_of(r)]).tolist()
    ),
    "huge": lambda r: pieces_of(r)[0][0].__setitem__(0, 1e308),
    "huger": lambda r: pieces_of(r)[0][0].__setitem__(0, 10**400),
    "tiny times": lambda r: r["solution"]["breakpoints"].__setitem__(1, 5e-324),
    "times that stand still": lambda r: r["solution"]["breakpoints"].__setitem__(1, 0.0),
    "turns": lambda r: pieces_of(r)[-1][0].__setitem__(0, 1e9),
    "markup": lambda r: r["constraints"][0].update(name="[red]speed[/]", where="[bold"),
    "deep": lambda r: r["solver"]["settings"].update(c1=nested(900)),
    "deeper": lambda r: r["solver"]["settings"].update(c1=nested(150)),
    "a huge name": lambda r: r["versions"].update({"x" * 10_000_000: "1"}),
    "a plug-in that is not there": lambda r: r["scenario"]["solver"].update(name="nowhere:Nothing"),
}


def nested(depth: int) -> list[Any]:
    return [nested(depth - 1)] if depth else []


@pytest.mark.parametrize("edit", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_result_is_refused_in_one_line(
    edit: Callable[[dict[str, Any]], object], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = folder_of("time-3", tmp_path)
    edit_json(folder, edit)
    assert main([str(folder)]) == 2
    output = capfd.readouterr()
    assert (output.out, output.err.count("\n")) == ("", 1)
    assert "result.json" in output.err
    assert "internal error" not in output.err


def teleporting(turns: float, jump: float) -> Callable[[dict[str, Any]], object]:
    """A joint that goes on by ``jump`` rad between the pieces, after so many turns."""

    def edit(result: dict[str, Any]) -> None:
        last = pieces_of(result)[-1]
        last[0][0] += 2.0 * np.pi * turns
        last[1][0] += 2.0 * np.pi * turns + jump

    return edit


@pytest.mark.parametrize("turns", [0.0, 1e3, 1e8])
def test_a_motion_that_teleports_is_refused(turns: float, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = folder_of("time-3", tmp_path)
    edit_json(folder, teleporting(turns, 0.5))
    status, error = audit(capfd, folder)
    assert status == 2
    assert "do not join" in error


@pytest.mark.parametrize("name", ["joint_trajectory.json", "joint_trajectory.csv", "path.png"])
def test_files_of_another_plan_are_refused(name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = folder_of("time-3", tmp_path)
    (folder / "notes.txt").write_text("of mine")
    assert audit(capfd, folder)[0] == 0
    (folder / name).write_text("of another plan")
    status, error = audit(capfd, folder)
    assert status == 2
    assert f"{folder / name}: is not of this run" in error


@pytest.mark.parametrize("name", ["result.json", "trajectory.csv"])
def test_a_pipe_does_not_hang(name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = folder_of("time-3", tmp_path)
    (folder / name).unlink()
    os.mkfifo(folder / name)
    status, error = audit(capfd, folder)
    assert status == 2
    assert name in error


def test_what_is_neither_a_run_nor_a_scenario(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for what in (tmp_path / "nothing.toml", "nothing"):
        assert audit(capfd, what)[0] == 2


def rewritten(solution: SearchedMotion, folder: Path, factor: float) -> Path:
    """A run that is consistent in itself, with its motion run faster by a factor."""
    motion = replace(solution.motion, trajectory=solution.trajectory.time_scaled(1.0 / factor))
    search = replace(solution.search)
    write_run(folder, replace(solution, motion=motion, search=search), plots=False)
    edit_json(folder, lambda r: r["solution"].update(variables=None))
    return folder


def test_a_speed_a_thousandth_over_is_caught(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    solution = planned("time-3")
    tight = solution.problem.exact_time_scale(solution.trajectory)
    status, result = audit(capfd, rewritten(solution, tmp_path / "run", 1.001 / tight))
    assert status == 1
    assert result["certificate"]["verdict"] == "violated"
    broken = [c for c in result["constraints"] if c["status"] == "violated"]
    assert broken and {c["name"] for c in broken} <= {"speed", "acceleration"}
    assert all("t = " in c["where"] for c in broken)


@pytest.mark.parametrize(("grown", "expected"), [(-1e-4, "certified"), (1e-4, "violated")])
def test_a_link_that_grazes_an_obstacle_is_caught(
    grown: float, expected: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    solution = planned("obstacle-3")
    clearance = next(v for v in solution.problem.verify(solution.trajectory) if v.name == "clearance")
    smallest = clearance.worst / 0.9  # what is proven gives a tenth away
    oval = solution.problem.obstacles[0]
    factor = (min(oval.semi_axes) + smallest + grown) / min(oval.semi_axes)
    content = solution.scenario.model_dump()
    content["obstacles"][0]["semi_axes"] = [axis * factor for axis in oval.semi_axes]
    content["model"]["retime"] = False
    scenario = parse_scenario(content)
    problem = scenario.problem()
    motion = replace(solution.retiming.before, problem=problem)
    smaller = replace(solution, scenario=scenario, problem=problem, motion=motion, retiming=None)
    write_run(tmp_path / "run", smaller, plots=False)
    edit_json(tmp_path / "run", lambda r: r["solution"].update(variables=None))
    status, result = audit(capfd, tmp_path / "run")
    judged = next(c for c in result["constraints"] if c["name"] == "clearance")
    assert judged["status"] == expected
    assert status == (0 if expected == "certified" else 1)


@pytest.mark.parametrize("seeds", [range(5), pytest.param(range(5, 40), marks=pytest.mark.slow)])
def test_no_certificate_is_false(seeds: range) -> None:
    outcomes: Counter[tuple[CertificateStatus, bool]] = Counter()
    for seed in seeds:
        checked = check(seed)
        outcomes.update((status, name in checked.broken) for name, status in checked.statuses.items())
    assert outcomes[CertificateStatus.CERTIFIED, True] == 0
    assert outcomes[CertificateStatus.UNDECIDED, True] + outcomes[CertificateStatus.UNDECIDED, False] <= 1
    assert (
        outcomes[CertificateStatus.VIOLATED, True] >= len(seeds) // 3
    )  # there was something to find, and it was found
    assert outcomes[CertificateStatus.CERTIFIED, False] >= len(seeds) // 3
    assert outcomes[CertificateStatus.VIOLATED, False] <= 5  # broken by less than samples show


def test_tables_and_picture_for_a_person(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tpbso_casadi.audit"]
    folder = folder_of("obstacle-4", tmp_path)
    run = subprocess.run([*command, str(folder)], capture_output=True, text=True, check=True)
    assert "certified" in run.stdout
    assert "what holds the motion back" in run.stdout
    command_line = [*command, "obstacle-4", "--plots", str(tmp_path / "plots")]
    scenario = subprocess.run(command_line, capture_output=True, text=True, check=True)
    assert "degrees of freedom" in scenario.stdout
    assert (tmp_path / "plots/structure.png").read_bytes().startswith(b"\x89PNG")
    shutil.rmtree(folder)
    assert subprocess.run([*command, str(folder)], capture_output=True, check=False).returncode == 2
