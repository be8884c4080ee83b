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
from tpbso_casadi.planning.plan import convergence, step_name
from tpbso_casadi.planning.planned_motion import PlannedMotion, SearchedMotion


def progress_figures(plan: SearchedMotion) -> dict[str, tuple[str, Figure]]:
    """By file name, the caption and the figure of each of the problem's progress measures."""
    return {
        measure.name: (measure.label, progress_figure(plan, measure)) for measure in plan.problem.progress_measures()
    }


def progress_figure(plan: SearchedMotion, measure: ProgressMeasure) -> Figure:
    """A measure of the best candidate so far over the iterations."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    iterations, _ = convergence(plan.search)
    axes.step(iterations, progress_history(plan, measure), where="post", color="#1f77b4")
    axes.axhline(measure.limit, color="0.25", linestyle="--", linewidth=1.0, label="limit")
    axes.set_xlabel(step_name(plan.search))
    axes.set_ylabel(f"{measure.label} [{measure.unit}]")
    axes.set_title(measure.title)
    axes.set_xlim(0, max(int(iterations[-1]), 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(0.0, 1.1 * max(axes.get_ylim()[1], measure.limit))
    axes.grid(alpha=0.3)
    axes.legend()
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
    curves = plan.criteria.bounded_curves(plan.trajectory)
    groups = {name: tuple(group) for name, group in groupby(curves, key=lambda curve: curve.name)}
    return {name: (group[0].label, curve_figure(plan.times, group)) for name, group in groups.items()}


def curve_figure(times: FloatArray, curves: Sequence[BoundedCurve]) -> Figure:
    """Each curve at times (n,) in s over its bounds, one panel each."""
    figure = Figure(figsize=(6.8, 1.6 + 2.8 * len(curves)), layout="constrained")
    panels = figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0]
    for axes, curve in zip(panels, curves, strict=True):
        axes.plot(times, curve.value(times), color="#1f4fd8", label="planned")
        axes.plot(curve.times, curve.upper, ".", color="#d62728", label=f"upper bound at a {curve.event}")
        axes.plot(curve.times, curve.lower, ".", color="#9467bd", label=f"lower bound at a {curve.event}")
        passed = curve.value(curve.times)
        axes.plot(curve.times, passed, "*", color="#2ca02c", markersize=5, label=f"{curve.event} passed")
        axes.set_ylabel(f"{curve.label} ${curve.symbol}$ [{curve.unit}]")
        axes.grid(alpha=0.3)
        axes.margins(x=0.01)
    panels[-1].set_xlabel("time [s]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    return figure
