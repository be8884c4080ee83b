"""What a comparison leaves: its figures and its page, what they say, that they fetch nothing, in a browser."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import combinations
from math import inf
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers.browser import fetched, opened
from helpers.comparisons import convergence, final, random_results, record, results
from helpers.running import campaigns_here
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from oracles.colour_vision import VISIONS, differences

from tpbso_casadi import builtin
from tpbso_casadi.cli.commands.compare import main
from tpbso_casadi.figures.palette import SERIES, colour_of
from tpbso_casadi.judging import page
from tpbso_casadi.judging.figures import comparison_figure, critical_difference_figure, ecdf_figure, effect_sizes_figure
from tpbso_casadi.judging.grid import grid, parse_solvers
from tpbso_casadi.judging.page import FIGURES as NAMES
from tpbso_casadi.judging.page import comparison_page, seeds, solver_rows
from tpbso_casadi.judging.page_figures import FIGURES, drawing_of, inline_svg, pictures_of
from tpbso_casadi.judging.results import PolishGain, Results
from tpbso_casadi.judging.run import Run
from tpbso_casadi.judging.targets import PLANS


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What a command leaves."""
    folder = tmp_path_factory.mktemp("compare")
    arguments = ["time-2", "rotation-2", "--solvers", "bso,pso(c1=1.5)", "--runs", "4", "--evaluations", "100"]
    with pytest.MonkeyPatch.context() as patch:
        campaigns_here(patch)
        assert main([*arguments, "--workers", "1", "--quiet", "--figures", "svg", "--out", str(folder)]) == 0
    return folder


def test_a_command_leaves_figures_of_the_formats_asked_for(folder: Path) -> None:
    written = {path.name for path in folder.iterdir() if path.suffix in {".png", ".svg", ".pdf"}}
    assert written == {"comparison.svg", "ecdf.svg", "effect-sizes.svg"}


def test_the_page_says_what_was_run_and_how_to_repeat_it(folder: Path) -> None:
    text = (folder / "comparison.html").read_text()
    assert "<h1>Comparison of 2 solvers on 2 cases</h1>" in text
    assert "tpbso compare time-2 rotation-2 --solvers &#39;bso,pso(c1=1.5)&#39; --runs 4" in text
    assert "with seeds 1 to 4" in text and "c1 = 1.5" in text and "100 evaluations" in text
    assert "Left out: it needs 3 solvers, here are 2." in text
    assert text.count('<svg class="figure" role="img" aria-label=') == 5  # three figures, two plans
    assert "casadi 3." in text and "numpy 2." in text


def test_the_page_fetches_nothing_and_its_identifiers_are_unique(folder: Path) -> None:
    text = (folder / "comparison.html").read_text()
    assert fetched(text) == []
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(set(ids)) == len(ids)


@pytest.mark.process
def test_the_page_opens_in_a_browser_without_complaints(folder: Path, tmp_path: Path) -> None:
    document = opened(folder / "comparison.html", tmp_path)
    assert document.count("<table") == 4 and document.count("<svg") == 5


