"""Names beside the ends of lines, moved apart where they would overlap."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.style.colours import colour_of

FONT_SIZE = 8
LINE_HEIGHT = 1.25 * FONT_SIZE / 72.0  # in
LEADER = 12.0 / 72.0  # in, from the end of a line to its name


def spread(places: Sequence[float], least: float) -> FloatArray:
    """Places from 0 to 1 (n,), in their order, moved as little as needed to be at least so far apart.

    Where there is no room for all of them they are evenly spaced.
    """
    order = np.argsort(places, kind="stable")
    distance = min(least, 1.0 / max(1, len(places) - 1))
    steps = distance * np.arange(len(places))
    moved = np.array(places)
    moved[order] = np.clip(_ascending(moved[order] - steps), 0.0, 1.0 - steps[-1] if len(places) else 1.0) + steps
    return moved


def _ascending(values: FloatArray) -> FloatArray:
    """The nearest sequence that never falls, in least squares: neighbours that do are pooled (Ayer et al., 1955)."""
    pools: list[tuple[float, int]] = []
    for value in values:
        pools.append((float(value), 1))
        while len(pools) > 1 and pools[-2][0] >= pools[-1][0]:
            (last, size), (mean, count) = pools.pop(), pools.pop()
            pools.append(((last * size + mean * count) / (size + count), size + count))
    return np.repeat([mean for mean, _ in pools], [count for _, count in pools])


def label_ends(axes: Axes, ends: Mapping[str, float]) -> None:
    """Write the name of each line to the right of a panel, at the height of its end, joined to it in its colour.

    Args:
        axes: whose place and limits are final.
        ends: heights by name, in data coordinates, in the order of the colours.
    """
    to_axes, left = axes.transData + axes.transAxes.inverted(), axes.get_xlim()[0]
    places = [float(np.clip(to_axes.transform((left, height))[1], 0.0, 1.0)) for height in ends.values()]
    box = axes.get_window_extent()
    heights = spread(places, LINE_HEIGHT * axes.figure.dpi / box.height)
    leader = 1.0 + LEADER * axes.figure.dpi / box.width
    for index, (name, place, height) in enumerate(zip(ends, places, heights, strict=True)):
        axes.annotate(
            name,
            (1.0, place),
            (leader, float(height)),
            xycoords="axes fraction",
            textcoords="axes fraction",
            fontsize=FONT_SIZE,
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour_of(index), "lw": 1.4, "shrinkA": 1, "shrinkB": 0},
        )
