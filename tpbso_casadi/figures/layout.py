"""Figures of layouts: the least cycle over a place, and the best so far of each search."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from problems.base import FloatArray
from tpbso_casadi.figures.style import ONE_COLUMN, in_print
from tpbso_casadi.layouts import CycleMap

LARGEST, EDGE = 1.5, 0.05  # m: what is larger does not widen a map; around what is drawn
COLOURS = "viridis_r"  # short cycles are bright


@in_print
def map_figure(drawn: CycleMap, outlines: Sequence[FloatArray], best: tuple[float, float]) -> Figure:
    """The least cycle where a place stands elsewhere; white where there is none.

    Args:
        drawn: the map.
        outlines: of what stands around, seen from above, (n, 2) each, m.
        best: where the place stands in the layout, m.
    """
    figure = Figure(figsize=(ONE_COLUMN * 1.4, ONE_COLUMN * 1.15), layout="constrained")
    axes = figure.subplots()
    seconds = np.ma.masked_invalid(drawn.seconds)
    mesh = axes.pcolormesh(drawn.x, drawn.y, seconds, shading="nearest", cmap=COLOURS)
    figure.colorbar(mesh, ax=axes, label="least cycle [s]")
    for outline in outlines:
        axes.add_patch(Polygon(outline, closed=True, fill=False, edgecolor="0.3", linewidth=0.7))
    axes.plot(*best, marker="+", color="black", markersize=9)
    small = [outline for outline in outlines if np.ptp(outline, axis=0).max() <= LARGEST]
    corners = np.concatenate([np.array([drawn.x[[0, -1]], drawn.y[[0, -1]]]).T, *small])
    (left, low), (right, high) = corners.min(axis=0) - EDGE, corners.max(axis=0) + EDGE
    axes.set_xlim(left, right)
    axes.set_ylim(low, high)
    axes.set_aspect("equal")
    axes.set_xlabel(f"x of {drawn.place} [m]")
    axes.set_ylabel(f"y of {drawn.place} [m]")
    return figure


@in_print
def convergence_figure(histories: Sequence[tuple[FloatArray, FloatArray]], certified: Sequence[float]) -> Figure:
    """The least cycle found so far in each search, and the cycles of the certified plans.

    Args:
        histories: evaluations and least cycle so far, (n,) each, s; infinite before there is one.
        certified: durations of certified plans, s.
    """
    figure = Figure(figsize=(ONE_COLUMN * 1.4, ONE_COLUMN), layout="constrained")
    axes = figure.subplots()
    for evaluations, seconds in histories:
        axes.step(evaluations, np.where(np.isfinite(seconds), seconds, np.nan), where="post", linewidth=1.0)
    for number, duration in enumerate(sorted(certified)):
        label = "certified plans" if number == 0 else None
        axes.axhline(duration, color="0.4", linestyle=":", linewidth=0.8, label=label)
    axes.set_xlabel("evaluations")
    axes.set_ylabel("least cycle [s]")
    if certified:
        axes.legend()
    return figure
