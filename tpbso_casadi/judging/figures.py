"""Figures of runs that are judged: gaps, shares of targets, mean ranks, effect sizes, what polishing gains.

[1] A. Vargha, H. D. Delaney, "A critique and improvement of the CL common language effect size statistics of McGraw
    and Wong", Journal of Educational and Behavioral Statistics 25, 2000.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from problems.base import FloatArray
from tpbso_casadi.figures.palette import colour_of, line_of, marker_of
from tpbso_casadi.figures.style import (
    RC,
    SMALL,
    TWO_COLUMNS,
    EndLabel,
    fitted,
    in_print,
    label_ends,
    legend_columns,
    title_figure,
    width_of,
)
from tpbso_casadi.judging.referee import Referee
from tpbso_casadi.judging.results import PolishGain, Results
from tpbso_casadi.judging.statistics import Ranking, Summary, p_text, ranking
from tpbso_casadi.judging.targets import Measure, gaps_of, percent, quantile, shares_reached
from tpbso_casadi.plain import one_line


def draw_points(
    axes: Axes, place: float, values: FloatArray, colour: str, marker: str = "o", width: float = 0.5
) -> None:
    """Draw points at a place of the x axis, beside each other so that equal ones can be seen."""
    spread = place + width * (np.arange(values.size) % 5 - 2) / 8.0
    axes.plot(spread, values, marker, color=colour, alpha=0.5, markersize=4, markeredgewidth=0.0, linestyle="none")


def draw_runs(axes: Axes, place: float, summary: Summary, colour: str, width: float = 0.5, marker: str = "o") -> None:
    """Draw the objectives of a solver's plans, their mean a line; how many runs have no plan stands above."""
    objectives = summary.feasible_objectives
    draw_points(axes, place, objectives, colour, marker, width)
    if objectives.size:
        axes.hlines(summary.mean, place - width / 2.0, place + width / 2.0, color=colour, linewidth=2.2)
    if summary.infeasible:
        note = f"{summary.infeasible} of {summary.objectives.size}\ninfeasible"
        axes.annotate(
            note, (place, 0.98), xycoords=axes.get_xaxis_transform(), ha="center", va="top", fontsize=7, color=colour
        )


GRID = 240  # numbers of evaluations at which quartiles are computed
FEWEST_FOR_QUARTILES = 4  # runs; fewer have a median alone


@dataclass(frozen=True, kw_only=True)
class GapCurve:
    """The gaps of the runs of one solver on one case.

    Attributes:
        end: evaluations of its longest run.
        evaluations: up to the end of the longest run of any solver, (n,).
        quartiles: lower quartile, median and upper quartile of the gaps, (3, n), inf where that run has no plan.
    """

    end: int
    evaluations: FloatArray
    quartiles: FloatArray


def gap_curve(results: Results, case: str, solver: str) -> GapCurve:
    """The curve of one solver; a run without a plan, or without one yet, is infinitely far from the best."""
    longest = max(run.done for run in results.convergences if run.case == case)
    evaluations = np.geomspace(1.0, max(2, longest), GRID)
    runs = results.runs_of(solver, case)
    gaps = gaps_of(np.array([run.at(evaluations) for run in runs]), results.references[case])
    shares = (0.25, 0.5, 0.75) if len(runs) >= FEWEST_FOR_QUARTILES else (0.5, 0.5, 0.5)
    quartiles = np.array([quantile(gaps, share) for share in shares])
    return GapCurve(end=max(run.done for run in runs), evaluations=evaluations, quartiles=quartiles)


COLUMNS = 2
COURSE, FINAL, PER_SOLVER, AROUND = 2.7, 1.3, 0.36, 1.1  # inches: of a left and a right panel; of axes around both
PANEL, LEGEND_LINE, LONGEST_LABEL = 2.5, 0.16, 3.2  # inches: of a case; of the legend
EQUAL = "0.92"  # behind gaps within which statistics count plans as equal
ROOM = 2.5  # factor of the y axis above the largest gap, for runs without a plan


