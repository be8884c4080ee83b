"""The share of runs and targets reached over evaluations, as COCO draws it."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.analysis.targets import shares_reached
from tpbso_casadi.figures.style.colours import colour_of, line_of
from tpbso_casadi.figures.style.labels import EndLabel, label_ends
from tpbso_casadi.figures.style.paper import TWO_COLUMNS, in_print


@in_print
def ecdf_figure(results: Results) -> Figure:
    """A line a solver over all cases, runs and targets; a cross where its longest run ended."""
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
        last = draw_shares(axes, index, evaluations, shares, max(run.done for run in runs), longest)
        ends.append(EndLabel(solver, last, colour_of(index)))
    axes.set_xlim(max(1.0, first / 1.1), longest)
    figure.draw_without_rendering()  # the panel gets its place, which labels need
    label_ends(axes, ends)
    return figure


def draw_shares(axes: Axes, index: int, evaluations: FloatArray, shares: FloatArray, end: int, longest: int) -> float:
    """One solver's line, thin behind the end of its longest run; returns the height of its end."""
    last = float(shares[-1]) if shares.size else 0.0
    x, y = np.concatenate([[1.0], evaluations, [end]]), np.concatenate([[0.0], shares, [last]])
    axes.plot(x, y, **line_of(index), linewidth=1.5, drawstyle="steps-post")
    axes.plot([end, longest], [last, last], color=colour_of(index), linewidth=0.7, alpha=0.7)
    axes.plot(end, last, "x", color=colour_of(index), markersize=7)
    return last
