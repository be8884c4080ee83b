"""The figure of a front.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tpbso_casadi.figures.palette import line_of, marker_of
from tpbso_casadi.figures.style import ONE_COLUMN, in_print
from tpbso_casadi.trade_off.front import Point, PointFront, Standing, TradeOff

SIZE = (ONE_COLUMN, 3.0)  # inches
LOGARITHMIC = 30.0  # from this ratio of largest to least on an axis is logarithmic


@in_print
def front_figure(trade_off: TradeOff) -> Figure:
    """Fronts with their steps, the plans that are dominated, and the point that no plan reaches."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    for number, (method, front) in enumerate(trade_off.fronts.items()):
        _draw_method(axes, method, front, trade_off.points[method], number)
    values = np.concatenate([np.empty((0, 2)), *(front.values for front in trade_off.fronts.values())])
    if len(values):
        ideal = values.min(axis=0)
        axes.plot(*ideal, "*", color="black", markersize=9, label="both at their best: no plan", zorder=3)
        for scale, column in zip((axes.set_xscale, axes.set_yscale), values.T, strict=True):
            if column.min() > 0.0 and column.max() > LOGARITHMIC * column.min():
                scale("log")
    axes.set_xlabel(trade_off.headings[0])
    axes.set_ylabel(trade_off.headings[1])
    first, second = (heading.split(" [")[0] for heading in trade_off.headings)
    axes.set_title(f"what less {first} costs in {second}", parse_math=False)
    if axes.get_legend_handles_labels()[0]:
        figure.legend(loc="outside lower center")
    return figure


def _draw_method(axes: Axes, method: str, front: PointFront, points: list[Point], number: int) -> None:
    """The front with its steps, and what is not on it."""
    line, marker = line_of(number), marker_of(number)
    if front.points:
        first, second = front.values.T
        axes.step(first, second, where="post", alpha=0.5, linewidth=1.0, **line)
        label = f"{method}: {len(first)} certified plans"
        axes.plot(first, second, marker, color=line["color"], linestyle="none", label=label)
    dropped = [point.values for point in points if front.standings[point.number] is Standing.DOMINATED]
    if dropped:
        dominated: dict[str, Any] = {
            "linestyle": "none",
            "fillstyle": "none",
            "alpha": 0.7,
            "label": f"{method}: dominated",
        }
        axes.plot(*np.array(dropped).T, marker, color=line["color"], markersize=4, **dominated)
