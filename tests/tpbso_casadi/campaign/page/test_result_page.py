"""The result page: what it says, that it fetches nothing, and in a browser."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from helpers.browser import fetched, opened
from helpers.comparisons import convergence, final, record, results
from matplotlib.colors import to_rgb
from oracles.colour_vision import VISIONS, differences

from tpbso_casadi import builtin
from tpbso_casadi.campaign import Results, Run, Store, best_runs, grid, parse_solvers, results_of, write_comparison
from tpbso_casadi.campaign import page as comparison_page
from tpbso_casadi.campaign.measures import PLANS
from tpbso_casadi.campaign.page import render, seeds, solver_rows
from tpbso_casadi.campaign.run import run_one
from tpbso_casadi.cli.commands.compare import main
from tpbso_casadi.figures.palette import SERIES


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a command leaves."""
    folder = tmp_path_factory.mktemp("compare")
    arguments = ["time-2", "rotation-2", "--solvers", "bso,pso(c1=1.5)", "--runs", "4", "--evaluations", "300"]
    assert main([*arguments, "--workers", "1", "--quiet", "--figures", "svg,pdf", "--out", str(folder)]) == 0
    return folder


def test_a_command_leaves_figures_of_the_formats_asked_for(folder: Path) -> None:
    written = {path.name for path in folder.iterdir() if path.suffix in {".png", ".svg", ".pdf"}}
    assert written == {f"{name}.{kind}" for name in ("comparison", "ecdf", "effect-sizes") for kind in ("svg", "pdf")}


def test_the_page_says_what_was_run_and_how_to_repeat_it(folder: Path) -> None:
    text = (folder / "comparison.html").read_text()
    assert "<h1>Comparison of 2 solvers on 2 cases</h1>" in text
    assert "tpbso compare time-2 rotation-2 --solvers &#39;bso,pso(c1=1.5)&#39; --runs 4" in text
    assert "with seeds 1 to 4" in text and "c1 = 1.5" in text and "300 evaluations" in text
    assert "Left out: it needs 3 solvers, here are 2." in text
    assert text.count('<svg class="figure" role="img" aria-label=') == 5  # three figures, two plans
    assert "casadi 3." in text and "numpy 2." in text


def test_the_page_fetches_nothing_and_its_identifiers_are_unique(folder: Path) -> None:
    text = (folder / "comparison.html").read_text()
    assert fetched(text) == []
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(set(ids)) == len(ids)


def test_the_page_opens_in_a_browser_without_complaints(folder: Path, tmp_path: Path) -> None:
    document = opened(folder / "comparison.html", tmp_path)
    assert document.count("<table") == 4 and document.count("<svg") == 5


def test_the_command_on_the_page_gives_the_same_table(folder: Path, tmp_path: Path) -> None:
    text = (folder / "comparison.html").read_text()
    found = re.search(r"<code>tpbso compare ([^<]+)</code>", text)
    assert found is not None
    arguments = found[1].replace("&#39;", "").split()
    arguments[arguments.index("--out") + 1] = str(tmp_path)
    assert main([*arguments, "--no-plots"]) == 0
    assert (tmp_path / "summary.csv").read_bytes() == (folder / "summary.csv").read_bytes()
    page = (tmp_path / "comparison.html").read_text()
    assert "No figures were drawn" in page and "<svg" not in page


def test_the_key_on_the_page_leads_to_the_best_plan(folder: Path) -> None:
    text = (folder / "comparison.html").read_text()
    keys = re.findall(r"<code>([0-9a-f]{32})</code>", text)
    with Store(folder / "runs.sqlite") as store:
        assert len(keys) == 2 and set(keys) <= store.done()


def page_of(found: Results, runs: list[Run] | None = None) -> str:
    runs = grid({"x": builtin("time-2")}, parse_solvers("bso,pso"), (1,)) if runs is None else runs
    return render(found, runs, [], "", [], {})


def test_failed_and_missing_runs_and_cases_without_a_plan_are_said() -> None:
    found = results({("x", "bso"): final([None])})
    failed = record("x", "<b>", 2, [], error="E: <i>"), convergence([], 0, "x", "<b>", 2)
    text = page_of(Results([*found.records, failed[0]], [*found.convergences, failed[1]]))
    assert "1 runs failed" in text and "E: &lt;i&gt;" in text and "&lt;b&gt;" in text
    assert "No run has a certified plan." in text
    assert "1 runs are missing" in page_of(found)
    assert "The same runs" not in text  # no command is known


def test_budgets_and_seeds_in_words() -> None:
    scenario = builtin("time-2")
    table = {"evaluations": 100, "iterations": 1, "time_limit": 2.5}
    limited = scenario.model_copy(update={"solver": scenario.solver.model_copy(update=table)})
    rows = solver_rows([Run("x", "a", limited), Run("y", "a", scenario)])
    assert '<td class="words">polished from 2 candidates</td>' in page_of(
        results({("x", "bso+polish2"): final([1.0])}), grid({"x": scenario}, parse_solvers("bso+polish2"), (1,))
    )
    assert [row.budget for row in rows] == ["100 evaluations or 1 iteration or 2.5 s; 30000 evaluations"]
    assert [
        seeds(grid({"x": scenario}, parse_solvers("bso"), s)) for s in ((), (3,), (1, 2), (1, 2, 3), (1, 3, 5))
    ] == [
        "none",
        "3",
        "1, 2",
        "1 to 3",
        "1, 3, 5",
    ]


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0 %"), (5e-5, "< 0.01 %"), (0.01234, "1.23 %"), (float("inf"), "-"), (float("nan"), "-")]
)
def test_percentages(value: float, text: str) -> None:
    assert PLANS.shown(value) == text


def test_one_run_of_one_solver_has_a_page(tmp_path: Path) -> None:
    [run] = runs = grid({"time-2": builtin("time-2")}, parse_solvers("bso"), (1,))
    with Store(tmp_path / "runs.sqlite") as store:
        store.add(run, run_one(*run.task))
        found, best = results_of(runs, store), best_runs(runs, store)
    write_comparison(tmp_path, found, runs, best)
    text = (tmp_path / "comparison.html").read_text()
    assert "<h1>Comparison of 1 solver on 1 case</h1>" in text and text.count("Left out: ") == 2


STYLE = Path(comparison_page.__file__).with_name("comparison.css").read_text()


def palettes() -> list[list[str]]:
    """The series of the page on a light and on a dark ground."""
    found = re.findall(r"--series-\d: ([^;]+);", STYLE)
    return [found[:6], found[7:]]


def test_the_series_of_a_page_are_those_of_figures_on_a_light_ground() -> None:
    light, dark = palettes()
    assert tuple(light) == SERIES[:6] and len(dark) == 6


@pytest.mark.parametrize("vision", VISIONS)
def test_no_two_series_look_alike_on_a_dark_ground(vision: str) -> None:
    ink, ground = "#e4e9ee", "#14181d"
    assert f"--ground: {ground}; --ink: {ink}" in STYLE
    between = differences(np.array([to_rgb(colour) for colour in (*palettes()[1], ink, ground)]), vision)
    between += np.diag(np.full(len(between), np.inf))
    assert between[:-1, :-1].min() > 22.0 and between[-1].min() > 35.0