@in_print
def comparison_figure(results: Results) -> Figure:
    """The figure with two panels a case: median gaps over evaluations with their quartiles, and final plans."""
    columns = min(COLUMNS, len(results.cases))
    rows = ceil(len(results.cases) / columns)
    final = max(FINAL, PER_SOLVER * len(results.solvers))
    width = columns * (COURSE + final + AROUND)
    labels = [fitted(solver, LONGEST_LABEL) for solver in results.solvers]
    beside = legend_columns(labels, width)
    lines = ceil(len(labels) / beside) * max(label.count("\n") + 1 for label in labels)
    figure = Figure(figsize=(width, 0.4 + PANEL * rows + LEGEND_LINE * lines), layout="constrained")
    grid = figure.add_gridspec(rows, 2 * columns, width_ratios=[COURSE, final] * columns)
    for index, case in enumerate(results.cases):
        row, column = divmod(index, columns)
        left = figure.add_subplot(grid[row, 2 * column])
        right = figure.add_subplot(grid[row, 2 * column + 1], sharey=left)
        draw_case(left, right, results, case)
    title_figure(figure, f"Gap to {results.measure.reference}: median run and quartiles")
    lines_of = [Line2D([], [], **line_of(index), marker=marker_of(index)) for index in range(len(labels))]
    for text in figure.legend(lines_of, labels, loc="outside lower center", ncols=beside).get_texts():
        text.set_parse_math(False)
    return figure


def draw_case(left: Axes, right: Axes, results: Results, case: str) -> None:
    """Draw the two panels of a case."""
    reference, summaries, measure = results.references[case], results.of_case(case), results.measure
    left.set_title(fitted(case, COURSE, RC["axes.titlesize"]), loc="left", parse_math=False)
    if reference is None:
        left.text(0.5, 0.5, measure.none, ha="center", transform=left.transAxes)
        left.set_axis_off()
        right.set_axis_off()
        return
    curves = [gap_curve(results, case, summary.solver) for summary in summaries]
    finals = [np.maximum(gaps_of(summary.objectives, reference), measure.drawn) for summary in summaries]
    set_scales(left, curves, finals, measure)
    for index, (curve, gaps, summary) in enumerate(zip(curves, finals, summaries, strict=True)):
        draw_curve(left, index, curve, measure.drawn)
        draw_final(right, index, gaps, summary)
    finish(left, right, summaries, measure.axis(reference, summaries[0].unit))


def set_scales(axes: Axes, curves: list[GapCurve], finals: list[FloatArray], measure: Measure) -> None:
    """Set logarithmic axes from the first plan of a median run on, and from the least gap up to the largest."""
    values = np.concatenate([*(curve.quartiles[1] for curve in curves), *finals])
    shown = np.maximum(values[np.isfinite(values)], measure.drawn)
    largest = float(shown.max(initial=measure.drawn))
    least = float(shown.min(initial=largest))
    starts = [curve.evaluations[np.isfinite(curve.quartiles[0])] for curve in curves]
    first = min((float(evaluations[0]) for evaluations in starts if evaluations.size), default=1.0)
    axes.set(xscale="log", yscale="log")
    axes.set_xlim(first / 1.1, float(curves[0].evaluations[-1]))
    axes.set_ylim(least / 1.6, max(10.0 * measure.equal, largest) * ROOM)


def draw_curve(axes: Axes, index: int, curve: GapCurve, least: float) -> None:
    """Draw one solver: its median a line, the half of its runs in the middle a band; thin once all runs have ended.

    Gaps below the least are drawn there.
    """
    top = 10.0 * axes.get_ylim()[1]
    lower, median, upper = np.maximum(curve.quartiles, least)
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
    """Draw the final plans of a solver: runs are points, median and quartiles lines, runs without a plan at the top."""
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
        axes.text(
            index, 1.01, f"{missing}/{runs}", color=colour, fontsize=SMALL - 1, ha="center",
            transform=axes.get_xaxis_transform(),
        )  # fmt: skip


def finish(left: Axes, right: Axes, summaries: list[Summary], gap: str) -> None:
    """Set axes, grids and names of both panels."""
    measure = summaries[0].measure
    left.set_xlabel("evaluations")
    left.set_ylabel(gap)
    left.yaxis.set_major_locator(LogLocator(numticks=12))
    left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: measure.ticked(value)))
    for axis in (left.xaxis, left.yaxis):
        axis.set_minor_formatter(NullFormatter())
    right.tick_params(labelleft=False)
    right.set_xlim(-0.6, len(summaries) - 0.4)
    right.set_xticks([])
    right.set_xlabel(f"{measure.final}s")
    if any(summary.infeasible + summary.failed for summary in summaries):
        right.set_title(f"runs without a {measure.result}:", loc="left", fontsize=SMALL - 1, pad=SMALL + 3.0)
    for axes in (left, right):
        axes.axhspan(measure.drawn / 10.0, measure.equal, color=EQUAL, zorder=0)
        axes.grid(visible=False, axis="x")


