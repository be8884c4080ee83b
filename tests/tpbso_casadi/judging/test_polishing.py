"""What a polish gains, seed by seed: by hand, and from stored runs to the table, the figure and the page."""

from __future__ import annotations

import csv
import json
from math import inf
from pathlib import Path

import numpy as np
import pytest

import tpbso_casadi as tp
from tpbso_casadi.judging.results import POLISH_HEADER, PolishGain
from tpbso_casadi.judging.targets import percent


def gain_of(*runs: tuple[float, float, bool, float]) -> PolishGain:
    before, after, kept, seconds = (np.array(column) for column in zip(*runs, strict=True))
    return PolishGain(case="a", solver="s", unit="s", before=before, after=after, kept=kept, seconds=seconds)


def test_gains_by_hand() -> None:
    gain = gain_of((2.0, 1.0, True, 0.5), (4.0, 5.0, False, 2.0), (inf, 1.5, True, 1.0), (1.0, 0.9, True, 1.0))
    assert gain.of_runs.tolist() == [0.5, 0.0, inf, pytest.approx(0.1)]
    assert gain.final.tolist() == [1.0, 4.0, 1.5, 0.9]
    assert (gain.kept.sum(), gain.made_feasible, gain.median_seconds) == (3, 1, 1.0)
    lower, median, upper = gain.gains
    assert (lower, median, upper) == (pytest.approx(0.075), pytest.approx(0.3), inf)
    assert gain.row == ["a", "s", "s", 4, 3, 1, 3.0, 1.25, pytest.approx(0.3), pytest.approx(0.075), None]
    assert (percent(0.3), percent(upper)) == ("30.00%", "a plan where there was none")


def test_nothing_found_is_no_gain() -> None:
    gain = gain_of((inf, inf, False, 1.0))
    assert gain.gains == (0.0, 0.0, 0.0) and gain.made_feasible == 0 and gain.row[6:8] == [None, None]


def test_it_is_that_of_each_run_and_stands_in_table_figure_and_page(tmp_path: Path) -> None:
    folder = tmp_path / "out"
    compared = tp.compare(["time-2"], "pso+polish,pso", runs=2, evaluations=100, folder=folder)
    (gain,) = compared.results.polish_gains
    assert gain.kept.size == 2 and gain.solver == "pso+polish"
    plan = tp.plan("time-2", solver="pso", polish=True, evaluations=100, seed=2)
    polish = json.loads(plan.result.to_json())["polish"]
    assert (gain.before[1], gain.after[1], gain.kept[1]) == (
        polish["before"]["objective"], polish["after"]["objective"], polish["accepted"]
    )  # fmt: skip
    (row,) = compared.polish_table
    assert row["kept"] == gain.kept.sum() > 0 and row["median_gain"] == gain.gains[1] > 0.0
    with (folder / "polish.csv").open() as file:
        assert next(csv.reader(file)) == list(POLISH_HEADER)
    assert (folder / "polish.png").stat().st_size > 10_000
    page = (folder / "comparison.html").read_text()
    assert "The polish, in numbers" in page and f"{gain.kept.sum()} of 2" in page
    assert "the polish by IPOPT, seed by seed: time-2 [s]" in str(compared)
    with pytest.raises(ValueError, match="polish is left out: nothing was polished"):
        tp.compare(["function:sphere-2"], ["pso"], runs=1, evaluations=10).plot("polish")
