"""``tp.compare``: the campaign of the command line, as an object; ``tp.pareto``: a front of certified plans."""

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
from tpbso_casadi.cli.commands import compare as command
from tpbso_casadi.facade.comparing import known_to_workers, labelled, specs_of
from tpbso_casadi.judging.grid import grid

ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0)
TASK: dict[str, Any] = {"start": [1.0, 0.0], "goal": [0.5, 1.5], "retime": False}


@dataclass(frozen=True)
class Mine(tp.PSO):
    """A solver of one's own."""


@cache
def compared() -> tp.Comparison:
    return tp.compare(ARM, ["bso", tp.PSO(population=8), Mine], **TASK, runs=2, evaluations=60)


def test_every_run_is_there() -> None:
    comparison = compared()
    solvers = ["bso", "pso(population=8)", "Mine"]
    assert [row["solver"] for row in comparison.table] == solvers
    assert {(record.solver, record.seed) for record in comparison.records} == {
        (solver, seed) for solver in solvers for seed in (1, 2)
    }
    assert comparison.failures == []
    assert repr(comparison) == "<comparison: 3 solvers on 1 scenarios, 6 runs>"


def test_numbers_are_those_of_the_plans() -> None:
    scenario = tp.scenario_of(ARM, **TASK, solver=Mine, evaluations=60, polish=False)
    own = [tp.plan(scenario, seed=seed) for seed in (1, 2)]
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
        assert len(list(csv.DictReader(file))) == len(comparison.runs_to_dataframe()) == 6
    with (folder / "summary.csv").open() as file:
        assert [row["solver"] for row in csv.DictReader(file)] == [row["solver"] for row in comparison.table]
    assert len(comparison.to_dataframe()) == 3


def test_it_is_the_comparison_of_the_command_line_and_resumes_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done: list[tuple[int, int]] = []
    save = tp.Comparison.save
    monkeypatch.setattr(tp.Comparison, "save", lambda comparison, folder: save(comparison, folder, plots=False))
    keys: dict[str, Any] = {"runs": 2, "evaluations": 40, "folder": tmp_path}
    comparison, again = (
        tp.compare("time-2", "pso,pso(c1=1.5)", **keys, progress=lambda *number: done.append(number)) for _ in range(2)
    )
    assert done == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert again.table == comparison.table
    before = (tmp_path / "summary.csv").read_bytes()
    options = ["--solvers", "pso,pso(c1=1.5)", "--runs", "2", "--evaluations", "40", "--workers", "1"]
    assert command.main(["time-2", *options, "--out", str(tmp_path), "--quiet", "--no-plots"]) == 0
    assert (tmp_path / "summary.csv").read_bytes() == before


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


FRONT: dict[str, Any] = TASK | {"retime": True, "solver": "pso", "pieces": 3, "samples": 15}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("pareto") / "front"


@pytest.fixture(scope="module")
def front(folder: Path) -> tp.Front:
    return tp.pareto(ARM, ("time", "rotation"), points=2, **FRONT, evaluations=60, folder=folder)


def test_every_point_is_a_certified_plan_that_no_other_dominates(front: tp.Front) -> None:
    values = front.values
    assert len(front) == len(values) >= 2
    assert (np.diff(values[:, 0]) > 0.0).all()
    assert (np.diff(values[:, 1]) < 0.0).all()
    for plan, (time, rotation), point in zip(front.plans, values, front.points, strict=True):
        assert plan.certified
        assert plan.duration == pytest.approx(time, rel=1e-9)
        assert point.duration == plan.duration
        turned = np.abs(np.diff(plan.trajectory.at(np.linspace(0.0, plan.duration, 20_001)), axis=0)).sum()
        assert turned == pytest.approx(rotation, rel=1e-6)


def test_a_front_shows_itself(front: tp.Front, tmp_path: Path) -> None:
    assert repr(front).startswith(f"<front: {len(front)} certified plans, time [s] ")
    page = front._repr_html_()
    assert page.count("<tr>") == 1 + len(front)
    assert "data:image/png" in page
    assert front.plot()._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
    assert list(front.to_dataframe().columns) == ["point", "time [s]", "rotation [rad]", "duration [s]"]
    with pytest.raises(ValueError, match="figures: there is no kind 'jpg'; there are png, pdf, svg"):
        front.save(tmp_path, figures="jpg")
    assert not list(tmp_path.iterdir())


def test_the_folder_keeps_it_and_resumes(front: tp.Front, folder: Path) -> None:
    assert {path.name for path in folder.iterdir()} >= {"front.csv", "front.png", "points", "front.json"}
    made: list[Any] = []
    keys: dict[str, Any] = {"points": 2, **FRONT, "evaluations": 60, "folder": folder, "told": made.append}
    again = tp.pareto(ARM, ("time", "rotation"), figures=["pdf", "svg"], **keys)
    assert {path.name for path in folder.glob("front.*")} >= {"front.pdf", "front.svg"}
    assert front.save(folder / "svg", figures=["svg"]).joinpath("front.svg").exists()
    assert not list((folder / "svg").glob("*.png"))
    assert made == []
    np.testing.assert_array_equal(again.values, front.values)
    with pytest.raises(tp.OutputError, match="was made with"):
        tp.pareto(ARM, ("time", "length"), **keys)


def test_a_front_in_which_nothing_is_certified_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    blocked = [tp.Rectangle((0.9, 0.9), (0.2, 0.2))]
    with pytest.raises(tp.ScenarioError, match="no plan is certified, not even at an end of the front"):
        tp.pareto("time-3", ("time", "rotation"), 2, obstacles=blocked, solver="pso", evaluations=8, population=4)
