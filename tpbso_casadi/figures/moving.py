"""Obstacles that move in a figure: where they are at some times, from light to strong, and the way of each.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.courses import Course
from tpbso_casadi.figures.scene import draw_obstacle
from tpbso_casadi.figures.style.colours import COURSE, OBSTACLE
from tpbso_casadi.figures.style.places import PlaceLabel

LABEL = "moving obstacle"
SLOW = 0.5  # of its width: what moves less between two times has one label for both
SQUARE: dict[str, Any] = {"marker": "s", "linestyle": "none", "color": OBSTACLE, "alpha": 0.35, "markersize": 9}


def draw_moving(axes: Axes, courses: Sequence[Course], opacities: Sequence[float], label: str = LABEL) -> None:
    """Draw obstacles in the plane at each time of their courses, with one opacity for each time."""
    for course in courses:
        for outline, opacity in zip(course.outlines, opacities, strict=True):
            draw_obstacle(axes, outline, opacity)
    axes.plot([], [], label=label, **SQUARE)


def time_labels(courses: Sequence[Course]) -> list[PlaceLabel]:
    """The times at which obstacles are drawn, beside their middles; of one that hardly moves, from when to when."""
    return [PlaceLabel(text, place, COURSE) for course in courses for text, place in labelled_times(course)]


def labelled_times(course: Course) -> Iterator[tuple[str, FloatArray]]:
    """Times of an obstacle, those between which it hardly moves together, and where its middle is then, (2,), m."""
    least = SLOW * float(np.ptp(course.outlines[0], axis=0).min())
    groups: list[list[int]] = []
    for row in np.argsort(course.times, kind="stable").tolist():
        if groups and np.linalg.norm(course.middles[row] - course.middles[groups[-1][0]]) < least:
            groups[-1].append(row)
        else:
            groups.append([row])
    for group in groups:
        first, last = (f"{course.times[row]:.3g}" for row in (group[0], group[-1]))
        yield (f"{first} s" if first == last else f"{first} to {last} s"), course.middles[group].mean(axis=0)


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
