"""Maps of what an arm reaches, in two sections through its base."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems.base import FloatArray
from tpbso_casadi.figures.style import TWO_COLUMNS, in_print

SECTIONS = ((1, "x", "z", "y"), (2, "x", "y", "z"))  # across which axis, and the names of the other two and of this one
COLOURS = "viridis"
SECTION_POINTS = 150.0  # points of print across a section


@in_print
def reach_figure(points: FloatArray, share: FloatArray, title: str) -> Figure:
    """The share of ways to turn the tool in which points are reached and clear: from the side, and from above.

    Of points that nothing reaches only the place is drawn. The sections are those planes of points in which most is
    reached.

    Args:
        points: (n, 3), m.
        share: of each, (n,).
        title: of the figure.
    """
    figure = Figure(figsize=(TWO_COLUMNS, 3.6), layout="constrained")
    for axes, (across, right, up, name) in zip(figure.subplots(1, 2), SECTIONS, strict=True):
        place = _fullest(points[:, across], share)
        in_section = np.isclose(points[:, across], place)
        _draw(axes, np.delete(points[in_section], across, axis=1), share[in_section])
        axes.set_xlabel(f"{right} [m]")
        axes.set_ylabel(f"{up} [m]")
        axes.set_title(f"{name} = {place:.3g} m")
    colours = figure.axes[0].collections[-1]
    figure.colorbar(colours, ax=figure.axes, label="share of orientations, reached and clear", shrink=0.9)
    figure.suptitle(title)
    return figure


def _fullest(places: FloatArray, share: FloatArray) -> float:
    """The coordinate at which most is reached, of those that there are."""
    values, which = np.unique(np.round(places, 9), return_inverse=True)
    return float(values[np.argmax(np.bincount(which, weights=share + 1e-9))])


def _draw(axes: Axes, points: FloatArray, share: FloatArray) -> None:
    (x, y), some = points.T, share > 0.0
    axes.scatter(x[~some], y[~some], s=1.0, color="0.85", linewidths=0.0)
    apart = np.diff(np.unique(np.round(x, 9)))
    extent = float(np.ptp(points, axis=0).max()) or 1.0
    size = (SECTION_POINTS * (apart.min() if apart.size else 0.1 * extent) / extent) ** 2
    drawn: dict[str, Any] = {"cmap": COLOURS, "vmin": 0.0, "vmax": 1.0, "marker": "s", "linewidths": 0.0}
    axes.scatter(x[some], y[some], s=size, c=share[some], **drawn)
    axes.set_aspect("equal")