LONGEST_NAME = 30  # characters of a solver's label
MOST_TICKS = 15  # of an axis of ranks
BAR, BAR_STEP = 0.35, 0.3  # the first bar below the axis, and from one to the next, in rows


def critical_difference_figure(results: Results) -> Figure:
    """The figure of the solvers of a campaign on an axis of mean ranks."""
    return rank_figure(ranking(results.solvers, results.scores()), results.solvers)


@in_print
def rank_figure(found: Ranking, solvers: Sequence[str]) -> Figure:
    """The figure of solvers on an axis of mean ranks, the best left; a thick bar joins those that do not differ.

    Args:
        found: their ranking.
        solvers: in the order of their colours.
    """
    half = ceil(len(found.solvers) / 2)
    depth = BAR + BAR_STEP * len(found.groups)
    figure = Figure(figsize=(TWO_COLUMNS, 1.2 + 0.3 * (depth + half)), layout="constrained")
    axes = figure.subplots()
    axes.set_title(
        f"Mean ranks of median runs over {found.cases} cases; Friedman test: p {equals(found.p)}",
        loc="left",
    )
    draw_axis(axes, found)
    for step, (first, last) in enumerate(found.groups):
        y = -BAR - BAR_STEP * step
        axes.plot(found.ranks[[first, last]] + (-0.04, 0.04), [y, y], color="0.2", linewidth=4, solid_capstyle="butt")
    for place, (solver, rank) in enumerate(zip(found.solvers, found.ranks, strict=True)):
        row = place if place < half else len(found.solvers) - 1 - place
        draw_solver(axes, found, solvers.index(solver), solver, float(rank), place < half, -depth - row)
    axes.set_ylim(-depth - half + 0.3, 1.2)
    return figure


def short_name(solver: str) -> str:
    """A solver's label, of which settings that are too long for a figure are shortened in their middle."""
    return one_line(solver, LONGEST_NAME)


def equals(p: float) -> str:
    """The text of p as it stands behind its name."""
    text = p_text(p)
    return text if text.startswith("<") else f"= {text}"


def limits(found: Ranking) -> tuple[int, int]:
    """The whole ranks around all mean ranks."""
    return floor(found.ranks[0]), max(floor(found.ranks[0]) + 1, ceil(found.ranks[-1]))


def draw_axis(axes: Axes, found: Ranking) -> None:
    """Draw the line of ranks at the top, with its ticks and numbers."""
    low, high = limits(found)
    margin = 0.45 * (high - low)
    axes.set_axis_off()
    axes.set_xlim(low - margin, high + margin)
    axes.plot([low, high], [0.0, 0.0], color="black", linewidth=1.2)
    for rank in range(low, high + 1, ceil((high - low) / MOST_TICKS)):
        axes.plot([rank, rank], [0.0, 0.15], color="black", linewidth=1.2)
        axes.text(rank, 0.25, str(rank), ha="center", va="bottom")


def draw_solver(axes: Axes, found: Ranking, index: int, name: str, rank: float, left: bool, y: float) -> None:
    """Draw a solver's mark on the axis, and its name on the side where it is nearer."""
    low, high = limits(found)
    side = low - 0.05 * (high - low) if left else high + 0.05 * (high - low)
    axes.plot([rank, rank, side], [0.0, y, y], color=colour_of(index), linewidth=1.0)
    axes.plot(rank, 0.0, marker_of(index), color=colour_of(index), markersize=7, clip_on=False)
    text = f"{short_name(name)}  {rank:.2f}" if left else f"{rank:.2f}  {short_name(name)}"
    offset = -4 if left else 4
    axes.annotate(text, (side, y), (offset, 0), textcoords="offset points", ha="right" if left else "left", va="center")


LONGEST_END = 2.2  # inches of a label behind a line


