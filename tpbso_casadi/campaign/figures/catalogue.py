"""Every figure of a comparison: its file, how it is read, and when it is left out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from matplotlib.figure import Figure

from tpbso_casadi.campaign.analysis.gap_curves import FEWEST_FOR_QUARTILES
from tpbso_casadi.campaign.analysis.measures import Measure
from tpbso_casadi.campaign.analysis.ranks import FEWEST_SOLVERS, cases_needed
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.figures.comparison import comparison_figure
from tpbso_casadi.campaign.figures.critical_difference import critical_difference_figure
from tpbso_casadi.campaign.figures.ecdf import ecdf_figure
from tpbso_casadi.campaign.figures.effect_sizes import effect_sizes_figure

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
        "better; vermillion: it is worse. Runs that failed are not counted here.",
        draw=effect_sizes_figure,
        left_out=lambda results: (
            no_plan(results) or too_few_solvers(results, 2) or too_few_runs(results) or too_many_panels(results)
        ),
    ),
)
