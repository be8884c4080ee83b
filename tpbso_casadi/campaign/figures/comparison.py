"""The main figure of a comparison: gaps to the best plan, over evaluations and of the final plans, by case."""

from __future__ import annotations

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.gap_curves import FEWEST_FOR_QUARTILES, GapCurve, gap_curve
from tpbso_casadi.campaign.analysis.measures import Measure
from tpbso_casadi.campaign.analysis.quantiles import quantile
from tpbso_casadi.campaign.analysis.references import gaps_of
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.figures.runs import draw_points
from tpbso_casadi.campaign.statistics import Summary
from tpbso_casadi.figures.style.colours import colour_of, line_of, marker_of
from tpbso_casadi.figures.style.labels import EndLabel, label_ends
from tpbso_casadi.figures.style.paper import SMALL, in_print

COLUMNS = 2
EQUAL = "0.92"  # behind gaps within which statistics count plans as equal
ROOM = 2.5  # factor of the y axis above the largest gap, for runs without a plan


@in_print
def comparison_figure(results: Results) -> Figure:
    """A pair of panels a case: the median gap of each solver over evaluations with its quartiles, and final plans."""
    columns = min(COLUMNS, len(results.cases))
    rows = ceil(len(results.cases) / columns)
    figure = Figure(figsize=(5.4 * columns, 0.3 + 2.5 * rows), layout="constrained")
    grid = figure.add_gridspec(rows, 2 * columns, width_ratios=[3.0, 2.0] * columns)
    panels = []
    for index, case in enumerate(results.cases):
        row, column = divmod(index, columns)
        left = figure.add_subplot(grid[row, 2 * column])
        right = figure.add_subplot(grid[row, 2 * column + 1], sharey=left)
        panels.append((left, draw_case(left, right, results, case)))
    figure.suptitle(f"Gap to {results.measure.reference}: median run and quartiles")
    figure.draw_without_rendering()  # panels get their places, which labels need
    for left, ends in panels:
        label_ends(left, ends)
    return figure


def draw_case(left: Axes, right: Axes, results: Results, case: str) -> list[EndLabel]:
    """The two panels of a case; returns what is to be written at the ends of the lines."""
    reference, summaries, measure = results.references[case], results.of_case(case), results.measure
    left.set_title(case, loc="left")
    if reference is None:
        left.text(0.5, 0.5, measure.none, ha="center", transform=left.transAxes)
        left.set_axis_off()
        right.set_axis_off()
        return []
    curves = [gap_curve(results, case, summary.solver) for summary in summaries]
    finals = [np.maximum(gaps_of(summary.objectives, reference), measure.drawn) for summary in summaries]
    set_scales(left, curves, finals, measure)
    for index, (curve, gaps, summary) in enumerate(zip(curves, finals, summaries, strict=True)):
        draw_curve(left, index, curve, measure.drawn)
        draw_final(right, index, gaps, summary)
    finish(left, right, summaries, measure.axis(reference, summaries[0].unit))
    top = left.get_ylim()[1]
    ends = [min(max(float(curve.median[-1]), measure.drawn), top) for curve in curves]
    return [
        EndLabel(summary.solver, end, colour_of(index))
        for index, (summary, end) in enumerate(zip(summaries, ends, strict=True))
    ]


def set_scales(axes: Axes, curves: list[GapCurve], finals: list[FloatArray], measure: Measure) -> None:
    """Logarithmic axes from the first plan of a median run on, and from the least gap up to the largest."""
    values = np.concatenate([*(curve.median for curve in curves), *finals])
    shown = np.maximum(values[np.isfinite(values)], measure.drawn)
    largest = float(shown.max(initial=measure.drawn))
    least = float(shown.min(initial=largest))
    starts = [curve.evaluations[np.isfinite(curve.lower)] for curve in curves]
    first = min((float(evaluations[0]) for evaluations in starts if evaluations.size), default=1.0)
    axes.set(xscale="log", yscale="log")
    axes.set_xlim(first / 1.1, float(curves[0].evaluations[-1]))
    axes.set_ylim(least / 1.6, max(10.0 * measure.equal, largest) * ROOM)


def draw_curve(axes: Axes, index: int, curve: GapCurve, least: float) -> None:
    """One solver: its median a line, the half of its runs in the middle a band; thin once all runs have ended.

    Gaps below the least are drawn there.
    """
    top = 10.0 * axes.get_ylim()[1]
    lower, median, upper = (np.maximum(gaps, least) for gaps in (curve.lower, curve.median, curve.upper))
    some = np.isfinite(lower)
    axes.fill_between(
        curve.evaluations[some], lower[some], np.minimum(upper[some], top), color=colour_of(index), alpha=0.15, lw=0.0
    )
    during = curve.evaluations <= curve.end
    shown = np.where(np.isfinite(median), median, np.nan)
    axes.plot(curve.evaluations[during], shown[during], **line_of(index), linewidth=1.5)
    axes.plot(curve.evaluations[~during], shown[~during], color=colour_of(index), linewidth=0.7, alpha=0.7)
    if not during.all():
        axes.plot(curve.evaluations[during][-1], shown[during][-1], "x", color=colour_of(index), markersize=6)


def draw_final(axes: Axes, index: int, gaps: FloatArray, summary: Summary) -> None:
    """The final plans of one solver: each run a point, median and quartiles lines; runs without a plan at the top."""
    top, colour = axes.get_ylim()[1] / ROOM**0.5, colour_of(index)
    draw_points(axes, index, gaps[np.isfinite(gaps)], colour, marker_of(index))
    missing, runs = summary.infeasible + summary.failed, summary.objectives.size + summary.failed
    every = np.append(gaps, np.full(summary.failed, np.inf))
    lower, median, upper = (float(np.minimum(quantile(every, share), top)) for share in (0.25, 0.5, 0.75))
    axes.hlines(median, index - 0.36, index + 0.36, color=colour, linewidth=2.2)
    if runs >= FEWEST_FOR_QUARTILES:
        axes.vlines(index + 0.36, lower, upper, color=colour, linewidth=1.2)
    if missing:
        axes.plot(index, top, "x", color=colour, markersize=6)
        note = f"{missing} of {runs}\nno {summary.measure.result}"
        axes.text(
            index, 1.01, note, color=colour, fontsize=SMALL - 1, ha="center", transform=axes.get_xaxis_transform()
        )


def finish(left: Axes, right: Axes, summaries: list[Summary], gap: str) -> None:
    """Axes, grids and names."""
    measure = summaries[0].measure
    left.set_xlabel("evaluations")
    left.set_ylabel(gap)
    left.yaxis.set_major_locator(LogLocator(numticks=12))
    left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: measure.ticked(value)))
    for axis in (left.xaxis, left.yaxis):
        axis.set_minor_formatter(NullFormatter())
    right.tick_params(labelleft=False)
    right.set_xlim(-0.6, len(summaries) - 0.4)
    names = [wrapped(summary.solver) for summary in summaries]
    right.set_xticks(range(len(summaries)), names, rotation=35, ha="right", fontsize=SMALL)
    for axes in (left, right):
        axes.axhspan(measure.drawn / 10.0, measure.equal, color=EQUAL, zorder=0)
        axes.grid(visible=False, axis="x")


def wrapped(label: str) -> str:
    """A solver's label with each of its settings on a line."""
    return label.replace("(", "(\n").replace(",", ",\n")