@in_print
def ecdf_figure(results: Results) -> Figure:
    """The figure with a line a solver over all cases, runs and targets; a cross where its longest run ended."""
    figure = Figure(figsize=(TWO_COLUMNS, 3.8), layout="constrained")
    axes = figure.subplots()
    axes.set_title(
        f"Targets reached: {len(results.measure.targets)} gaps from {results.measure.span}, "
        f"{len(results.cases)} case{'s' * (len(results.cases) > 1)}",
        loc="left",
    )
    axes.set(xscale="log", ylim=(-0.02, 1.02), xlabel="evaluations", ylabel="share of cases, runs and targets")
    longest = max([2, *(run.done for run in results.convergences)])
    ends, first = [], float(longest)
    for index, solver in enumerate(results.solvers):
        runs = results.runs_of(solver)
        reached = [results.needed(run) for run in runs]
        evaluations, shares = shares_reached(reached)
        first = min([first, *evaluations[:1]])
        end = max(run.done for run in runs)
        last = draw_shares(axes, index, evaluations, shares, 1.0, end)
        axes.plot([end, longest], [last, last], color=colour_of(index), linewidth=0.7, alpha=0.7)
        ends.append(EndLabel(fitted(solver, LONGEST_END), last, colour_of(index)))
    axes.set_xlim(max(1.0, first / 1.1), longest)
    figure.draw_without_rendering()  # the panel gets its place, which labels need
    label_ends(axes, ends)
    return figure


def draw_shares(axes: Axes, index: int, evaluations: FloatArray, shares: FloatArray, first: float, end: float) -> float:
    """Draw the line of a solver with a cross at its end; returns the height of its end.

    Args:
        axes: to draw into.
        index: of the solver.
        evaluations: at which its share grows, (n,).
        shares: from then on, (n,).
        first: evaluations at which the line begins.
        end: evaluations of its longest run.
    """
    last = float(shares[-1]) if shares.size else 0.0
    x, y = np.concatenate([[first], evaluations, [end]]), np.concatenate([[0.0], shares, [last]])
    axes.plot(x, y, **line_of(index), linewidth=1.5, drawstyle="steps-post")
    axes.plot(end, last, "x", color=colour_of(index), markersize=7)
    return last


PANELS = 3  # beside each other
LEGEND, LINE = 125, 8  # characters that a row of the legend has room for, and that a line in it takes
FEWEST = 0.01  # evaluations by dimension, where lines begin


