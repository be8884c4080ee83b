"""``tpbso compare function:...`` and ``--format``: tables, logs, figures, errors."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from helpers.running import campaigns_here, status

import tpbso_casadi as tp
from tpbso_casadi.cli.commands.compare import main

FUNCTIONS = ["function:sphere-3", "function:rastrigin-2@4"]
SMALL = ["--runs", "2", "--evaluations", "200", "--quiet", "--workers", "1"]


pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


@pytest.fixture(autouse=True)
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    campaigns_here(monkeypatch)


def run(*arguments: str) -> int:
    return status(main, *arguments)


def test_functions_are_compared_as_scenarios_are(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(*FUNCTIONS, "--solvers", "pso,bso(c1=1.5)", *SMALL, "--no-plots", "--format", "coco,ioh") == 0
    with Path("runs/compare/summary.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["case"], row["solver"]) for row in rows] == [
        *(("sphere-3", "pso"), ("sphere-3", "bso(c1=1.5)")),
        *(("rastrigin-2@4", "pso"), ("rastrigin-2@4", "bso(c1=1.5)")),
    ]
    function = tp.benchmark_function("rastrigin-2@4")
    alone = [tp.minimize(function, function.bounds, tp.BSO(c1=1.5), 200, seed, vectorized=True) for seed in (1, 2)]
    assert float(rows[3]["mean"]) == pytest.approx(np.mean([result.cost for result in alone]), rel=1e-12)
    assert rows[3]["unit"] == "above minimum"
    assert all(row["median_gap"] == row["median"] != "" for row in rows)  # to the minimum, absolutely
    assert run(*FUNCTIONS, "--solvers", "pso,bso(c1=1.5)", *SMALL, "--no-plots", "--json") == 0
    assert [row["mean"] for row in json.loads(capsys.readouterr().out)] == [float(row["mean"]) for row in rows]
    assert Path("runs/compare/coco/cases.txt").read_text().startswith("f1: sphere-3\nf2: rastrigin-2@4\n")
    meta = json.loads(Path("runs/compare/ioh/bso_c1=1.5/IOHprofiler_f2_rastrigin-2-4.json").read_text())
    assert [described["evals"] for described in meta["scenarios"][0]["runs"]] == [200, 200]
    lowest = [described["best"]["y"] for described in meta["scenarios"][0]["runs"]]
    assert lowest == pytest.approx([result.cost for result in alone], rel=1e-12)


@pytest.mark.slow
def test_functions_have_figures_and_a_page() -> None:
    arguments = [*FUNCTIONS, "--solvers", "pso,bso", "--runs", "4", *SMALL[2:]]
    assert run(*arguments) == 0
    written = {path.name for path in Path("runs/compare").glob("*.png")}
    assert written == {"comparison.png", "ecdf.png", "effect-sizes.png"}
    page = Path("runs/compare/comparison.html").read_text()
    assert page.count('<svg class="figure"') == 3  # and no motions
    assert "51 gaps to\nthe known minimum of the function, from 100 to 1e-08" in page
    assert "the lowest value of every run" in page and "certified" not in page and "plan" not in visible(page)
    assert "where 0 is the minimum, at x = (" in page
    assert run(*arguments, "--no-plots") == 0
    assert "No figures were drawn" in Path("runs/compare/comparison.html").read_text()


def visible(page: str) -> str:
    """What a reader reads, without style and drawings."""
    return re.sub(r"<style>.*?</style>|<svg.*?</svg>|<[^>]*>", "", page, flags=re.DOTALL)
