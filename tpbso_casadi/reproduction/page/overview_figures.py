"""Fig. 17 and the pictures of Tables 2 and 3.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from tpbso_casadi.campaign.figures.runs import draw_runs
from tpbso_casadi.figures.style.colours import colour_of, line_of, marker_of
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import BASES
from tpbso_casadi.reproduction.page.case_figures import Picture, webp
from tpbso_casadi.reproduction.paper import NAMES, ROTATION, TIME, Order

SOLVERS = ("ga", "pso", "bso")
OFFSET = 0.26  # between the solvers of one case


def figure_17(evidence: Evidence) -> Picture:
    """Every run of the three solvers, two to five links: time left, rotation right, a row for each basis."""
    figure = Figure(figsize=(11.0, 7.6), layout="constrained")
    panels = figure.subplots(len(BASES), 2)
    for row, basis in zip(panels, BASES, strict=True):
        for axes, cases, quantity in zip(row, (TIME, ROTATION), ("time [s]", "joint rotation [rad]"), strict=True):
            for place, case in enumerate(cases):
                for index, solver in enumerate(SOLVERS):
                    summary, centre = evidence.of(case, solver, basis), place + OFFSET * (index - 1)
                    draw_runs(axes, centre, summary, colour_of(index), OFFSET * 0.8, marker_of(index))
            axes.set_xticks(range(len(cases)), [case.rsplit("-", 1)[1] for case in cases])
            axes.set(xlabel="links", ylabel=quantity, title=basis)
            axes.grid(axis="y", alpha=0.3)
    for index, solver in enumerate(SOLVERS):
        panels[0, 0].plot([], [], marker_of(index), color=colour_of(index), label=NAMES[solver])
    panels[0, 0].legend(loc="upper left")
    return Picture("each run a point, the mean of the feasible ones a line", webp(figure))


def scaling_figure(scaling: Mapping[str, Any], orders: Mapping[str, Order], unit: str) -> Picture:
    """One panel for each experiment and symbol, both axes logarithmic; dotted: the printed power."""
    panels = [(experiment, symbol) for experiment in orders for symbol in scaling[experiment]]
    columns = 4
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(11.0, 2.5 * rows), layout="constrained")
    all_axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (experiment, symbol) in zip(all_axes, panels, strict=False):
        for solver, row in scaling[experiment][symbol].items():
            sizes, values = np.array(row["sizes"], dtype=np.float64), np.array(row["values"])
            index = SOLVERS.index(solver)
            axes.loglog(sizes, values, **line_of(index), marker=marker_of(index), label=NAMES[solver], markersize=4)
            power = orders[experiment].exponents[symbol]
            axes.loglog(sizes, values[-1] * (sizes / sizes[-1]) ** power, ":", color="0.5", zorder=0)
        axes.set_title(f"{orders[experiment].title}: ${symbol[0]}_{{{symbol[2:]}}}$", fontsize=9)
        axes.set_xticks(sizes, [f"{size:g}" for size in sizes])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.tick_params(labelsize=7, which="both")
        axes.grid(alpha=0.3)
    for axes in all_axes[len(panels) :]:
        axes.set_axis_off()
    all_axes[0].set_ylabel(unit)
    all_axes[0].legend(fontsize=7)
    return Picture(f"{unit} against each size; dotted: the printed growth through the largest", webp(figure))
