"""The figures of a comparison: what they show, when they are left out, and as files."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers.comparisons import final, random_results, results
from matplotlib.figure import Figure

from tpbso_casadi.campaign import Results
from tpbso_casadi.campaign.comparison_figures import (
    comparison_figure,
    critical_difference_figure,
    ecdf_figure,
    effect_sizes_figure,
)
from tpbso_casadi.campaign.drawn_figures import FIGURES, Drawing, FigureKind, drawing_of, inline_svg, write_figures
from tpbso_casadi.campaign.measures import PLANS
from tpbso_casadi.campaign.tables import FIGURES as NAMES
from tpbso_casadi.figures.palette import colour_of

INF = np.inf
FULL = random_results(cases=7, solvers=3, runs=4)
each_kind = pytest.mark.parametrize("kind", FIGURES, ids=lambda kind: kind.name)


def texts(axes: object) -> list[str]:
    return [text.get_text() for text in axes.texts]  # type: ignore[attr-defined]


def test_the_names_of_the_files_are_known_without_matplotlib() -> None:
    assert tuple(kind.name for kind in FIGURES) == NAMES


@each_kind
def test_every_figure_is_drawn_where_it_makes_sense(kind: FigureKind) -> None:
    assert kind.left_out(FULL) == ""
    assert kind.draw(FULL).axes
    assert kind.reading.endswith(".")


def reasons(found: Results) -> dict[str, str]:
    return {kind.name: kind.left_out(found) for kind in FIGURES}


def test_figures_that_make_no_sense_are_left_out_and_say_why() -> None:
    one = reasons(random_results(cases=1, solvers=1, runs=4))
    assert one == {
        "comparison": "",
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
    left, right, empty, _ = comparison_figure(found).axes
    a = next(line for line in left.lines if line.get_color() == colour_of(0))
    x, y = np.array(a.get_data(), dtype=np.float64)
    assert np.nanmin(y) == PLANS.drawn and np.nanmax(y) == pytest.approx(0.5)  # 3 and 2 over the best, 2
    assert x[np.isfinite(y)][0] == pytest.approx(10.0, rel=0.05)
    assert left.get_ylabel() == "gap to 2 s" and left.get_title(loc="left") == "x"
    assert texts(left) == ["a", "b"]  # at the ends of the lines
    assert texts(right) == ["1 of 4\nno plan"]
    assert texts(empty) == ["no run has a certified plan"]


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
    assert [axes.get_title() for axes in effect_sizes_figure(two).axes] == ["mean over cases", "x", "y"]


def test_files_are_written_and_old_ones_of_what_is_left_out_removed(tmp_path: Path) -> None:
    write_figures(tmp_path, [Drawing(kind, Figure(), "") for kind in FIGURES], ["svg"])
    assert {path.name for path in tmp_path.iterdir()} == {f"{name}.svg" for name in NAMES}
    (tmp_path / "ecdf.png").touch()
    write_figures(tmp_path, [Drawing(kind, None, "too few") for kind in FIGURES], ["svg"])
    assert [path.name for path in tmp_path.iterdir()] == ["ecdf.png"]  # of a format that was not asked for


def test_one_figure_by_its_name() -> None:
    assert drawing_of("ecdf", FULL).axes
    with pytest.raises(ValueError, match=r"^'ecfd' is no figure of a comparison: say comparison, ecdf, critical"):
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
