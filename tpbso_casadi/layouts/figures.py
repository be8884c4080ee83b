"""Figures of layouts: the least cycle over a place, and the best so far of each search."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon, Rectangle

from problems.base import FloatArray
from tpbso_casadi.figures.palette import GREEN, line_of
from tpbso_casadi.figures.style import DPI, ONE_COLUMN, PlaceLabel, in_print, label_places, lay_out
from tpbso_casadi.layouts.cycle_map import CycleMap

LARGEST, EDGE = 1.5, 0.05  # m: what is larger does not widen a map; around what is drawn
COLOURS = "viridis_r"  # short cycles are bright
WIDTH, BESIDE, ABOVE, TALLEST = 4.9, 1.35, 0.85, 7.0  # inches: of a map; of what stands beside it, and above and below
NOTHING: dict[str, Any] = {"facecolor": "0.93", "hatch": "///", "edgecolor": "0.75", "linewidth": 0.0}
BEST: dict[str, Any] = {"marker": "+", "color": "black", "markersize": 9.0, "markeredgewidth": 1.5, "linestyle": "none"}


@in_print
def map_figure(drawn: CycleMap, outlines: Sequence[tuple[str, FloatArray]], best: tuple[float, float]) -> Figure:
    """The least cycle where a place stands elsewhere; hatched where there is none.

    Args:
        drawn: the map.
        outlines: of what stands around, seen from above, each with its name, (n, 2), m.
        best: where the place stands in the layout, m.
    """
    small = [(name, outline) for name, outline in outlines if np.ptp(outline, axis=0).max() <= LARGEST]
    low, high = _extent(drawn, [outline for _, outline in small])
    width, height = high - low
    inches = min(ABOVE + (WIDTH - BESIDE) * height / width, TALLEST)
    figure = Figure(figsize=(WIDTH, inches), dpi=DPI, layout="constrained")
    axes = figure.subplots()
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set(xlabel=f"x of {drawn.place} [m]", ylabel=f"y of {drawn.place} [m]")
    colours = _draw_cycles(figure, axes, drawn)
    for _, outline in outlines:
        axes.add_patch(Polygon(outline, closed=True, fill=False, edgecolor="0.2", linewidth=0.8))
    axes.plot(*best, **BEST)
    lay_out(figure)
    beside, place = colours.get_position(), axes.get_position()
    colours.set_position((beside.x0, place.y0, beside.width, place.height))  # as high as the map
    label_places(axes, _names(small), [np.vstack([outline, outline[:1]]) for _, outline in small])
    return figure


def _extent(drawn: CycleMap, outlines: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """The lower and the upper corner of what is drawn."""
    corners = np.concatenate([np.array([drawn.x[[0, -1]], drawn.y[[0, -1]]]).T, *outlines])
    return corners.min(axis=0) - EDGE, corners.max(axis=0) + EDGE


def _draw_cycles(figure: Figure, axes: Axes, drawn: CycleMap) -> Axes:
    """The map in colours, with what they mean beside it; returns the axes of the colours."""
    seconds = np.ma.masked_invalid(drawn.seconds)
    mesh = axes.pcolormesh(drawn.x, drawn.y, seconds, shading="nearest", cmap=COLOURS)
    handles: list[Patch | Line2D] = [Line2D([], [], label="best layout", **BEST)]
    if np.ma.is_masked(seconds):
        axes.add_patch(Rectangle(*_rectangle(drawn), zorder=0.5, **NOTHING))
        handles.append(Patch(label="no cycle", **NOTHING))
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
    return figure.colorbar(mesh, ax=axes, label="least cycle [s]").ax


def _rectangle(drawn: CycleMap) -> tuple[tuple[float, float], float, float]:
    """The lower left corner, width and height of all cells of a map, m."""
    (left, right), (low, high) = drawn.x[[0, -1]], drawn.y[[0, -1]]
    across, up = (right - left) / max(drawn.x.size - 1, 1), (high - low) / max(drawn.y.size - 1, 1)
    return (left - across / 2.0, low - up / 2.0), right - left + across, high - low + up


def _names(outlines: Sequence[tuple[str, FloatArray]]) -> list[PlaceLabel]:
    """One label for all outlines of a name, at their middle."""
    named = sorted(outlines, key=itemgetter(0))
    groups = {name: np.concatenate([each for _, each in group]) for name, group in groupby(named, key=itemgetter(0))}
    middles = {name: (corners.min(axis=0) + corners.max(axis=0)) / 2.0 for name, corners in groups.items() if name}
    return [PlaceLabel(name, middle) for name, middle in middles.items()]


@in_print
def convergence_figure(histories: Sequence[tuple[FloatArray, FloatArray]], certified: Sequence[float]) -> Figure:
    """The least cycle found so far in each search, and the cycles of the certified plans.

    Args:
        histories: evaluations and least cycle so far, (n,) each, s; infinite before there is one.
        certified: durations of certified plans, s.
    """
    figure = Figure(figsize=(ONE_COLUMN * 1.4, ONE_COLUMN), dpi=DPI, layout="constrained")
    axes = figure.subplots()
    for number, (evaluations, seconds) in enumerate(histories):
        known = np.where(np.isfinite(seconds), seconds, np.nan)
        label = "search" if len(histories) == 1 else f"search {number + 1}"
        axes.step(evaluations, known, where="post", label=label, **line_of(number))
    for number, duration in enumerate(sorted(certified)):
        label = f"{'_' * number}certified plans"  # a legend shows none that begins with _
        axes.axhline(duration, color=GREEN, linestyle="--", linewidth=0.8, label=label)
    axes.margins(y=0.08)
    axes.set_xlim(left=0)
    axes.set_xlabel("evaluations")
    axes.set_ylabel("least cycle so far [s]")
    axes.legend(loc="upper right")
    return figure
