"""Obstacles that move in a figure: where they are at some times, from light to strong, and the way of each.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.courses import Course
from tpbso_casadi.figures.scene import draw_obstacle
from tpbso_casadi.figures.style.colours import COURSE, OBSTACLE

LABEL = "moving obstacle"
SQUARE: dict[str, Any] = {"marker": "s", "linestyle": "none", "color": OBSTACLE, "alpha": 0.35, "markersize": 9}


def draw_moving(axes: Axes, courses: Sequence[Course], opacities: Sequence[float]) -> None:
    """Draw obstacles in the plane at each time of their courses, with one opacity for each time."""
    for course in courses:
        for outline, opacity in zip(course.outlines, opacities, strict=True):
            draw_obstacle(axes, outline, opacity)
    axes.plot([], [], label=LABEL, **SQUARE)


def draw_ways(axes: Axes, ways: Sequence[FloatArray]) -> None:
    """Draw where the middles of obstacles go, each (n, 2): a thin line, an arrow where it leaves the axes or ends."""
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    for number, way in enumerate(ways):
        label = "its way" if number == 0 else None
        axes.plot(*way.T, color=COURSE, linewidth=0.9, label=label, zorder=2)
        seen = np.flatnonzero(((way > low) & (way < high)).all(axis=1))
        before = np.flatnonzero(np.linalg.norm(way[: seen[-1]] - way[seen[-1]], axis=1) > 0.0) if seen.size else seen
        if before.size:
            style = {"arrowstyle": "-|>", "color": COURSE, "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
            axes.annotate("", way[seen[-1]], way[before[-1]], arrowprops=style, zorder=2)
