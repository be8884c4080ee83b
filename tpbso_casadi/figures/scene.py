"""The surroundings of an arm in a figure or a film: base, obstacles, and what the tip has to reach.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from problems.assembly.criteria import Criteria
from problems.tasks.drawing import MarkerKind

MARKER_STYLES: dict[MarkerKind, dict[str, Any]] = {
    MarkerKind.START: {"marker": "x", "markersize": 9, "markeredgewidth": 2.2, "zorder": 6},
    MarkerKind.GOAL: {"marker": "*", "markersize": 12, "zorder": 6},
    MarkerKind.POINTS: {"marker": "*", "markersize": 8, "zorder": 2},
}


def draw_scene(axes: Axes, problem: Criteria) -> None:
    """Draw the base of the arm, the obstacles and the markers of the task."""
    axes.plot(*problem.robot.base, "s", color="black", markersize=8, label="base", zorder=5)
    for obstacle in problem.obstacles:
        axes.add_patch(Polygon(obstacle.outline(), color="#d62728", alpha=0.35))
    for marker in problem.markers():
        x, y = marker.points.T
        axes.plot(x, y, linestyle="none", color="#2ca02c", label=marker.label, **MARKER_STYLES[marker.kind])
