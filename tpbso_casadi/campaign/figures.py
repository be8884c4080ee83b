"""The picture of a comparison: every run, by case and solver.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tpbso_casadi.campaign.statistics import Summary
from tpbso_casadi.storage.files import write_with

COLUMNS = 3
COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#e377c2", "#17becf")


def draw_comparison(path: Path, summaries: Sequence[Summary]) -> None:
    """Write a panel a case: each run a point, the mean a line, runs without a feasible plan counted above.

    Raises:
        OSError: it cannot be written.
    """
    figure = comparison_figure(summaries)
    write_with(path, lambda temporary: figure.savefig(temporary, dpi=130))


def comparison_figure(summaries: Sequence[Summary]) -> Figure:
    """The same as a figure."""
    cases = list(dict.fromkeys(summary.case for summary in summaries))
    columns = min(COLUMNS, len(cases))
    rows = ceil(len(cases) / columns)
    figure = Figure(figsize=(4.4 * columns, 3.4 * rows), layout="constrained")
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, case in zip(panels, cases, strict=False):
        draw_case(axes, case, [summary for summary in summaries if summary.case == case])
    for axes in panels[len(cases) :]:
        axes.set_axis_off()
    return figure


def draw_case(axes: Axes, title: str, summaries: Sequence[Summary]) -> None:
    """One panel."""
    for place, summary in enumerate(summaries):
        draw_runs(axes, place, summary, COLOURS[place % len(COLOURS)])
    axes.set_xticks(range(len(summaries)), [wrapped(summary.solver) for summary in summaries], rotation=30, ha="right")
    axes.set_xlim(-0.6, len(summaries) - 0.4)
    axes.set_ylabel(f"[{summaries[0].unit}]")
    axes.set_title(title)
    axes.grid(axis="y", alpha=0.3)


def wrapped(label: str) -> str:
    """A solver's label with each of its settings on a line."""
    return label.replace("(", "(\n").replace(",", ",\n")


def draw_runs(axes: Axes, place: float, summary: Summary, colour: str, width: float = 0.5) -> None:
    """The runs of one solver at a place of the x axis."""
    objectives = summary.feasible_objectives
    spread = place + width * (np.arange(objectives.size) % 5 - 2) / 8.0
    axes.plot(spread, objectives, "o", color=colour, alpha=0.45, markersize=4, markeredgewidth=0.0)
    if objectives.size:
        axes.hlines(summary.mean, place - width / 2.0, place + width / 2.0, color=colour, linewidth=2.2)
    if summary.infeasible:
        note = f"{summary.infeasible} of {summary.objectives.size}\ninfeasible"
        axes.annotate(
            note, (place, 0.98), xycoords=axes.get_xaxis_transform(), ha="center", va="top", fontsize=7, color=colour
        )
