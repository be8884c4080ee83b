"""The audit: what a scenario is made of, whether a run holds for all t, and that nothing false passes."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.scenes import SWING, TWO_LINKS, toml
from helpers.slow import slow_except

from benchmarks.certificates import check
from problems import CertificateStatus, Constraint
from problems.certify import exact_time_scale, freedom, structure_of
from tpbso_casadi import audit_report, builtin, parse_scenario
from tpbso_casadi.audit_report import audit_scenario
from tpbso_casadi.cli.commands.audit import main
from tpbso_casadi.planning import PlannedMotion, plan
from tpbso_casadi.scenario.cases import TITLES
from tpbso_casadi.storage import sealed, write_plan

ARM = {"link_lengths": [0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
MOVE = {
    "kind": "point-to-point",
    "start": {"joints": [0.1, 0.5, 0.5]},
    "goal": [[0.5, 1.0], [0.2, 1.1]],
    "via": [[0.9, 0.6]],
}
PATH = {"kind": "joint-path", "joints": [[0.0, 0.5, 0.5], [0.4, 0.9, 0.2], [0.8, 0.4, -0.3]]}
FOLLOWED = {"kind": "path", "points": [[1.0, -0.2], [1.1, 0.0], [1.0, 0.2]], "accuracy": 0.1, "elbow": "up"}
STATED: dict[str, Any] = {
    "move": {"arm": ARM, "task": MOVE},
    "path": {"arm": ARM, "task": PATH},
    "followed": {"arm": ARM, "task": FOLLOWED, "model": {"motion": "paper"}},
}


@cache
def planned(case: str, polish: bool = False, retime: bool = True) -> PlannedMotion:
    """Of the paper's motions rotation-3 is retimed, and time-3 gives way to the closed form; a move; a given path."""
    if case == "path":
        return plan(parse_scenario(STATED[case]))
    content = STATED.get(case) or builtin(case).table()
    if case not in STATED:
        content["model"] |= {"retime": retime, "formulation": "reduced"}
    solver = {"name": "pso", "evaluations": 600, "polish_starts": int(polish)}
    return plan(parse_scenario(content | {"solver": content.get("solver", {}) | solver}))


@cache
def files_of(case: str, polish: bool) -> dict[str, bytes]:
    with TemporaryDirectory() as place:
        write_plan(Path(place, "run"), planned(case, polish))
        return {path.name: path.read_bytes() for path in Path(place, "run").iterdir()}


def folder_of(case: str, tmp_path: Path, polish: bool = False) -> Path:
    folder = tmp_path / "run"
    folder.mkdir(exist_ok=True)
    for name, content in files_of(case, polish).items():
        (folder / name).write_bytes(content)
    return folder


def edit_json(folder: Path, edit: Callable[[dict[str, Any]], object]) -> None:
    """Edit a result as somebody would who computes its seal anew."""
    content = json.loads((folder / "result.json").read_text())
    edit(content)
    (folder / "result.json").write_text(json.dumps(sealed({k: v for k, v in content.items() if k != "seal"})))


def audit(capfd: pytest.CaptureFixture[str], *arguments: object) -> tuple[int, Any]:
    """Exit status, and the JSON or the line of error."""
    status = main([*map(str, arguments), "--json"])
    output = capfd.readouterr()
    if status == 2:
        assert (output.out, output.err.count("\n")) == ("", 1)
        assert output.err.startswith("error: ")
        assert "internal error" not in output.err
        return status, output.err
    return status, json.loads(output.out)


OFTEN = ("time-3",)


@pytest.fixture
def no_prices(monkeypatch: pytest.MonkeyPatch) -> None:
    """Conditions of optimality alone: prices take far longer, and are tested where they are made."""
    monkeypatch.setattr(audit_report, "nearest_optimum", lambda *arguments: None)


