"""Figures of what a problem itself offers: measures of a search's progress, and quantities between bounds.

Along a path these are the paper's two extra figures: trajectory accuracy and redundancy angle. Imported only where a
figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from problems.base.matrix import FloatArray
from problems.tasks.drawing import BoundedCurve, ProgressMeasure
from tpbso_casadi.figures.style.colours import BLUE, GIVEN, LIMIT, PATH, PURPLE, VERMILLION
from tpbso_casadi.figures.style.labels import EndLabel, label_ends
from tpbso_casadi.figures.style.paper import ONE_COLUMN, TWO_COLUMNS, in_print
from tpbso_casadi.planning.plan import convergence, step_name
from tpbso_casadi.planning.planned_motion import PlannedMotion, SearchedMotion

HEIGHT = 2.6  # inches


def progress_figures(plan: SearchedMotion) -> dict[str, tuple[str, Figure]]:
    """By file name, the caption and the figure of each of the problem's progress measures."""
    return {
        measure.name: (measure.label, progress_figure(plan, measure)) for measure in plan.problem.progress_measures()
    }


@in_print
def progress_figure(plan: SearchedMotion, measure: ProgressMeasure) -> Figure:
    """A measure of the best candidate so far over the iterations."""
    figure = Figure(figsize=(ONE_COLUMN, HEIGHT), layout="constrained")
    axes = figure.subplots()
    iterations, _ = convergence(plan.search)
    history = progress_history(plan, measure)
    axes.step(iterations, history, where="post", color=BLUE)
    axes.axhline(measure.limit, color=LIMIT, linestyle="--", linewidth=0.8)
    axes.set_xlabel(step_name(plan.search))
    axes.set_ylabel(f"{measure.label} [{measure.unit}]")
    axes.set_title(measure.title)
    axes.set_xlim(0, max(int(iterations[-1]), 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    axes.set_ylim(0.0, 1.1 * max(axes.get_ylim()[1], measure.limit))
    reached = float(history[-1])
    label_ends(axes, [EndLabel(f"{reached:.3g}", reached, BLUE), EndLabel("limit", measure.limit, LIMIT)])
    return figure


def progress_history(plan: SearchedMotion, measure: ProgressMeasure) -> FloatArray:
    """A measure of the best candidate so far after each iteration or start, (n,), in its unit."""
    best = plan.search.history.best
    if not plan.search.in_program_variables:
        return measure.of_candidates(best)
    program = plan.problem.nlp()
    return np.array([measure.of_trajectory(program.trajectory(x)) for x in best])


def curve_figures(plan: PlannedMotion) -> dict[str, tuple[str, Figure]]:
    """By file name, the caption and the figure of the problem's bounded curves; those of one name share a figure."""
    groups = curve_groups(plan)
    return {name: (group[0].label, curve_figure(plan.times, group)) for name, group in groups.items()}


def curve_groups(plan: PlannedMotion) -> dict[str, tuple[BoundedCurve, ...]]:
    """The problem's bounded curves by the file name of their figure."""
    curves = plan.criteria.bounded_curves(plan.trajectory)
    return {name: tuple(group) for name, group in groupby(curves, key=lambda curve: curve.name)}


@in_print
def curve_figure(times: FloatArray, curves: Sequence[BoundedCurve]) -> Figure:
    """Each curve at times (n,) in s over its bounds, one panel each."""
    figure = Figure(figsize=(TWO_COLUMNS, 0.9 + 2.0 * len(curves)), layout="constrained")
    panels = figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0]
    for axes, curve in zip(panels, curves, strict=True):
        axes.fill_between(curve.times, curve.lower, curve.upper, color=GIVEN, alpha=0.12, linewidth=0.0)
        axes.plot(times, curve.value(times), color=PATH, label="planned")
        small = {"linestyle": "none", "markersize": 3.0}
        axes.plot(curve.times, curve.upper, "v", color=VERMILLION, label=f"upper bound at a {curve.event}", **small)
        axes.plot(curve.times, curve.lower, "^", color=PURPLE, label=f"lower bound at a {curve.event}", **small)
        axes.plot(curve.times, curve.value(curve.times), "o", color=GIVEN, label=f"{curve.event} passed", **small)
        axes.set_ylabel(f"{curve.label} ${curve.symbol}$ [{curve.unit}]")
        axes.margins(x=0.01)
    panels[0].set_title(f"{curves[0].label} between its bounds")
    panels[-1].set_xlabel("time [s]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure
