"""Effect sizes of each solver against each: A12 of Vargha and Delaney, over all cases and by case.

[1] A. Vargha, H. D. Delaney, "A critique and improvement of the CL common language effect size statistics of McGraw
    and Wong", Journal of Educational and Behavioral Statistics 25, 2000.
"""

from __future__ import annotations

from math import ceil

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.figures.style.colours import BLUE, VERMILLION
from tpbso_casadi.figures.style.paper import SMALL, in_print

COLUMNS = 3
WORSE_TO_BETTER = LinearSegmentedColormap.from_list("worse to better", [VERMILLION, "#f7f7f7", BLUE])
DARK_BLUE = 0.8  # from there on numbers are white
ON_LIGHT = "#000001"  # the others, whatever colour letters have elsewhere


@in_print
def effect_sizes_figure(results: Results) -> Figure:
    """A matrix over all cases, and where there are more of them one for each."""
    by_case = {case: results.effect_sizes(case) for case in results.cases}
    matrices = by_case if len(by_case) == 1 else {"mean over cases": np.mean(list(by_case.values()), axis=0), **by_case}
    columns = min(COLUMNS, len(matrices))
    rows = ceil(len(matrices) / columns)
    size = 1.0 + 0.42 * len(results.solvers)
    figure = Figure(figsize=(max(5.0, (size + 0.3) * columns), 0.5 + size * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (title, matrix) in zip(panels, matrices.items(), strict=False):
        draw_matrix(axes, title, matrix, results.solvers)
    for axes in panels[len(matrices) :]:
        axes.set_axis_off()
    figure.suptitle("A12: how probably a run of the row is better than one of the column")
    return figure


def draw_matrix(axes: Axes, title: str, matrix: FloatArray, solvers: list[str]) -> None:
    """One matrix (k, k), its numbers in the cells; blue where the row is better, vermillion where it is worse."""
    shown = np.ma.masked_array(matrix, np.eye(len(matrix), dtype=bool))
    edges = np.arange(len(matrix) + 1) - 0.5
    axes.pcolormesh(edges, edges, shown, cmap=WORSE_TO_BETTER, vmin=0.0, vmax=1.0)
    axes.set(aspect="equal", ylim=(len(matrix) - 0.5, -0.5))
    for (row, column), value in np.ndenumerate(matrix):
        if row != column:
            colour = "white" if value >= DARK_BLUE else ON_LIGHT
            axes.text(column, row, f"{value:.2f}", ha="center", va="center", color=colour, fontsize=SMALL)
    places = range(len(solvers))
    axes.set_xticks(places, solvers, rotation=35, ha="right", rotation_mode="anchor", fontsize=SMALL)
    axes.set_yticks(places, solvers, fontsize=SMALL)
    axes.tick_params(length=0)
    axes.grid(visible=False)
    axes.set_title(title)
