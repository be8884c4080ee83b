"""``tp.compare``: the campaign of the command line, as an object."""

from __future__ import annotations

import csv
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.campaign import grid
from tpbso_casadi.cli.commands import compare as command
from tpbso_casadi.facade.comparing import known_to_workers, labelled, specs_of

ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0)
TASK: dict[str, Any] = {"start": [1.0, 0.0], "goal": [0.5, 1.5]}


@dataclass(frozen=True)
class Mine(tp.PSO):
    """A solver of one's own."""


@cache
def compared() -> tp.Comparison:
    return tp.compare(ARM, ["bso", tp.PSO(population=8), Mine], **TASK, runs=4, evaluations=60)


def test_every_run_is_there() -> None:
    comparison = compared()
    solvers = ["bso", "pso(population=8)", "Mine"]
    assert [row["solver"] for row in comparison.table] == solvers
    assert {(record.solver, record.seed) for record in comparison.records} == {
        (solver, seed) for solver in solvers for seed in range(1, 5)
    }
    assert comparison.failures == []
    assert repr(comparison) == "<comparison: 3 solvers on 1 scenarios, 12 runs>"


def test_numbers_are_those_of_the_plans() -> None:
    scenario = tp.scenario_of(ARM, **TASK, solver=Mine, evaluations=60, polish=False)
    own = [tp.plan(scenario, seed=seed) for seed in range(1, 5)]
    expected = [plan.objective if plan.certified else np.inf for plan in own]
    np.testing.assert_array_equal(compared().objectives["scenario 1", "Mine"], expected)
    row = compared().table[2]
    assert row["mean"] == pytest.approx(np.mean(expected), rel=1e-12)


def test_it_shows_itself(tmp_path: Path) -> None:
    comparison = compared()
    assert str(comparison).count("against bso") == 1
    assert comparison._repr_html_().count("<tr>") == 4
    assert comparison.plot()._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
    folder = comparison.save(tmp_path / "saved", plots=False)
    with (folder / "runs.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 12
    with (folder / "summary.csv").open() as file:
        assert [row["solver"] for row in csv.DictReader(file)] == [row["solver"] for row in comparison.table]


def test_as_data_frames() -> None:
    pytest.importorskip("pandas")
    assert len(compared().to_dataframe()) == 3
    assert len(compared().runs_to_dataframe()) == 12


def test_it_is_the_comparison_of_the_command_line_and_resumes_there(tmp_path: Path) -> None:
    options = ["--solvers", "pso,pso(c1=1.5)", "--runs", "2", "--evaluations", "40", "--workers", "1"]
    done: list[tuple[int, int]] = []

    def count(number: int, of: int) -> None:
        done.append((number, of))

    keys: dict[str, Any] = {"runs": 2, "evaluations": 40, "folder": tmp_path, "progress": count}
    comparison = tp.compare("time-2", "pso,pso(c1=1.5)", **keys)
    assert done == [(1, 4), (2, 4), (3, 4), (4, 4)]
    again = tp.compare("time-2", "pso,pso(c1=1.5)", **keys)
    assert len(done) == 4
    assert again.table == comparison.table
    before = (tmp_path / "summary.csv").read_bytes()
    assert command.main(["time-2", *options, "--out", str(tmp_path), "--quiet", "--no-plots"]) == 0
    assert (tmp_path / "summary.csv").read_bytes() == before


@pytest.mark.slow
def test_processes_change_nothing() -> None:
    keys: dict[str, Any] = {"runs": 2, "evaluations": 40}
    alone, together = (tp.compare("time-2", ["pso", "ga"], **keys, workers=workers) for workers in (1, 2))
    assert together.table == alone.table


def test_classes_of_a_notebook_stay_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    cells = ModuleType("__main__")
    noted = type("Noted", (tp.PSO,), {"__module__": "__main__", "__doc__": "Of a cell."})
    cells.Noted = noted  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "__main__", cells)
    scenarios = labelled(ARM, TASK)
    assert not known_to_workers(grid(scenarios, specs_of([noted]), [1]))
    assert known_to_workers(grid(scenarios, specs_of(["pso"]), [1]))
    assert tp.compare(ARM, [noted], **TASK, runs=1, evaluations=40, workers=2).failures == []


def test_labels() -> None:
    assert list(labelled({"near": "time-2", "far": "time-3"}, {})) == ["near", "far"]
    assert list(labelled(["time-2", tp.builtin("time-3")], {})) == ["time-2", "scenario 2"]
    assert list(labelled(ARM, TASK)) == ["scenario 1"]
    assert [spec.label for spec in specs_of({"mine": Mine, "theirs": "abso+polish2"})] == ["mine", "theirs"]
    assert [spec.label for spec in specs_of([tp.BSO(), tp.GA])] == ["bso", "ga"]


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        (lambda: tp.compare(["time-2", "time-2"], "pso"), "scenarios: time-2 is there twice; say a table"),
        (lambda: tp.compare("time-2", ["pso", tp.PSO]), "solvers: pso is there twice; say a table"),
        (lambda: tp.compare("time-2", []), "solvers: one at least is needed"),
        (lambda: tp.compare("time-2", [3]), "solver: 3 is none"),
        (lambda: tp.compare("time-2", "psoo"), "time-2: psoo: solver.name: no solver 'psoo'; did you mean pso"),
        (lambda: tp.compare("time-2", "pso", runs=10**6), "runs: a campaign has at most"),
        (lambda: tp.compare("time-2", "pso", runs=1, workers=10**6), "workers: more than"),
        (lambda: tp.compare("time-2", ["pso"], runs=0), "runs: 0 are none"),
    ],
)
def test_mistakes_take_one_line(call: Any, expected: str) -> None:
    with pytest.raises(ValueError, match=f"^{expected}"):
        call()