@pytest.mark.optimum
@pytest.mark.usefixtures("no_prices")
@pytest.mark.parametrize("case", slow_except(TITLES, OFTEN))
def test_every_case_is_audited(case: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, of_scenario = audit(capfd, case)
    assert status == 0
    assert of_scenario["search"]["degrees_of_freedom"] == of_scenario["search"]["variables"]
    assert of_scenario["program"]["degrees_of_freedom"] < of_scenario["program"]["variables"]
    for c in of_scenario["search"]["constraints"] + of_scenario["program"]["constraints"]:
        assert c["rows"] > 0
        assert c["formula"]
        assert c["depends_on"] or c["degree"] == "constant"
    conditions = []
    for polish in (False, True):
        status, of_run = audit(capfd, folder_of(case, tmp_path, polish))
        assert status == 0
        assert of_run["certificate"]["verdict"] == "certified"
        assert all(c["margin"] >= -1e-9 for c in of_run["constraints"])
        assert (of_run["polish"] is not None) == polish
        conditions.append(of_run["optimality"])
    if case == "time-3":  # a polished motion meets the conditions of an optimum, a particle does not
        assert conditions[1]["stationarity"] < min(1e-3, conditions[0]["stationarity"])


@pytest.mark.optimum
@pytest.mark.usefixtures("no_prices")
@pytest.mark.parametrize("case", slow_except(STATED, 1))
def test_moves_and_paths_are_certified_again(case: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    status, found = audit(capfd, folder_of(case, tmp_path, polish=case != "path"))
    assert (status, found["certificate"]["verdict"]) == (0, "certified")
    assert (found["optimality"] is None) == (case == "path")
    names = [c["name"] for c in found["constraints"]]
    assert case != "move" or names[-5:] == ["start", "via 1", "goal", "start velocity", "goal velocity"]


def test_structure_of_a_small_constraint() -> None:
    x = ca.SX.sym("x", 3)
    rows = ca.vertcat(x[0] + x[1], x[0] + x[1], ca.fabs(x[2]), ca.SX(1.0), x[0] ** 2)
    constraint = Constraint(name="c", unit="m", expression=rows, lower=None, upper=ca.DM([[5.0]]), columns=("c",))
    box = np.array([0.0, 0.0, 6.0]), np.array([1.0, 1.0, 7.0])
    structure = structure_of(constraint, x, ["a", "b", "c"], *box)
    assert (structure.rows, structure.nonzeros, structure.degree, structure.equality) == (5, 6, "nonlinear", False)
    assert structure.depends_on == ("a", "b", "c")
    assert (structure.constant_rows, structure.duplicate_rows) == (1, 1)
    assert (structure.never_met, structure.always_met) == (1, 4)
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
    arm = TWO_LINKS | {"link_lengths": [1.0, 1.0], "joint_limits": [[2.0, 2.2], [-3.0, 3.0]]}  # joint 1 starts at -0.5
    task = SWING | {"start": [1.0, 0.5], "elbow": "up"}
    path.write_text(toml(arm=arm, task=task, model={"motion": "paper"}))
    status, report = audit(capfd, path)
    assert status == 1
    assert next(c["never_met"] for c in report["search"]["constraints"] if c["name"] == "joint range") > 0


def pieces_of(result: dict[str, Any]) -> list[list[list[float]]]:
    coefficients: list[list[list[float]]] = result["solution"]["coefficients"]
    return coefficients


def moved(pieces: dict[str, Any]) -> None:
    """The same motion, turned by a millionth of a radian in joint 2."""
    coefficients = np.array(pieces["coefficients"])
    coefficients[-1, :, 1] += 1e-6
    pieces["coefficients"] = coefficients.tolist()


def with_a_third_piece(result: dict[str, Any]) -> None:
    """The arm stays at rest for a second more."""
    solution = result["solution"]
    ends = np.array(solution["coefficients"])
    h = np.diff(solution["breakpoints"])[-1]
    rest = np.zeros((ends.shape[0], 1, ends.shape[2]))
    rest[-1, 0] = np.polynomial.polynomial.polyval(h, ends[::-1, -1])
    solution["coefficients"] = np.concatenate([ends, rest], axis=1).tolist()
    solution["breakpoints"].append(solution["breakpoints"][-1] + 1.0)


def teleporting(turns: float, jump: float) -> Callable[[dict[str, Any]], object]:
    """A joint that goes on by ``jump`` rad between the pieces, after so many turns."""

    def edit(result: dict[str, Any]) -> None:
        last = pieces_of(result)[-1]
        last[0][0] += 2.0 * np.pi * turns
        last[1][0] += 2.0 * np.pi * turns + jump

    return edit


def nested(depth: int) -> list[Any]:
    return [nested(depth - 1)] if depth else []


def nudged(variable: dict[str, Any], by: float) -> None:
    variable["value"] += by


EDITS: dict[str, list[tuple[Callable[[dict[str, Any]], object], str]]] = {  # those of different kinds first
    "time-3": [
        (lambda r: r["objective"].update(value=r["objective"]["value"] * (1.0 - 1e-6)), "objective"),
        (lambda r: r["scenario"]["task"].update(goal=[0.4, 1.5]), ""),
        (teleporting(1e3, 0.5), "do not join"),
        (lambda r: r["solver"]["settings"].update(c1=nested(900)), ""),
        (lambda r: r.update(cost=r["cost"] * 0.999), "cost"),
        (lambda r: r["scenario"].update(robot=1), "robot"),
        (lambda r: nudged(r["solution"]["variables"][0], 1e-6), ""),
        (lambda r: r["solution"]["variables"].pop(), "variables"),
        (lambda r: pieces_of(r)[0][0].__setitem__(0, 9.0), ""),
        (lambda r: r["solution"]["breakpoints"].__setitem__(1, 0.0), "breakpoints"),
        (with_a_third_piece, ""),
        (lambda r: r["solution"].update(coefficients=[[[0.0] * 3] * 2] * 1000 + pieces_of(r)), ""),
        (lambda r: pieces_of(r)[0][0].__setitem__(0, 10**400), ""),
        (lambda r: r["solution"]["breakpoints"].__setitem__(1, 5e-324), ""),
        (lambda r: pieces_of(r)[-1][0].__setitem__(0, 1e9), ""),
        (lambda r: r["constraints"][0].update(name="[red]speed[/]", where="[bold"), ""),
        (lambda r: r["versions"].update({"x" * 10_000_000: "1"}), ""),
        (lambda r: r["retiming"].update(candidate="same path"), "leaves its path"),
    ],
    "rotation-3": [
        (lambda r: moved(r["retiming"]["motion"]), ""),
        (lambda r: r["retiming"]["before"].update(duration=9.0), "retiming.before.duration"),
        (lambda r: moved(r["solution"]), ""),
        (lambda r: r["retiming"].update(motion=None), "retiming"),
        (lambda r: r["retiming"]["after"].update(objective=0.1), "retiming.after.objective"),
        (lambda r: r["scenario"]["model"].update(retime=False), "retiming: the scenario asks"),
    ],
    "move": [
        (lambda r: moved(r["solution"]), ""),
        (lambda r: nudged(r["solution"]["variables"][0], 1e-3), ""),
        (lambda r: r.update(cost=r["cost"] * 0.999), "cost"),
        (lambda r: r["scenario"]["task"].update(goal_velocity=[0.1, 0.0, 0.0]), ""),
    ],
    "path": [
        (lambda r: r["scenario"]["task"]["joints"][1].__setitem__(0, 0.4 + 1e-6), "constraints.path"),
        (lambda r: r.update(evaluations=10), "evaluations: 10 is stored, 0 is computed"),
        (lambda r: r["history"].update(cost=[1.0], evaluations=[1]), "history"),
        (lambda r: r["solution"].update(quantities={"theta": [0.0]}), "solution.quantities"),
    ],
}


@pytest.mark.parametrize(
    ("case", "edit", "expected"),
    [
        edited
        for case, edits in EDITS.items()
        for edited in slow_except([(case, *edit) for edit in edits], 4 if case == "time-3" else 1)
    ],
)
def test_an_edited_result_is_refused_by_name(
    case: str,
    edit: Callable[[dict[str, Any]], object],
    expected: str,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    folder = folder_of(case, tmp_path)
    edit_json(folder, edit)
    status, error = audit(capfd, folder)
    assert status == 2
    assert "result.json" in error or "trajectory.csv" in error
    assert expected in error


@pytest.mark.parametrize(
    "spoil", ["missing", "text", "fewer rows", "empty", "a pipe", "no result", "not JSON", "a result in a pipe"]
)
def test_a_spoilt_folder_is_refused(spoil: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = folder_of("time-3", tmp_path)
    table, result = folder / "trajectory.csv", folder / "result.json"
    {
        "missing": table.unlink,
        "text": lambda: table.write_text(table.read_text().replace("0.0", "zero", 1)),
        "fewer rows": lambda: table.write_text("\n".join(table.read_text().splitlines()[:-1])),
        "empty": lambda: table.write_text(""),
        "a pipe": lambda: (table.unlink(), os.mkfifo(table)),
        "no result": result.unlink,
        "not JSON": lambda: result.write_text("{"),
        "a result in a pipe": lambda: (result.unlink(), os.mkfifo(result)),
    }[spoil]()
    status, error = audit(capfd, folder)
    assert status == 2
    assert ("result.json" if "result" in spoil or spoil == "not JSON" else "trajectory.csv") in error
    assert audit(capfd, tmp_path / "nothing.toml")[0] == audit(capfd, "nothing")[0] == 2


def test_files_of_another_plan_are_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    folder = folder_of("time-3", tmp_path)
    (folder / "notes.txt").write_text("of mine")
    assert audit(capfd, folder)[0] == 0
    for name in ("joint_trajectory.json", "path.png"):
        (folder / name).write_text("of another plan")
        status, error = audit(capfd, folder)
        assert status == 2 and f"{folder / name}: is not of this run" in error
        (folder / name).unlink()


def rewritten(solution: PlannedMotion, folder: Path, factor: float) -> Path:
    """A run that is consistent in itself, with its motion run faster by a factor."""
    motion = replace(solution.motion, trajectory=solution.trajectory.time_scaled(1.0 / factor))
    search = replace(solution.search)
    write_plan(folder, replace(solution, motion=motion, search=search))
    edit_json(folder, lambda r: r["solution"].update(variables=None))
    return folder


def test_a_speed_a_thousandth_over_is_caught(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    solution = planned("time-3", retime=False)
    tight = exact_time_scale(solution.problem.criteria.limits, solution.trajectory)
    status, result = audit(capfd, rewritten(solution, tmp_path / "run", 1.001 / tight))
    assert status == 1
    assert result["certificate"]["verdict"] == "violated"
    broken = [c for c in result["constraints"] if c["status"] == "violated"]
    assert broken and {c["name"] for c in broken} <= {"speed", "acceleration"}
    assert all("t = " in c["where"] for c in broken)


@pytest.mark.parametrize("seeds", [range(3), pytest.param(range(3, 40), marks=pytest.mark.slow)])
def test_no_certificate_is_false(seeds: range) -> None:
    outcomes: Counter[tuple[CertificateStatus, bool]] = Counter()
    for seed in seeds:
        checked = check(seed)
        outcomes.update((status, name in checked.broken) for name, status in checked.statuses.items())
    assert outcomes[CertificateStatus.CERTIFIED, True] == 0
    assert outcomes[CertificateStatus.UNDECIDED, True] + outcomes[CertificateStatus.UNDECIDED, False] <= 1
    assert outcomes[CertificateStatus.VIOLATED, True] >= len(seeds) // 3  # there was something to find
    assert outcomes[CertificateStatus.CERTIFIED, False] >= len(seeds) // 3
    assert outcomes[CertificateStatus.VIOLATED, False] <= 5  # broken by less than samples show


@pytest.mark.optimum
def test_tables_for_a_person(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert main([str(folder_of("time-3", tmp_path))]) == 0
    told = capfd.readouterr().out
    assert "certified" in told
    assert "what holds the motion back" in told
