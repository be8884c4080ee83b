"""Three orthogonal views at one scale, to be measured in, and a picture in perspective.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from problems.base.matrix import FloatArray
from problems.tasks.drawing import MarkerKind
from tpbso_casadi.figures.moving import LABEL, SQUARE, draw_ways
from tpbso_casadi.figures.scene import MARKER_STYLES
from tpbso_casadi.figures.space.painter import Painting, solid
from tpbso_casadi.figures.space.polyhedron import Polyhedron
from tpbso_casadi.figures.space.scene import Scene, ground
from tpbso_casadi.figures.space.view import FRONT, SIDE, TOP, View
from tpbso_casadi.figures.style.colours import OBSTACLE

SIZE = 8.6  # inches: the longer side of all panels together
OPACITY = 0.55  # of obstacles in views that nothing covers anything in
FRAME_COLOURS = ("#d62728", "#2ca02c", "#1f77b4")  # of the axes x, y, z
VIEWS = {"top": (TOP, "x [m]", "y [m]"), "front": (FRONT, "x [m]", "z [m]"), "side": (SIDE, "y [m]", "z [m]")}


@dataclass(frozen=True)
class Posture:
    """A posture in a picture.

    Attributes:
        label: for a legend.
        colour: of it.
        theta: joint angles, (dof,), rad.
        time: at which obstacles that move are shown with it, s.
        opacity: of these obstacles.
    """

    label: str
    colour: str
    theta: FloatArray
    time: float = 0.0
    opacity: float = OPACITY


@dataclass(frozen=True)
class Points:
    """Positions (n, 3), m, and what a legend calls them."""

    label: str
    places: FloatArray


def space_figure(
    scene: Scene,
    postures: Sequence[Posture],
    way: Points | None = None,
    passed: Sequence[Points] = (),
    swept: FloatArray | None = None,
) -> Figure:
    """Top, front and side view of postures, and the last of them in perspective.

    Args:
        scene: robot, obstacles and markers.
        postures: to be shown.
        way: of the tool.
        passed: places of interest on it.
        swept: further postures (n, dof), rad, that have to fit in.
    """
    shown = np.array([posture.theta for posture in postures])
    bounds = scene.bounds(shown if swept is None else np.vstack([shown, swept]))
    width, depth, height = bounds[1] - bounds[0]
    scale = SIZE / max(width + depth, depth + height)
    figure = Figure(figsize=(scale * (width + depth) + 1.4, scale * (depth + height) + 1.9), layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(width, depth), height_ratios=(depth, height))
    top = figure.add_subplot(grid[0, 0])
    front = figure.add_subplot(grid[1, 0], sharex=top)
    side = figure.add_subplot(grid[1, 1], sharey=front)
    for axes, name in ((top, "top"), (front, "front"), (side, "side")):
        view, across, along = VIEWS[name]
        draw_measurable(axes, view, scene, postures)
        draw_way(axes, view, way, passed)
        low, high = view.project(bounds)
        axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel=across, ylabel=along)
        axes.set_title(name, loc="left", fontsize="medium")
        axes.grid(alpha=0.3)
        draw_ways(axes, [view.project(course.middles) for course in scene.courses])
    if scene.courses:
        top.plot([], [], label=LABEL, **SQUARE)
    picture = figure.add_subplot(grid[0, 1])
    view = scene.view(shown, bounds)
    draw_picture(picture, view, scene, postures[-1], bounds)
    draw_way(picture, view, way, passed)
    if scene.courses:
        draw_ways(picture, [view.project(course.middles) for course in scene.courses])
        picture.set_title(literal(postures[-1].label), fontsize="medium")
    figure.legend(*top.get_legend_handles_labels(), loc="outside lower center", ncols=4, frameon=False)
    return figure


def draw_way(axes: Axes, view: View, way: Points | None, passed: Sequence[Points]) -> None:
    """The way of the tool, and places on it."""
    if way is not None:
        axes.plot(*view.project(way.places).T, color="#1f4fd8", linewidth=2, label=way.label, zorder=3)
    for points in passed:
        axes.plot(*view.project(points.places).T, "D", color="#ff7f0e", markersize=7, label=points.label, zorder=5)


def draw_measurable(axes: Axes, view: View, scene: Scene, postures: Sequence[Posture]) -> None:
    """An orthogonal view: everything can be seen through."""
    standing = [solid for number, solid in enumerate(scene.solids) if number not in scene.moving]
    if standing:
        draw_solids(axes, view, standing, OPACITY)
        axes.plot([], [], "s", color=OBSTACLE, alpha=0.35, markersize=9, label="obstacle")
    for posture in postures if scene.moving else ():
        solids = scene.solids_at(posture.time)
        draw_solids(axes, view, [solids[number] for number in scene.moving], posture.opacity, posture.opacity)
    axes.plot(*view.project(np.array(scene.robot.base)), "s", color="black", markersize=7, label="base", zorder=5)
    for posture in postures:
        centers, skeleton = scene.centers(posture.theta[None])[0], scene.robot.skeleton(posture.theta[None])[0]
        sizes = 2.0 * scene.radii
        axes.add_collection(
            EllipseCollection(
                sizes, sizes, np.zeros(len(sizes)), units="xy", offsets=view.project(centers),
                offset_transform=axes.transData, facecolors=posture.colour, alpha=0.16, linewidths=0.0, zorder=2,
            ),
            autolim=False,
        )  # fmt: skip
        axes.plot(
            *view.project(skeleton).T, "-o", color=posture.colour, label=literal(posture.label), markersize=5,
            markerfacecolor="white", linewidth=1.8, zorder=4,
        )  # fmt: skip
    for marker in scene.markers:
        style = MARKER_STYLES[marker.kind]
        axes.plot(*view.project(marker.points).T, linestyle="none", color="#2ca02c", label=marker.label, **style)


def draw_solids(axes: Axes, view: View, solids: Sequence[Polyhedron], opacity: float, edges: float = 1.0) -> None:
    """Obstacles that can be seen through, with the opacity of their faces and of their edges."""
    polygons = [painted for polyhedron in solids for painted in solid(view, polyhedron, opacity)]
    corners, faces, lines = zip(*polygons, strict=True)
    lines = tuple((*line[:3], edges * line[3]) for line in lines)
    axes.add_collection(PolyCollection(corners, facecolors=faces, edgecolors=lines, linewidths=0.7, zorder=1))


def literal(label: str) -> str:
    """A label that is shown as it is, not as a formula, whatever it is."""
    return label.replace("$", r"\$")


@dataclass(frozen=True)
class Picture:
    """What changes with the posture in a view in perspective: painted balls and solids, and a line."""

    painting: Painting
    arm: Line2D


def draw_picture(axes: Axes, view: View, scene: Scene, posture: Posture, bounds: FloatArray) -> Picture:
    """A posture in perspective, over the ground."""
    draw_ground(axes, view, scene, bounds)
    painting = Painting(axes, view, scene, posture.colour)
    painting.show(scene.centers(posture.theta[None])[0], posture.time)
    skeleton = scene.robot.skeleton(posture.theta[None])[0]
    arm = axes.plot(*view.project(skeleton).T, "-", color=posture.colour, linewidth=1.6, alpha=0.8, zorder=4)[0]
    for marker in scene.markers:
        if marker.kind is not MarkerKind.POINTS:
            style = MARKER_STYLES[marker.kind]
            axes.plot(*view.project(marker.points).T, linestyle="none", color="#2ca02c", **style)
    corner = np.array(np.meshgrid(*bounds.T)).reshape(3, -1).T
    seen = view.project(corner)
    (left, bottom), (right, top) = seen.min(axis=0), seen.max(axis=0)
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top))
    axes.set_axis_off()
    return Picture(painting, arm)


def draw_ground(axes: Axes, view: View, scene: Scene, bounds: FloatArray) -> None:
    """Lines on the ground below everything, and the axes x, y, z at the base."""
    for line in ground(bounds):
        axes.plot(*view.project(line).T, color="0.85", linewidth=0.6, zorder=0)
    base = np.array(scene.robot.base)
    for axis, colour in enumerate(FRAME_COLOURS):
        tip = base + 0.15 * float(np.ptp(bounds, axis=0).max()) * np.eye(3)[axis]
        axes.plot(*view.project(np.array([base, tip])).T, color=colour, linewidth=1.5, zorder=1)
        axes.annotate("xyz"[axis], tuple(view.project(tip)), color=colour, ha="center", va="center", zorder=1)
