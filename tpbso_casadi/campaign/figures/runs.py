"""The runs of one solver as points beside each other, with what is typical of them."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.statistics import Summary


def draw_points(
    axes: Axes, place: float, values: FloatArray, colour: str, marker: str = "o", width: float = 0.5
) -> None:
    """Points at a place of the x axis, beside each other so that equal ones can be seen."""
    spread = place + width * (np.arange(values.size) % 5 - 2) / 8.0
    axes.plot(spread, values, marker, color=colour, alpha=0.5, markersize=4, markeredgewidth=0.0, linestyle="none")


def draw_runs(axes: Axes, place: float, summary: Summary, colour: str, width: float = 0.5, marker: str = "o") -> None:
    """The objectives of one solver's plans, their mean a line; how many runs have no plan stands above."""
    objectives = summary.feasible_objectives
    draw_points(axes, place, objectives, colour, marker, width)
    if objectives.size:
        axes.hlines(summary.mean, place - width / 2.0, place + width / 2.0, color=colour, linewidth=2.2)
    if summary.infeasible:
        note = f"{summary.infeasible} of {summary.objectives.size}\ninfeasible"
        axes.annotate(
            note, (place, 0.98), xycoords=axes.get_xaxis_transform(), ha="center", va="top", fontsize=7, color=colour
        )
