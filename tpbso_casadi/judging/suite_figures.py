"""Figures of a suite's page: shares of targets by class of problems, mean ranks."""

from __future__ import annotations

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems.base import FloatArray
from tpbso_casadi.figures.palette import colour_of, line_of
from tpbso_casadi.figures.style import in_print
from tpbso_casadi.judging.comparison_figures import rank_figure, short_name
from tpbso_casadi.judging.referee import Referee

COLUMNS = 3
LEGEND, LINE = 125, 8  # characters that a row of the legend has room for, and that a line in it takes
FEWEST = 0.01  # evaluations by dimension, where lines begin


@in_print
def shares_figure(referee: Referee) -> Figure:
    """A panel a class of problems, a line a solver; a cross where its longest run ended."""
    classes = referee.classes()
    rows = ceil(len(classes) / COLUMNS)
    labels = [short_name(solver) for solver in referee.solvers]
    columns = min(len(labels), max(1, LEGEND // (max(map(len, labels)) + LINE)))
    height = 2.3 * rows + 0.3 + 0.2 * ceil(len(labels) / columns)
    figure = Figure(figsize=(3.4 * COLUMNS, height), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, sharey=True, squeeze=False).ravel()
    longest = max(run.done / run.problem.dimension for run in referee.runs)
    for axes, (name, problems) in zip(panels, classes.items(), strict=False):
        axes.set_title(f"{name} ({len(problems)})", loc="left")
        axes.set(xscale="log", ylim=(-0.02, 1.02), xlim=(0.1, 1.1 * max(2.0, longest)))
        for index, solver in enumerate(referee.solvers):
            runs = [run for problem in problems for run in referee.of(problem.name, solver)]
            if runs:
                end = max(run.done / run.problem.dimension for run in runs)
                draw_shares(axes, index, *referee.shares(solver, problems), end)
    for axes in panels[len(classes) :]:
        axes.set_axis_off()
    for axes in panels[max(0, len(classes) - COLUMNS) : len(classes)]:
        axes.set_xlabel("evaluations / variables")
    for axes in panels[::COLUMNS]:
        axes.set_ylabel("share of targets")
    lines = [panels[0].plot([], [], **line_of(index), label=label)[0] for index, label in enumerate(labels)]
    figure.legend(handles=lines, loc="outside upper center", ncols=columns)
    return figure


def draw_shares(axes: Axes, index: int, evaluations: FloatArray, shares: FloatArray, end: float) -> None:
    """One solver's line, with a cross at its end."""
    last = float(shares[-1]) if shares.size else 0.0
    x, y = np.concatenate([[FEWEST], evaluations, [end]]), np.concatenate([[0.0], shares, [last]])
    axes.plot(x, y, **line_of(index), linewidth=1.5, drawstyle="steps-post")
    axes.plot(end, last, "x", color=colour_of(index), markersize=7)


def ranks_figure(referee: Referee) -> Figure:
    """Solvers by mean rank of their median runs over the problems."""
    return rank_figure(referee.ranking, referee.solvers)
