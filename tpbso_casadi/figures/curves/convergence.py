"""The figure of a search: the best cost so far.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.style.colours import BLUE, GREEN, VERMILLION
from tpbso_casadi.figures.style.labels import EndLabel, label_ends
from tpbso_casadi.figures.style.paper import ONE_COLUMN, in_print
from tpbso_casadi.planning.plan import convergence, first_feasible, step_name
from tpbso_casadi.planning.planned_motion import SearchedMotion

HEIGHT = 2.6  # inches
DECADES = 30.0  # from this ratio of the largest to the least cost on the axis is logarithmic


@in_print
def convergence_figure(plan: SearchedMotion) -> Figure:
    """(a) The best cost so far over the iterations; the infeasible phase is marked, as its cost is a penalty."""
    figure = Figure(figsize=(ONE_COLUMN, HEIGHT), layout="constrained")
    axes = figure.subplots()
    iterations, cost = convergence(plan.search)
    objective, first = plan.problem.objective, first_feasible(plan)
    solver = plan.scenario.solver.name.rsplit(":")[-1].upper()
    axes.set_xlabel(step_name(plan.search))
    axes.set_ylabel(f"best {objective.name} so far [{objective.unit}]" if first is not None else "penalised cost")
    axes.set_xlim(0, max(int(iterations[-1]), 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    if first is None:
        axes.set_title(f"{solver}: no feasible candidate")
        draw_cost(axes, iterations, cost, VERMILLION)
        return figure
    axes.set_title(f"{solver}: {plan.search.evaluations} evaluations")
    draw_cost(axes, iterations[first:], cost[first:], BLUE)
    labels = [EndLabel(f"{cost[-1]:.4g}", cost[-1], BLUE)]
    if plan.polish is not None and plan.polish.accepted:
        polished = plan.polish.after.objective
        axes.axhline(polished, color=GREEN, linestyle="--")
        labels.append(EndLabel(f"{polished:.4g}, polished", polished, GREEN))
    if first > 0:
        label = "nothing feasible yet"
        axes.axvspan(0, iterations[first], facecolor="0.88", hatch="///", edgecolor="0.75", linewidth=0.0, label=label)
        axes.legend(loc="upper right")
    label_ends(axes, labels)
    return figure


def draw_cost(axes: Axes, iterations: FloatArray, cost: FloatArray, colour: str) -> None:
    """The cost as steps, on a logarithmic axis where it spans decades."""
    axes.step(iterations, cost, where="post", color=colour)
    axes.plot(iterations[-1], cost[-1], "o", color=colour, markersize=3.5, clip_on=False)
    known = cost[np.isfinite(cost)]
    if known.size and known.min() > 0.0 and known.max() > DECADES * known.min():
        axes.set_yscale("log")
    axes.margins(y=0.08)