@in_print
def shares_figure(referee: Referee) -> Figure:
    """The figure with a panel a class of problems, a line a solver; a cross where its longest run ended."""
    classes = referee.classes()
    rows = ceil(len(classes) / PANELS)
    labels = [short_name(solver) for solver in referee.solvers]
    columns = min(len(labels), max(1, LEGEND // (max(map(len, labels)) + LINE)))
    height = 2.3 * rows + 0.3 + 0.2 * ceil(len(labels) / columns)
    figure = Figure(figsize=(3.4 * PANELS, height), layout="constrained")
    panels = figure.subplots(rows, PANELS, sharey=True, squeeze=False).ravel()
    longest = max(run.done / run.problem.dimension for run in referee.runs)
    for axes, (name, problems) in zip(panels, classes.items(), strict=False):
        axes.set_title(f"{name} ({len(problems)})", loc="left")
        axes.set(xscale="log", ylim=(-0.02, 1.02), xlim=(0.1, 1.1 * max(2.0, longest)))
        for index, solver in enumerate(referee.solvers):
            if ends := [run.done / run.dimension for run in referee.on(problems, solver)]:
                draw_shares(axes, index, *referee.shares(solver, problems), FEWEST, max(ends))
    for axes in panels[len(classes) :]:
        axes.set_axis_off()
    for axes in panels[max(0, len(classes) - PANELS) : len(classes)]:
        axes.set_xlabel("evaluations / variables")
    for axes in panels[::PANELS]:
        axes.set_ylabel("share of targets")
    lines = [panels[0].plot([], [], **line_of(index), label=label)[0] for index, label in enumerate(labels)]
    figure.legend(handles=lines, loc="outside upper center", ncols=columns)
    return figure


MATRIX_COLUMNS = 3
CELL, LONGEST_SIDE = 0.42, 1.7  # inches: of a cell, with room for three lines beside it; of a name beside a matrix
WORSE, BETTER = "#c14a07", "#085692"  # those of lines but for a bit: pages lighten lines on a dark ground, not cells
WORSE_TO_BETTER = LinearSegmentedColormap.from_list("worse to better", [WORSE, "#f7f7f7", BETTER])
DARK_BLUE = 0.8  # from there on numbers are white
ON_LIGHT = "#000001"  # the others, whatever colour letters have elsewhere


@in_print
def effect_sizes_figure(results: Results) -> Figure:
    """The figure with a matrix over all cases, and where there are more of them one for each."""
    by_case = {case: results.effect_sizes(case) for case in results.cases}
    matrices = by_case if len(by_case) == 1 else {"mean over cases": np.mean(list(by_case.values()), axis=0), **by_case}
    columns = min(MATRIX_COLUMNS, len(matrices))
    rows = ceil(len(matrices) / columns)
    names = [fitted(solver, LONGEST_SIDE) for solver in results.solvers]
    side = max(map(width_of, "\n".join(names).split("\n")))
    size = max(5.0 / columns, 0.4 + CELL * len(names) + side)
    titles = [fitted(title, size - 0.3, RC["axes.titlesize"]) for title in matrices]
    above = 0.2 * max(title.count("\n") + 1 for title in titles)
    figure = Figure(figsize=(size * columns, 0.4 + (size + above) * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, title, matrix in zip(panels, titles, matrices.values(), strict=False):
        draw_matrix(axes, title, matrix, names)
    for axes in panels[len(matrices) :]:
        axes.set_axis_off()
    title_figure(figure, "A12: how probably a run of the row is better than one of the column")
    return figure


def draw_matrix(axes: Axes, title: str, matrix: FloatArray, solvers: list[str]) -> None:
    """Draw a matrix (k, k), its numbers in the cells; blue where the row is better, vermillion where it is worse."""
    shown = np.ma.masked_array(matrix, np.eye(len(matrix), dtype=bool))
    edges = np.arange(len(matrix) + 1) - 0.5
    axes.pcolormesh(edges, edges, shown, cmap=WORSE_TO_BETTER, vmin=0.0, vmax=1.0)
    axes.set(aspect="equal", ylim=(len(matrix) - 0.5, -0.5))
    for (row, column), value in np.ndenumerate(matrix):
        if row != column:
            colour = "white" if value >= DARK_BLUE else ON_LIGHT
            axes.text(column, row, f"{value:.2f}", ha="center", va="center", color=colour, fontsize=SMALL)
    places = range(len(solvers))
    axes.set_xticks(places, solvers, rotation=90, fontsize=SMALL, parse_math=False)
    axes.set_yticks(places, solvers, fontsize=SMALL, parse_math=False)
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.set_title(title, loc="right", parse_math=False)


POLISH_COLUMNS, PER_GAIN = 3, 1.2  # inches of a label below and above a solver
DISCARDED = "0.6"  # of a refined motion that is not kept


@in_print
def polish_figure(results: Results) -> Figure:
    """The figure with a panel a case: a line a run, from the search's motion to the refined one."""
    gains = list(results.polish_gains)
    cases = list(dict.fromkeys(gain.case for gain in gains))
    columns = min(POLISH_COLUMNS, len(cases))
    rows = ceil(len(cases) / columns)
    widest = max(sum(gain.case == case for gain in gains) for case in cases)
    panel = max(TWO_COLUMNS / 2.0 / columns, 1.0 + 1.4 * widest)
    figure = Figure(figsize=(columns * panel, 3.0 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, case in zip(panels, cases, strict=False):
        draw_gains(axes, [gain for gain in gains if gain.case == case])
        axes.set_title(fitted(case, panel - 0.9, RC["axes.titlesize"]), parse_math=False)
    for axes in panels[len(cases) :]:
        axes.set_axis_off()
    return figure


def draw_gains(axes: Axes, gains: list[PolishGain]) -> None:
    """Draw the runs of each solver on one case, before and after."""
    for place, gain in enumerate(gains):
        colour, ends = colour_of(place), np.array([place - 0.28, place + 0.28])
        for values, kept in zip(np.column_stack([gain.before, gain.after]), gain.kept, strict=True):
            drawn = np.isfinite(values)
            shade = colour if kept else DISCARDED
            axes.plot(ends[drawn], values[drawn], marker_of(place), linestyle="-", color=shade, alpha=0.7, markersize=4)
        less = f"{percent(gain.gains[1])}{' less' * bool(np.isfinite(gain.gains[1]))}"
        words = fitted(f"kept {gain.kept.sum()} of {gain.kept.size}\n{less}", PER_GAIN)
        axes.annotate(
            words,
            (place, 1.0),
            xycoords=axes.get_xaxis_transform(),
            ha="center",
            va="top",
            fontsize=SMALL,
            color=colour,
        )
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.3 * (high - low))  # room for the words
    axes.set_xlim(-0.6, len(gains) - 0.4)
    labels = [f"{fitted(gain.solver, PER_GAIN)}\nbefore, after" for gain in gains]
    axes.set_xticks(range(len(gains)), labels, fontsize=SMALL, parse_math=False)
    axes.set_ylabel(f"[{gains[0].unit}]")
    axes.grid(visible=False, axis="x")
