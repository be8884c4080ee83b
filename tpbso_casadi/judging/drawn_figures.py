"""Which figures of a comparison make sense, drawn for a folder and for a page."""

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
from tpbso_casadi.figures.style import METADATA, RC, write_figure
from tpbso_casadi.judging.comparison_figures import (
    EQUAL,
    comparison_figure,
    critical_difference_figure,
    ecdf_figure,
    effect_sizes_figure,
    polish_figure,
)
from tpbso_casadi.judging.page import ComparisonPicture
from tpbso_casadi.judging.results import FEWEST_FOR_QUARTILES, Best, Results
from tpbso_casadi.judging.statistics import FEWEST_SOLVERS, cases_needed
from tpbso_casadi.judging.targets import Measure
from tpbso_casadi.planning import PlannedMotion

MOST_PANELS = 60  # of a figure that can still be read
FEWEST_RUNS = FEWEST_FOR_QUARTILES  # of a solver on a case, for what is said of solvers rather than of runs


@dataclass(frozen=True, kw_only=True)
class FigureKind:
    """A figure of a comparison.

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

    def title_of(self, measure: Measure) -> str:
        """The title for runs that are judged by a measure."""
        return self.title.format(m=measure)

    def reading_of(self, measure: Measure) -> str:
        """How it is read, likewise."""
        return self.reading.format(m=measure, targets=len(measure.targets), equal=measure.written(measure.equal))


def too_many_panels(results: Results) -> str:
    """A panel a case is too much."""
    cases = len(results.cases)
    return f"it has a panel a case, and {cases} are more than {MOST_PANELS}" if cases > MOST_PANELS else ""


def no_plan(results: Results) -> str:
    """There is nothing to measure from."""
    return "" if any(value is not None for value in results.references.values()) else results.measure.none


def too_few_runs(results: Results) -> str:
    """What a few runs show is chance."""
    runs = min(summary.objectives.size for summary in results.summaries)
    return f"it needs {FEWEST_RUNS} runs of each solver on each case, here are {runs}" if runs < FEWEST_RUNS else ""


def too_few_solvers(results: Results, fewest: int) -> str:
    """There is nothing to compare."""
    solvers = len(results.solvers)
    return f"it needs {fewest} solvers, here {plural(solvers)}" if solvers < fewest else ""


def too_few_cases(results: Results) -> str:
    """No outcome could be significant."""
    needed, cases = cases_needed(len(results.solvers)), len(results.cases)
    reason = f"no difference between {len(results.solvers)} solvers can be significant on fewer than {needed} cases"
    return f"{reason}, here {plural(cases)}" if cases < needed else ""


def nothing_polished(results: Results) -> str:
    """No run was refined, or none with a plan."""
    drawn = any(np.isfinite(run.final) for run in results.polished)
    return "" if drawn else "nothing was polished; say, for one, bso+polish"


def plural(number: int) -> str:
    """There is one, or are more."""
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


@dataclass(frozen=True)
class Drawing:
    """A figure, or why there is none.

    Attributes:
        kind: of the figure.
        figure: itself; None where it is left out.
        reason: why it is left out; empty where it is not.
    """

    kind: FigureKind
    figure: Figure | None
    reason: str

    def svg(self, alt: str) -> Markup:
        """The figure for a page; see :func:`inline_svg`."""
        return Markup("") if self.figure is None else inline_svg(self.figure, self.kind.name, alt)


def drawings(results: Results) -> list[Drawing]:
    """Every figure, drawn unless it makes no sense."""
    reasons = [(kind, kind.left_out(results)) for kind in FIGURES]
    return [Drawing(kind, None if reason else kind.draw(results), reason) for kind, reason in reasons]


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


def write_figures(folder: Path, drawn: Sequence[Drawing], formats: Sequence[str]) -> None:
    """Write each figure in each format; of one that is left out an older file of these formats is removed.

    Raises:
        OSError: a file cannot be written.
    """
    for drawing in drawn:
        if drawing.figure is not None:
            write_figure(folder, drawing.kind.name, drawing.figure, formats)
        else:
            for kind in formats:
                (folder / f"{drawing.kind.name}.{kind}").unlink(missing_ok=True)


def inline_svg(figure: Figure, name: str, alt: str) -> Markup:
    """A figure as an element of an HTML page, in the colours of the page, which may be dark.

    Args:
        figure: to be written.
        name: unique within the page.
        alt: what it shows, for those who do not see it.
    """
    buffer = io.StringIO()
    with mpl.rc_context(RC | {"svg.hashsalt": name}):
        figure.savefig(buffer, format="svg", transparent=True, metadata=METADATA["svg"])
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


def pictures_of(folder: Path, results: Results, formats: Sequence[str]) -> list[ComparisonPicture]:
    """Write every figure into a folder; returns them for a page.

    Raises:
        OSError: a file cannot be written.
    """
    drawn = drawings(results)
    write_figures(folder, drawn, formats)
    of = f"of {', '.join(results.solvers)} on {', '.join(results.cases)}; the tables below have the numbers"
    return [
        ComparisonPicture(
            title=drawing.kind.title_of(results.measure),
            name=drawing.kind.name,
            reading=drawing.kind.reading_of(results.measure),
            svg=drawing.svg(f"{drawing.kind.title_of(results.measure)} {of}"),
            reason=drawing.reason,
        )
        for drawing in drawn
    ]


def plans_of(best: Sequence[Best]) -> dict[str, Markup]:
    """The picture of the best plan of each case, by its name; none of a case without motions."""
    plans = {each.run.case: each.found.planned for each in best}
    return {
        case: plan_of(f"plan-{index}", case, planned)
        for index, (case, planned) in enumerate(plans.items())
        if planned is not None
    }


def plan_of(name: str, case: str, planned: PlannedMotion) -> Markup:
    """The picture of one plan: the path of the tool, with postures and obstacles."""
    alt = f"The best plan on {case}: path, postures and obstacles"
    return inline_svg(path_figure(planned), name, alt)
