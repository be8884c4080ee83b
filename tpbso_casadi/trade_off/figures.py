"""The picture of a trade-off: every point, the front of each method as the line of what it dominates.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tpbso_casadi.figures.style.files import write_figure
from tpbso_casadi.figures.style.formats import DEFAULT
from tpbso_casadi.storage.files import writing
from tpbso_casadi.trade_off.front import Front
from tpbso_casadi.trade_off.point import Point, Standing
from tpbso_casadi.trade_off.table import FIGURE, TradeOff

STYLES = (("#1f77b4", "o"), ("#d62728", "s"), ("#2ca02c", "^"))  # a method each: colour, marker
LOGARITHMIC = 30.0  # from this ratio of largest to least on an axis is logarithmic


def draw_front(folder: Path, trade_off: TradeOff, formats: Sequence[str] = DEFAULT) -> None:
    """Write ``front.png``, or the same in other formats.

    Raises:
        OutputError: it cannot be written.
    """
    with writing(folder):
        write_figure(folder, FIGURE, front_figure(trade_off), formats)


def front_figure(trade_off: TradeOff) -> Figure:
    """The same as a figure."""
    figure = Figure(figsize=(6.4, 4.4), layout="constrained")
    axes = figure.subplots()
    for (method, front), (colour, marker) in zip(trade_off.fronts.items(), STYLES, strict=False):
        _draw_method(axes, method, front, trade_off.points[method], colour, marker)
    values = np.concatenate([np.empty((0, 2)), *(front.values for front in trade_off.fronts.values())])
    if len(values):
        ideal = values.min(axis=0)
        axes.plot(*ideal, "*", color="black", markersize=11, label="both at their best (no plan)", zorder=3)
        for scale, column in zip((axes.set_xscale, axes.set_yscale), values.T, strict=True):
            if column.min() > 0.0 and column.max() > LOGARITHMIC * column.min():
                scale("log")
    axes.set_xlabel(trade_off.headings[0])
    axes.set_ylabel(trade_off.headings[1])
    axes.grid(alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=9)
    return figure


def _draw_method(axes: Axes, method: str, front: Front, points: list[Point], colour: str, marker: str) -> None:
    """The front with its steps, and what is not on it."""
    if front.points:
        first, second = front.values.T
        axes.step(first, second, where="post", color=colour, alpha=0.35, linewidth=1.0)
        axes.plot(first, second, marker, color=colour, markersize=5, label=f"{method}: {len(first)} certified plans")
    dropped = [point.values for point in points if front.standings[point.number] is Standing.DOMINATED]
    if dropped:
        axes.plot(*np.array(dropped).T, marker, color=colour, markersize=4, fillstyle="none", alpha=0.5)
