"""The surroundings of an arm in a figure or a film: base, obstacles, and what the tip has to reach.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from problems import Robot
from problems.assembly.criteria import Criteria
from problems.base.matrix import FloatArray
from problems.robots.robot import Body
from problems.scene.obstacle import standing
from problems.tasks.drawing import MarkerKind
from tpbso_casadi.figures.style.colours import GIVEN, OBSTACLE

MARKER_STYLES: dict[MarkerKind, dict[str, Any]] = {
    MarkerKind.START: {"marker": "x", "markersize": 7, "markeredgewidth": 2.0, "zorder": 6},
    MarkerKind.GOAL: {"marker": "*", "markersize": 10, "zorder": 6},
    MarkerKind.POINTS: {"marker": ".", "markersize": 4, "zorder": 2},
}


def draw_scene(axes: Axes, problem: Criteria) -> None:
    """Draw the base of the arm, the obstacles that stand and the markers of the task."""
    axes.plot(*problem.robot.base, "s", color="black", markersize=6, label="base", zorder=5)
    for number, obstacle in enumerate(standing(problem.obstacles)):
        draw_obstacle(axes, obstacle.outline()).set_label("_" if number else "obstacle")
    for marker in problem.markers():
        x, y = marker.points.T
        axes.plot(x, y, linestyle="none", color=GIVEN, label=marker.label, **MARKER_STYLES[marker.kind])


def draw_obstacle(axes: Axes, outline: FloatArray, alpha: float = 0.35) -> Polygon:
    """Draw an obstacle by its outline (n, 2), m."""
    patch = Polygon(outline, facecolor=(OBSTACLE, alpha), edgecolor=(OBSTACLE, min(1.0, 2.0 * alpha)), linewidth=0.8)
    axes.add_patch(patch)
    return patch


def draw_bodies(axes: Axes, robot: Robot, skeleton: FloatArray, colour: str) -> list[Polygon]:
    """Draw the bodies that are thicker than a line, to scale.

    Args:
        axes: to draw into.
        robot: whose bodies.
        skeleton: where its frames are, (frames, 2), m.
        colour: of all of them.
    """
    outlines = [capsule(body, skeleton) for body in wide_bodies(robot)]
    patches = [Polygon(outline, color=colour, alpha=0.25, linewidth=0.0, zorder=3) for outline in outlines]
    for patch in patches:
        axes.add_patch(patch)
    return patches


def wide_bodies(robot: Robot) -> list[Body]:
    """The bodies that are thicker than a line."""
    return [body for body in robot.bodies if float(body.radius) > 0.0]


def capsule(body: Body, skeleton: FloatArray, count: int = 16) -> FloatArray:
    """The outline of a body in the plane: half a circle around each end; (2 count, 2), m."""
    start, end = skeleton[body.start], skeleton[body.end]
    ahead = np.arctan2(*(end - start)[::-1])
    turn = np.linspace(-np.pi / 2.0, np.pi / 2.0, count)
    phases, centres = np.concatenate([ahead + turn, ahead + np.pi + turn]), np.repeat([end, start], count, axis=0)
    return np.asarray(centres + float(body.radius) * np.column_stack([np.cos(phases), np.sin(phases)]))
