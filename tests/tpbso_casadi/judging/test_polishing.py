"""What a polish gains, seed by seed: by hand, and from stored runs to the table, the figure and the page."""

from __future__ import annotations

import csv
import json
from math import inf
from pathlib import Path

import pytest

import tpbso_casadi as tp
from tpbso_casadi.judging.polishing import HEADER, PolishedRun, gains_of, percent


def run(seed: int, before: float, after: float, kept: bool, seconds: float = 1.0) -> PolishedRun:
    return PolishedRun(case="a", solver="s", seed=seed, before=before, after=after, kept=kept, seconds=seconds)


RUNS = [run(1, 2.0, 1.0, True, 0.5), run(2, 4.0, 5.0, False, 2.0), run(3, inf, 1.5, True), run(4, 1.0, 0.9, True)]


def test_gains_by_hand() -> None:
    (gain,) = gains_of(RUNS, {"a": "s"})
    assert [each.gain for each in RUNS] == [0.5, 0.0, inf, pytest.approx(0.1)]
    assert [each.final for each in RUNS] == [1.0, 4.0, 1.5, 0.9]
    assert (gain.kept, gain.made_feasible, gain.seconds) == (3, 1, 1.0)
    lower, median, upper = gain.gains
    assert (lower, median, upper) == (pytest.approx(0.075), pytest.approx(0.3), inf)
    assert gain.row == ["a", "s", "s", 4, 3, 1, 3.0, 1.25, pytest.approx(0.3), pytest.approx(0.075), None]
    assert (percent(0.3), percent(upper)) == ("30.00%", "a plan where there was none")


def test_nothing_found_is_no_gain() -> None:
    (gain,) = gains_of([run(1, inf, inf, False)], {})
    assert gain.gains == (0.0, 0.0, 0.0) and gain.made_feasible == 0 and gain.row[6:8] == [None, None]


def test_it_is_that_of_each_run_and_stands_in_table_figure_and_page(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    compared = tp.compare(["time-2"], "pso+polish,pso", runs=3, evaluations=300, folder=folder)
    (gain,) = compared.results.polish_gains
    assert [each.seed for each in gain.runs] == [1, 2, 3] and gain.solver == "pso+polish"
    for each in gain.runs:
        plan = tp.plan("time-2", solver="pso", polish=True, evaluations=300, seed=each.seed)
        polish = json.loads(plan.result.to_json())["polish"]
        assert (each.before, each.after, each.kept) == (
            polish["before"]["objective"], polish["after"]["objective"], polish["accepted"]
        )  # fmt: skip
    (row,) = compared.polish_table
    assert row["kept"] == gain.kept > 0 and row["median_gain"] == gain.gains[1] > 0.0
    with (folder / "polish.csv").open() as file:
        assert next(csv.reader(file)) == list(HEADER)
    assert (folder / "polish.png").stat().st_size > 10_000
    page = (folder / "comparison.html").read_text()
    assert "The polish, in numbers" in page and f"{gain.kept} of 3" in page
    assert "the polish by IPOPT, seed by seed: time-2 [s]" in str(compared)
    with pytest.raises(ValueError, match="polish is left out: nothing was polished"):
        tp.compare(["time-2"], ["pso"], runs=2, evaluations=100).plot("polish")