def test_the_command_on_the_page_gives_the_same_table(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    campaigns_here(monkeypatch)
    text = (folder / "comparison.html").read_text()
    found = re.search(r"<code>tpbso compare ([^<]+)</code>", text)
    assert found is not None
    arguments = found[1].replace("&#39;", "").split()
    arguments[arguments.index("--out") + 1] = str(tmp_path)
    assert main([*arguments, "--no-plots"]) == 0
    assert (tmp_path / "summary.csv").read_bytes() == (folder / "summary.csv").read_bytes()
    page = (tmp_path / "comparison.html").read_text()
    assert "No figures were drawn" in page and "<svg" not in page


def page_of(found: Results, runs: list[Run] | None = None) -> str:
    runs = grid({"x": builtin("time-2")}, parse_solvers("bso,pso"), (1,)) if runs is None else runs
    return comparison_page(found, runs, [], "", [], {})


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
    limited = scenario.replaced(solver=scenario.solver.replaced(**table))
    rows = solver_rows([Run("x", "a", limited), Run("y", "a", scenario)])
    assert '<td class="words">polished from 2 candidates</td>' in page_of(
        results({("x", "bso+polish2"): final([1.0])}), grid({"x": scenario}, parse_solvers("bso+polish2"), (1,))
    )
    assert [row["budget"] for row in rows] == ["100 evaluations or 1 iteration or 2.5 s; 30000 evaluations"]
    assert [
        seeds(grid({"x": scenario}, parse_solvers("bso"), s)) for s in ((), (3,), (1, 2), (1, 2, 3), (1, 3, 5))
    ] == ["none", "3", "1, 2", "1 to 3", "1, 3, 5"]


STYLE = Path(page.__file__).with_name("page.css").read_text()


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


def polished() -> list[PolishGain]:
    """Of two cases: refined, discarded, and with a plan only after the polish."""
    before, after, kept = np.array([2.0, 2.0, inf]), np.array([1.5, 2.5, 1.6]), np.array([True, False, True])
    ends = {"before": before, "after": after, "kept": kept, "seconds": np.ones(3)}
    return [PolishGain(case=f"case-{case}", solver="solver-0", unit="s", **ends) for case in range(2)]


FULL = replace(random_results(cases=7, solvers=3, runs=4), polish_gains=polished())


def texts(axes: object) -> list[str]:
    return [text.get_text() for text in axes.texts]  # type: ignore[attr-defined]


def test_the_names_of_the_files_are_known_without_matplotlib() -> None:
    assert tuple(kind.name for kind in FIGURES) == NAMES


def reasons(found: Results) -> dict[str, str]:
    return {kind.name: kind.left_out(found) for kind in FIGURES}


def test_figures_that_make_no_sense_are_left_out_and_say_why() -> None:
    assert set(reasons(FULL).values()) == {""} and all(kind.reading.endswith(".") for kind in FIGURES)
    one = reasons(random_results(cases=1, solvers=1, runs=4))
    assert one == {
        "comparison": "",
        "polish": "nothing was polished; say, for one, bso+polish",
        "ecdf": "",
        "critical-difference": "it needs 3 solvers, here is 1",
        "effect-sizes": "it needs 2 solvers, here is 1",
    }
    few = reasons(random_results(cases=2, solvers=3, runs=3))
    assert few["effect-sizes"] == "it needs 4 runs of each solver on each case, here are 3"
    expected = "no difference between 3 solvers can be significant on fewer than 7 cases, here are 2"
    assert few["critical-difference"] == expected
    nothing = reasons(results({("x", "a"): final([None] * 4), ("x", "b"): final([None] * 4)}))
    assert set(nothing.values()) == {"no run has a certified plan"}
    many = reasons(random_results(cases=61, solvers=2, runs=4))
    assert many["comparison"] == many["effect-sizes"] == "it has a panel a case, and 61 are more than 60"


def test_the_comparison_shows_gaps_and_says_who_has_no_plan() -> None:
    found = results(
        {
            ("x", "a"): [[(10.0, 3.0), (50.0, 2.0)]] * 3 + [[]],
            ("x", "b"): [[(20.0, 4.0)]] * 4,
            ("empty", "a"): final([None]),
            ("empty", "b"): final([None]),
        }
    )
    figure = comparison_figure(found)
    left, right, empty, _ = figure.axes
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["a", "b"]
    a = next(line for line in left.lines if line.get_color() == colour_of(0))
    x, y = np.array(a.get_data(), dtype=np.float64)
    assert np.nanmin(y) == PLANS.drawn and np.nanmax(y) == pytest.approx(0.5)  # 3 and 2 over the best, 2
    assert x[np.isfinite(y)][0] == pytest.approx(10.0, rel=0.05)
    assert left.get_ylabel() == "gap to 2 s" and left.get_title(loc="left") == "x"
    assert texts(right) == ["1/4"] and right.get_title(loc="left") == "runs without a plan:"
    assert texts(empty) == ["no run has a certified plan"]


LONG = (
    "bso", "bso(lambda_=0.4,antenna_sign=printed)+polish12", "abso+polish", "ipopt",
    "my_package.my_module:MyVeryOwnSolver(rate=0.25)", "lshade(memory_size=6,archive_rate=1.4)",
)  # fmt: skip
CASE = "pick-and-place-with-a-very-long-name_of_a_scenario_file-2026-11-26"


def boxes(figure: Figure) -> dict[tuple[str, int], Bbox]:
    """Where each text of a figure is drawn, pixels."""
    figure.draw_without_rendering()
    every = [axis for axes in figure.axes for axis in (axes.xaxis, axes.yaxis)]
    ticks = [(tick, *sorted(axis.get_view_interval())) for axis in every for tick in axis.get_major_ticks()]
    off = {tick.label1 for tick, low, high in ticks if not low <= tick.get_loc() <= high}
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    drawn = [text for text in texts if text not in off and not (text.axes is not None and not text.axes.axison)]
    return {(text.get_text(), number): Text.get_window_extent(text) for number, text in enumerate(drawn)}


@pytest.mark.parametrize(
    ("solvers", "cases"),
    [
        pytest.param(LONG[1:5:3], (CASE,), id="long"),
        *(
            pytest.param(solvers, cases, id=f"{len(solvers)}-{len(cases)}", marks=pytest.mark.slow)
            for solvers in (LONG[:2], LONG)
            for cases in (("time-3",), (CASE, f"{CASE}-2", "time-3"))
        ),
    ],
)
def test_no_title_is_cut_and_no_label_covers_another(solvers: tuple[str, ...], cases: tuple[str, ...]) -> None:
    plans = {solver: final([1.0 + rank, 1.1, 1.2, None]) for rank, solver in enumerate(solvers)}
    found = results({(case, solver): plans[solver] for case in cases for solver in solvers}, done=30_000)
    for draw in (comparison_figure, ecdf_figure, effect_sizes_figure):
        figure = draw(found)
        where = boxes(figure)
        shown = " ".join(text for text, _ in where).replace("\n", "")
        assert all(name in shown for name in solvers), draw
        low, high = figure.bbox.padded(1.0).get_points()
        cut = [text for text, box in where.items() if (box.min < low).any() or (box.max > high).any()]
        assert not cut, draw
        over = [(a, b) for (a, one), (b, other) in combinations(where.items(), 2) if one.padded(-1).overlaps(other)]
        assert not over, draw


def test_the_ecdf_ends_at_the_share_of_targets_reached() -> None:
    found = results({("x", "a"): final([2.0]), ("x", "b"): final([4.0]), ("x", "c"): final([None])})
    [axes] = ecdf_figure(found).axes
    ends = {line.get_color(): line.get_ydata()[-1] for line in axes.lines}  # type: ignore[index]
    assert ends[colour_of(0)] == 1.0
    assert ends[colour_of(1)] == pytest.approx(11 / 51)  # gap 1: of the targets from 10 to 0.0001 eleven
    assert ends[colour_of(2)] == 0.0
    assert texts(axes) == ["a", "b", "c"]


def test_the_critical_difference_diagram_has_ranks_and_bars() -> None:
    [axes] = critical_difference_figure(FULL).axes
    shown = texts(axes)
    assert {"solver-2  1.00", "solver-1  2.00", "3.00  solver-0"} <= set(shown)
    assert [line for line in axes.lines if line.get_linewidth() == 4.0] == []  # all differ
    alike = results({(f"case-{n}", s): final([1.0] * 4) for n in range(7) for s in "abc"})
    [axes] = critical_difference_figure(alike).axes
    [bar] = [line for line in axes.lines if line.get_linewidth() == 4.0]
    assert np.ptp(np.asarray(bar.get_xdata())) == pytest.approx(0.08)
    assert "p = 1.000" in axes.get_title(loc="left")


def test_effect_sizes_are_written_in_the_cells() -> None:
    found = results({("x", "a"): final([1.0, 2.0, 3.0]), ("x", "b"): final([2.0, 5.0, None])})
    [axes] = effect_sizes_figure(found).axes
    assert texts(axes) == ["0.83", "0.17"]  # (3 + 2.5 + 2) / 9
    two = results({(case, solver): final([1.0 + (solver == "b")] * 4) for case in "xy" for solver in "ab"})
    assert [axes.get_title(loc="right") for axes in effect_sizes_figure(two).axes] == ["mean over cases", "x", "y"]


def test_files_are_written_and_old_ones_of_what_is_left_out_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    empty = [replace(kind, draw=lambda results: Figure()) for kind in FIGURES]
    monkeypatch.setattr("tpbso_casadi.judging.page_figures.FIGURES", empty)
    few = random_results(cases=1, solvers=2, runs=1)
    pictures_of(tmp_path, few, ["svg"])
    assert {path.name for path in tmp_path.iterdir()} == {"comparison.svg", "ecdf.svg"}
    (tmp_path / "ecdf.png").touch()
    pictures_of(tmp_path, replace(few, records=[replace(each, feasible=False) for each in few.records]), ["svg"])
    assert [path.name for path in tmp_path.iterdir()] == ["ecdf.png"]  # of a format that was not asked for


def test_one_figure_by_its_name() -> None:
    assert drawing_of("critical-difference", FULL).axes
    with pytest.raises(
        ValueError, match=r"^'ecfd' is no figure of a comparison: say comparison, polish, ecdf, critical"
    ):
        drawing_of("ecfd", FULL)
    with pytest.raises(ValueError, match=r"^effect-sizes is left out: it needs 2 solvers, here is 1$"):
        drawing_of("effect-sizes", random_results(cases=1, solvers=1, runs=4))


def test_a_figure_within_a_page_takes_its_colours() -> None:
    svg = inline_svg(ecdf_figure(FULL), "ecdf", 'of "a" & <b>')
    root = ElementTree.fromstring(svg)
    assert root.attrib["aria-label"] == 'of "a" & <b>' and root.attrib["role"] == "img"
    ids = [element.attrib["id"] for element in root.iter() if "id" in element.attrib]
    assert ids and all(name.startswith("ecdf-") for name in ids) and len(set(ids)) == len(ids)
    assert "#000000" not in svg and colour_of(0) not in svg and "var(--series-0)" in svg
    assert inline_svg(ecdf_figure(FULL), "ecdf", 'of "a" & <b>') == svg
