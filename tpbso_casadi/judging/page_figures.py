"""The figures of runs that make sense, drawn for a folder and for a page."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib as mpl
import numpy as np
from markupsafe import Markup, escape
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from tpbso_casadi.figures.palette import SERIES
from tpbso_casadi.figures.path import path_figure
from tpbso_casadi.figures.style import RC, SAVED, write_figure
from tpbso_casadi.judging.figures import (
    EQUAL,
    FEWEST_FOR_QUARTILES,
    comparison_figure,
    critical_difference_figure,
    ecdf_figure,
    effect_sizes_figure,
    polish_figure,
    rank_figure,
    shares_figure,
)
from tpbso_casadi.judging.referee import Referee
from tpbso_casadi.judging.results import Best, Results
from tpbso_casadi.judging.statistics import FEWEST_SOLVERS, cases_needed
from tpbso_casadi.judging.targets import Measure

MOST_PANELS = 60  # of a figure that can still be read
FEWEST_RUNS = FEWEST_FOR_QUARTILES  # of a solver on a case, for what is said of solvers rather than of runs


@dataclass(frozen=True, kw_only=True)
class PagePicture:
    """A figure on a page, or why there is none.

    Attributes:
        title: of its section.
        name: of its files.
        reading: how it is read.
        svg: for the page; empty where it is left out.
        reason: why it is left out.
    """

    title: str
    name: str
    reading: str
    svg: Markup
    reason: str = ""


@dataclass(frozen=True, kw_only=True)
class FigureKind:
    """A kind of figure of a comparison.

    Attributes:
        name: of its files.
        title: of its section, with words of the measure in braces.
        reading: how it is read, in sentences, likewise.
        draw: makes it.
        left_out: why it makes no sense for these results; empty where it does.
    """

    name: str
    title: str
    reading: str
    draw: Callable[[Results], Figure]
    left_out: Callable[[Results], str]

    def words(self, measure: Measure) -> tuple[str, str]:
        """The title and the sentences on how it is read, for runs that are judged by a measure."""
        words = {"m": measure, "targets": len(measure.targets), "equal": measure.written(measure.equal)}
        return self.title.format(**words), self.reading.format(**words)


def too_many_panels(results: Results) -> str:
    """Why a panel a case is too much; empty where it is not."""
    cases = len(results.cases)
    return f"it has a panel a case, and {cases} are more than {MOST_PANELS}" if cases > MOST_PANELS else ""


def no_plan(results: Results) -> str:
    """Why there is nothing to measure from; empty where there is."""
    return "" if any(value is not None for value in results.references.values()) else results.measure.none


def too_few_runs(results: Results) -> str:
    """Why what the runs show is chance; empty where there are enough."""
    runs = min(summary.objectives.size for summary in results.summaries)
    return f"it needs {FEWEST_RUNS} runs of each solver on each case, here are {runs}" if runs < FEWEST_RUNS else ""


def too_few_solvers(results: Results, fewest: int) -> str:
    """Why there is nothing to compare; empty where there is."""
    solvers = len(results.solvers)
    return f"it needs {fewest} solvers, here {plural(solvers)}" if solvers < fewest else ""


def too_few_cases(results: Results) -> str:
    """Why no outcome could be significant; empty where one could."""
    needed, cases = cases_needed(len(results.solvers)), len(results.cases)
    reason = f"no difference between {len(results.solvers)} solvers can be significant on fewer than {needed} cases"
    return f"{reason}, here {plural(cases)}" if cases < needed else ""


def nothing_polished(results: Results) -> str:
    """Why no polish is drawn: no run was refined, or none with a plan; empty where one is."""
    drawn = any(np.isfinite(gain.final).any() for gain in results.polish_gains)
    return "" if drawn else "nothing was polished; say, for one, bso+polish"


def plural(number: int) -> str:
    """The words for one, or for more."""
    return f"{'is' if number == 1 else 'are'} {number}"


FIGURES = (
    FigureKind(
        name="comparison",
        title="{m.title}",
        reading="Left: over the evaluations of a run, how far its {m.so_far} so far lies above {m.reference}. The line "
        "is the median run of a solver, the band reaches from the lower to the upper quartile{m.begins}. {m.without}. "
        "A cross marks where the longest run of a solver ended. Right: the {m.final} of every run, with median and "
        "quartiles. Gaps in grey, within {equal}, are counted as equal to it by all tests.",
        draw=comparison_figure,
        left_out=lambda results: no_plan(results) or too_many_panels(results),
    ),
    FigureKind(
        name="polish",
        title="What the polish gains",
        reading="Each line is a run: the objective of the motion that the search ended with, on the left, and of the "
        "one that IPOPT made of it, on the right, both certified. Grey where the refined motion was not better and was "
        "discarded. Runs whose search had no certified motion have a point on the right alone.",
        draw=polish_figure,
        left_out=lambda results: no_plan(results) or nothing_polished(results) or too_many_panels(results),
    ),
    FigureKind(
        name="ecdf",
        title="Targets reached",
        reading="The share of all cases, runs and targets that a solver has reached after so many evaluations, as in "
        "COCO. Targets are {targets} gaps to {m.reference}, from {m.span}. Higher and farther left is better; a line "
        "ends at the share of targets that the solver reached at all. {m.without}.",
        draw=ecdf_figure,
        left_out=no_plan,
    ),
    FigureKind(
        name="critical-difference",
        title="Mean ranks over cases",
        reading="On each case solvers are ranked by their median run, 1 for the best. Solvers farther left are better"
        " on more cases. A bar joins solvers between which no significant difference is shown at 5 %: "
        "Friedman's test in the form of Iman and Davenport first and, where that rejects, Wilcoxon's signed-"
        "rank tests of all pairs over the cases, Holm-corrected (Demsar, 2006).",
        draw=critical_difference_figure,
        left_out=lambda results: (
            no_plan(results)
            or too_few_solvers(results, FEWEST_SOLVERS)
            or too_few_cases(results)
            or too_few_runs(results)
        ),
    ),
    FigureKind(
        name="effect-sizes",
        title="Effect sizes",
        reading="A12 of Vargha and Delaney: the probability that a run of the solver of the row is better than one of"
        " the solver of the column, ties half. 0.5 is no difference; from 0.56 on the effect is called small,"
        " from 0.64 medium, from 0.71 large, and below 0.5 likewise for the other solver. Blue: the row is "
        "better; vermillion: it is worse. Of a search and its polish it is the share of the ranks, seed by seed, that "
        "speaks for the row. Runs that failed are not counted here.",
        draw=effect_sizes_figure,
        left_out=lambda results: (
            no_plan(results) or too_few_solvers(results, 2) or too_few_runs(results) or too_many_panels(results)
        ),
    ),
)


INK = ("#000000", to_hex("0.2"))  # what letters and axes are drawn with
OF_PAGE = {EQUAL: "shade"} | {colour: f"series-{index}" for index, colour in enumerate(SERIES)}  # its variables


def drawing_of(name: str, results: Results) -> Figure:
    """The figure of a name.

    Raises:
        ValueError: there is none, or it is left out.
    """
    kinds = {kind.name: kind for kind in FIGURES}
    if name not in kinds:
        raise ValueError(f"{name!r} is no figure of a comparison: say {', '.join(kinds)}")
    if reason := kinds[name].left_out(results):
        raise ValueError(f"{name} is left out: {reason}")
    return kinds[name].draw(results)


def inline_svg(figure: Figure, name: str, alt: str) -> Markup:
    """The element of an HTML page for a figure, in the colours of the page, which may be dark.

    Args:
        figure: to be written.
        name: unique within the page.
        alt: what it shows, for those who do not see it.
    """
    buffer = io.StringIO()
    with mpl.rc_context(RC | {"svg.hashsalt": name}):
        figure.savefig(buffer, format="svg", transparent=True, **SAVED["svg"])
    text = re.sub(r"<metadata>.*?</metadata>", "", buffer.getvalue(), flags=re.DOTALL)
    text = text[text.index("<svg") :]
    text = re.sub(r'(\bid="|xlink:href="#|url\(#)', rf"\g<1>{name}-", text)
    for ink in INK:
        text = re.sub(rf"(fill|stroke): {ink}", r"\1: currentColor", text)
    for colour, variable in OF_PAGE.items():
        text = re.sub(rf"(fill|stroke): {to_hex(colour)}", rf"\1: var(--{variable})", text)
    width, height = (round(72 * inches) for inches in figure.get_size_inches())
    opening = f'<svg class="figure" role="img" aria-label="{escape(alt)}" viewBox="0 0 {width} {height}"'
    opening += f' style="max-width: {width * 1.4:.0f}px" xmlns:xlink="http://www.w3.org/1999/xlink">'
    return Markup(re.sub(r"^<svg[^>]*>", lambda _: opening, text))


def pictures_of(folder: Path, results: Results, formats: Sequence[str]) -> list[PagePicture]:
    """Write every figure into a folder, unless it makes no sense; returns them for a page.

    An older file of a figure that is left out is removed.

    Raises:
        OSError: a file cannot be written.
    """
    of = f"of {', '.join(results.solvers)} on {', '.join(results.cases)}; the tables below have the numbers"
    found = []
    for kind in FIGURES:
        (title, reading), reason = kind.words(results.measure), kind.left_out(results)
        svg = Markup("")
        if reason:
            for suffix in formats:
                (folder / f"{kind.name}.{suffix}").unlink(missing_ok=True)
        else:
            figure = kind.draw(results)
            write_figure(folder, kind.name, figure, formats)
            svg = inline_svg(figure, kind.name, f"{title} {of}")
        found.append(PagePicture(title=title, name=kind.name, reading=reading, svg=svg, reason=reason))
    return found


def plans_of(best: Sequence[Best]) -> dict[str, Markup]:
    """Pictures of the best plans by case: the path of the tool, with postures and obstacles; none without motions."""
    plans = {each.run.case: each.found.planned for each in best}
    return {
        case: inline_svg(
            path_figure(planned), f"plan-{index}", f"The best plan on {case}: path, postures and obstacles"
        )
        for index, (case, planned) in enumerate(plans.items())
        if planned is not None
    }


def suite_pictures(referee: Referee) -> list[PagePicture]:
    """The pictures of a page of runs on a suite."""
    drawn = [
        PagePicture(
            title="Targets reached",
            name="shares",
            reading="The share of runs and targets that were reached after so many evaluations, by the number of "
            "variables.",
            svg=inline_svg(shares_figure(referee), "shares", "Shares of targets reached"),
        )
    ]
    if not referee.too_few:
        figure = rank_figure(referee.ranking, referee.solvers)
        reading = (
            "Mean ranks of median runs, the best on the left; a bar joins solvers that do not differ significantly."
        )
        svg = inline_svg(figure, "ranks", "Mean ranks of the solvers")
        drawn.append(PagePicture(title="Ranks", name="ranks", reading=reading, svg=svg))
    return drawn
