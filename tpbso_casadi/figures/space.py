"""Robots and scenes in space: bodies painted from back to front, three views, and a picture in perspective.

Of two things that a plane parts, the one on the eye's side of it is never covered by the other.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch

from problems.base import FloatArray
from problems.robots import Robot, RobotDescription
from problems.tasks import MarkerKind
from tpbso_casadi.figures.appearance import LIGHT, front_of, layers, palette_of, placed_corners, silhouette
from tpbso_casadi.figures.palette import BLUE, CLOSEST, GREEN, OBSTACLE, PATH, VERMILLION
from tpbso_casadi.figures.scene import DIAMOND, LABEL, MARKER_STYLES, SQUARE, Points, draw_band, draw_ways
from tpbso_casadi.figures.space_scene import FRONT, SIDE, TOP, Polyhedron, Scene, View, ground
from tpbso_casadi.figures.style import (
    ONE_COLUMN,
    TWO_COLUMNS,
    PlaceLabel,
    in_print,
    label_places,
    lay_out,
    title_figure,
    write_figure,
)


def painting_order(
    view: View,
    centers: FloatArray,
    radii: FloatArray,
    solids: Sequence[Polyhedron],
    planes: dict[tuple[int, int], int],
) -> list[int]:
    """Numbers of things, the first to be painted first: balls 0, 1, ..., then solids.

    Args:
        view: where they are seen from.
        centers: of the balls, (n, 3), m.
        radii: of the balls, (n,), m.
        solids: that no ball is in.
        planes: that part the solids, of :func:`separating_planes`.
    """
    boxes = np.array([*_ball_boxes(view, centers, radii), *(_solid_box(view, solid) for solid in solids)])
    lower, upper = boxes.reshape(-1, 2, 2).transpose(1, 0, 2)
    overlap = ((lower[:, None] < upper) & (lower < upper[:, None])).all(axis=2)
    depths = view.depth(np.vstack([centers, *(solid.center[None] for solid in solids)]))
    before = overlap & _behind(view, centers, solids, planes, depths)
    return _sorted(before, np.argsort(depths).tolist())


def _behind(
    view: View,
    centers: FloatArray,
    solids: Sequence[Polyhedron],
    planes: dict[tuple[int, int], int],
    depths: FloatArray,
) -> np.ndarray:
    """Whether a thing (row) is behind another (column)."""
    balls = len(centers)
    behind = depths[:, None] < depths
    seen = [view.sees(solid.normals, solid.offsets) for solid in solids]
    for number, solid in enumerate(solids, start=balls):
        if balls:
            in_front = seen[number - balls][solid.beyond(centers).argmax(axis=1)]
            behind[number, :balls], behind[:balls, number] = in_front, ~in_front
    for (a, b), face in planes.items():
        behind[balls + a, balls + b] = seen[a][face]
        behind[balls + b, balls + a] = not seen[a][face]
    return behind


def _ball_boxes(view: View, centers: FloatArray, radii: FloatArray) -> FloatArray:
    middles = view.project(centers)
    seen = (radii * view.magnification(centers))[:, None]
    return np.stack([middles - seen, middles + seen], axis=1)


def _solid_box(view: View, solid: Polyhedron) -> FloatArray:
    seen = view.project(solid.vertices)
    return np.array([seen.min(axis=0), seen.max(axis=0)])


def _sorted(before: np.ndarray, numbers: list[int]) -> list[int]:
    """The numbers so that each comes after all that must be before it, unless these go round in a circle."""
    needed = [np.flatnonzero(column).tolist() for column in before.T]
    placed: dict[int, None] = {}
    visited = np.zeros(len(numbers), dtype=bool)
    for first in numbers:
        stack = [first]
        while stack:
            number = stack[-1]
            if not visited[number]:
                visited[number] = True
                stack += [other for other in needed[number] if not visited[other]]
            else:
                placed.setdefault(stack.pop())
    return list(placed)


ROUND = np.linspace(0.0, 2.0 * np.pi, 28, endpoint=False)
LAYERS = ((1.0, 0.0), (0.8, 0.22), (0.55, 0.42), (0.28, 0.62))  # of a ball: size, and how far it is lit
FACE_ALPHA, BACK_ALPHA, EDGE_ALPHA = 0.30, 0.12, 0.55

Painted = tuple[FloatArray, tuple[float, ...], tuple[float, ...]]  # corners (n, 2), colours of face and edge with alpha


class Painting:
    """A robot and solids in a picture: its links as they look, and balls where that is not known.

    Args:
        axes: of the picture.
        view: from where.
        scene: robot and obstacles.
        colour: of the balls.
    """

    def __init__(self, axes: Axes, view: View, scene: Scene, colour: str) -> None:
        self._view, self._scene, self._colour = view, scene, colour
        self._painted = [list(solid(view, polyhedron)) for polyhedron in scene.solids]
        self._palette = palette_of(scene.appearances)
        self._collection = PolyCollection([], linewidths=0.7, zorder=2)
        axes.add_collection(self._collection, autolim=False)

    def show(self, theta: FloatArray, time: float = 0.0) -> None:
        """Show a posture (dof,), rad, and the obstacles at a time in s."""
        solids = self._scene.solids_at(time)
        for number in self._scene.moving:
            self._painted[number] = list(solid(self._view, solids[number]))
        centers = self._scene.centers(theta[None])[0]
        if self._scene.appearances:
            painted = list(self._dressed(centers, self._scene.frames(theta[None])[0], solids))
        else:
            painted = list(self._in_balls(centers, solids))
        polygons, faces, edges = zip(*painted, strict=True) if painted else ((), (), ())
        self._collection.set_verts(polygons)
        self._collection.set_facecolor(list(faces))
        self._collection.set_edgecolor(list(edges))

    def _in_balls(self, centers: FloatArray, solids: Sequence[Polyhedron]) -> Iterator[Painted]:
        """Everything, the robot as its balls with centres (balls, 3), m."""
        radii, planes = self._scene.radii, self._scene.planes_of(solids)
        for number in painting_order(self._view, centers, radii, solids, planes):
            if number < len(centers):
                yield from ball(self._view, centers[number], float(radii[number]), self._colour)
            else:
                yield from self._painted[number - len(centers)]

    def _dressed(self, centers: FloatArray, frames: FloatArray, solids: Sequence[Polyhedron]) -> Iterator[Painted]:
        """Everything, the links as they look on bodies with frames (bodies, 4, 3), m."""
        view, scene = self._view, self._scene
        corners = placed_corners(scene.appearances, frames)
        rows, shades = front_of(view, corners)
        colours, spots = self._palette[rows, shades], view.project(corners[rows])
        places = np.concatenate([centers[scene.bare], corners[rows].mean(axis=1)])
        order = painting_order(view, np.empty((0, 3)), np.empty(0), solids, scene.planes_of(solids))
        for small, next_solid in layers(view, places, solids, order):
            for number in small.tolist():
                if number < len(scene.bare):
                    one = scene.bare[number]
                    yield from ball(view, centers[one], float(scene.radii[one]), self._colour)
                else:
                    colour = tuple(colours[number - len(scene.bare)])
                    yield spots[number - len(scene.bare)], (*colour, 1.0), (*colour, 1.0)
            if next_solid is not None:
                yield from self._painted[next_solid]


def ball(view: View, center: FloatArray, radius: float, colour: str) -> Iterator[Painted]:
    """A ball, lit from above."""
    middle, size = view.project(center), radius * float(view.magnification(center))
    circle, base = np.column_stack([np.cos(ROUND), np.sin(ROUND)]), np.array(to_rgb(colour))
    for share, lit in LAYERS:
        shown = (*(base + (1.0 - base) * lit), 1.0)
        edge = (*(0.75 * base), 0.5) if share == 1.0 else (0.0, 0.0, 0.0, 0.0)
        yield middle + size * (share * circle + 0.6 * (1.0 - share) * LIGHT[:2]), shown, edge


def solid(view: View, polyhedron: Polyhedron, opacity: float = 1.0) -> Iterator[Painted]:
    """An obstacle that can be seen through: the faces behind, then those before, each with its edges."""
    seen = view.sees(polyhedron.normals, polyhedron.offsets)
    corners, base = view.project(polyhedron.vertices), np.array(to_rgb(OBSTACLE))
    shades = 0.72 + 0.28 * np.minimum(np.abs(polyhedron.normals @ view.axes.T @ LIGHT), 1.0)
    for front, alpha in ((False, BACK_ALPHA), (True, FACE_ALPHA)):
        for number, face in enumerate(polyhedron.faces):
            if seen[number] == front:
                yield corners[list(face)], (*(base * shades[number]), opacity * alpha), (0.0, 0.0, 0.0, 0.0)
        for edge in polyhedron.edges:
            visible = seen[list(edge.faces)]
            if visible.any() == front and (edge.sharp or (not visible.all() and visible.any())):
                share = EDGE_ALPHA if front else 0.4 * EDGE_ALPHA
                yield corners[list(edge.ends)], (0.0, 0.0, 0.0, 0.0), (*(0.7 * base), share)


LAST = "last posture"
TALLEST = 6.0  # inches: of the panels
OPACITY = 0.55  # of obstacles in views that nothing covers anything in
FRAME_COLOURS = (VERMILLION, GREEN, BLUE)  # of the axes x, y, z
VIEWS = {"top": (TOP, "x [m]", "y [m]"), "front": (FRONT, "x [m]", "z [m]"), "side": (SIDE, "y [m]", "z [m]")}


@dataclass(frozen=True)
class Posture:
    """A posture in a picture.

    Attributes:
        label: for a legend; empty where it has none.
        colour: of it.
        theta: joint angles, (dof,), rad.
        time: at which obstacles that move are shown with it, s.
        opacity: of these obstacles.
        strong: whether its spheres are shown, and its line is thick.
    """

    label: str
    colour: Any
    theta: FloatArray
    time: float = 0.0
    opacity: float = OPACITY
    strong: bool = True


@dataclass(frozen=True, kw_only=True)
class Way:
    """The path of a tool in a picture.

    Attributes:
        path: of the tool.
        passed: places of interest on it.
        named: what has a label beside it, one position each.
        nearest: the two points of the closest approach, and what is said of it; None where there is none.
    """

    path: Points
    passed: Sequence[Points] = ()
    named: Sequence[Points] = ()
    nearest: Points | None = None


@in_print
def space_figure(
    scene: Scene,
    postures: Sequence[Posture],
    way: Way | None = None,
    swept: FloatArray | None = None,
    title: str = "",
) -> Figure:
    """Top, front and side view of postures, and the last of them in perspective.

    Args:
        scene: robot, obstacles and markers.
        postures: to be shown.
        way: of the tool.
        swept: further postures (n, dof), rad, that have to fit in.
        title: of the figure.
    """
    shown = thetas_of(postures)
    bounds = scene.bounds(shown if swept is None else np.vstack([shown, swept]))
    width, depth, height = bounds[1] - bounds[0]
    scale = min((TWO_COLUMNS - 1.1) / (width + depth), TALLEST / (depth + height))
    size = max(ONE_COLUMN, scale * (width + depth) + 1.1), scale * (depth + height) + 1.7
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.add_gridspec(2, 2, width_ratios=(width, depth), height_ratios=(depth, height))
    top = figure.add_subplot(grid[0, 0])
    front = figure.add_subplot(grid[1, 0], sharex=top)
    side = figure.add_subplot(grid[1, 1], sharey=front)
    panels = [(top, *VIEWS["top"]), (front, *VIEWS["front"]), (side, *VIEWS["side"])]
    for axes, view, across, along in panels:
        draw_measurable(axes, view, scene, postures)
        draw_way(axes, view, way)
        low, high = view.project(bounds)
        axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel=across, ylabel=along)
        draw_ways(axes, [view.project(course.middles) for course in scene.courses])
    for (axes, *_), name in zip(panels, VIEWS, strict=True):
        axes.set_title(name, loc="left")
    if scene.courses:
        top.plot([], [], label=LABEL, **SQUARE)
    picture = figure.add_subplot(grid[0, 1])
    view = scene.view(shown, bounds)
    draw_picture(picture, view, scene, postures[-1], bounds)
    draw_way(picture, view, way)
    draw_ways(picture, [view.project(course.middles) for course in scene.courses])
    figure.legend(*top.get_legend_handles_labels(), loc="outside lower center", ncols=2 if size[0] < 5.5 else 3)
    if title:
        title_figure(figure, title)
    if way is not None:
        picture.set_title(LAST if way.nearest is None else literal(postures[-1].label), loc="right")
        lay_out(figure)  # so that places are final
        for axes, view, *_ in panels:
            draw_names(axes, view, scene, postures, way)
    return figure


def draw_way(axes: Axes, view: View, way: Way | None) -> None:
    """The way of the tool, places on it, and the closest approach."""
    if way is None:
        return
    axes.plot(*view.project(way.path.places).T, color=PATH, linewidth=1.6, label=way.path.label, zorder=5)
    for points in way.passed:
        axes.plot(*view.project(points.places).T, **DIAMOND)
    if way.nearest is not None:
        ends = view.project(way.nearest.places)
        axes.plot(*ends.T, color=CLOSEST, linewidth=1.6, zorder=7)
        axes.plot(*ends.mean(axis=0), "o", color=CLOSEST, fillstyle="none", markersize=9.0, zorder=7)


def draw_names(axes: Axes, view: View, scene: Scene, postures: Sequence[Posture], way: Way) -> None:
    """Labels beside what has a name: the closest approach, start and goal, places that are passed."""
    labels = [PlaceLabel(points.label, view.project(points.places[0])) for points in way.named]
    if way.nearest is not None:
        labels.insert(0, PlaceLabel(way.nearest.label, view.project(way.nearest.places).mean(axis=0), CLOSEST))
    skeletons, path = scene.robot.skeleton(thetas_of(postures)), way.path.places
    lines = [
        path[np.isfinite(path).all(axis=1)],
        *(each[stroke] for each in skeletons for stroke in scene.robot.strokes),
    ]
    label_places(axes, labels, [view.project(line) for line in lines])


def draw_measurable(axes: Axes, view: View, scene: Scene, postures: Sequence[Posture]) -> None:
    """An orthogonal view: everything can be seen through."""
    standing = [solid for number, solid in enumerate(scene.solids) if number not in scene.moving]
    if standing:
        draw_solids(axes, view, standing, OPACITY)
        axes.plot([], [], "s", color=OBSTACLE, alpha=0.35, markersize=9, label="obstacle")
    for posture in postures if scene.moving else ():
        if posture.opacity == 0.0:
            continue
        solids = scene.solids_at(posture.time)
        draw_solids(axes, view, [solids[number] for number in scene.moving], posture.opacity, posture.opacity)
    axes.plot(*view.project(np.array(scene.robot.base)), "s", color="black", markersize=7, label="base", zorder=5)
    draw_thickness(axes, view, scene, [posture for posture in postures if posture.strong])
    for posture, skeleton in zip(postures, scene.robot.skeleton(thetas_of(postures)), strict=True):
        lines = view.project(in_strokes(scene.robot, skeleton))
        axes.plot(
            *lines.T, "-o", color=posture.colour, label=literal(posture.label) or None,
            markerfacecolor="white", markersize=3.5 if posture.strong else 2.0,
            linewidth=1.8 if posture.strong else 0.9, zorder=4 if posture.strong else 3,
        )  # fmt: skip
    for marker in scene.markers:
        draw_band(axes, replace(marker, points=view.project(marker.points)))
        axes.plot(*view.project(marker.points).T, label=marker.label, **MARKER_STYLES[marker.kind])


def in_strokes(robot: Robot, skeleton: FloatArray) -> FloatArray:
    """The points of a skeleton (p, 3), m, with gaps between the lines of different tools."""
    return parted([skeleton[stroke] for stroke in robot.strokes])


def parted(lines: Sequence[FloatArray]) -> FloatArray:
    """The points of lines, (n, 3) each, m, one after the other, with gaps that are not drawn."""
    gap = np.full((1, 3), np.nan)
    return np.vstack([part for line in lines for part in (line, gap)][:-1])


def thetas_of(postures: Sequence[Posture]) -> FloatArray:
    """Joint positions of one posture or more, (n, dof), rad."""
    return np.array([posture.theta for posture in postures])


def draw_thickness(axes: Axes, view: View, scene: Scene, postures: Sequence[Posture]) -> None:
    """How thick the robot is in postures: its links as they look, or their balls."""
    if not postures:
        return
    theta, sizes = thetas_of(postures), 2.0 * scene.radii[scene.bare]
    frames = scene.frames(theta) if scene.appearances else [None] * len(theta)
    for posture, centers, placed in zip(postures, scene.centers(theta)[:, scene.bare], frames, strict=True):
        axes.add_collection(
            EllipseCollection(
                sizes, sizes, np.zeros(len(sizes)), units="xy", offsets=view.project(centers),
                offset_transform=axes.transData, facecolors=posture.colour, alpha=0.16, linewidths=0.0, zorder=2,
            ),
            autolim=False,
        )  # fmt: skip
        if placed is not None:
            outline = silhouette(view, placed_corners(scene.appearances, placed))
            axes.add_artist(PathPatch(outline, facecolor=posture.colour, alpha=0.25, linewidth=0.0, zorder=2))
            axes.update_datalim(outline.vertices)  # which add_patch seeks edge by edge, for seconds


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
    """The parts of a perspective view that change with the posture: painted balls and solids, and a line."""

    painting: Painting
    arm: Line2D


def draw_picture(axes: Axes, view: View, scene: Scene, posture: Posture, bounds: FloatArray) -> Picture:
    """A posture in perspective, over the ground."""
    draw_ground(axes, view, scene, bounds)
    painting = Painting(axes, view, scene, posture.colour)
    painting.show(posture.theta, posture.time)
    skeleton, width = (
        in_strokes(scene.robot, scene.robot.skeleton(posture.theta[None])[0]),
        0.0 if scene.appearances else 1.6,
    )
    arm = axes.plot(*view.project(skeleton).T, "-", color=posture.colour, linewidth=width, alpha=0.8, zorder=4)[0]
    for marker in scene.markers:
        if marker.kind is not MarkerKind.POINTS:
            axes.plot(*view.project(marker.points).T, **MARKER_STYLES[marker.kind])
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


COLOUR = BLUE


def draw_robot(file: Path, description: RobotDescription) -> Path:
    """Three views and a picture of a robot with its spheres, as near to zero as its joints can be.

    Raises:
        OSError: the file cannot be written.
    """
    robot = description.drawn
    low, high = np.array(robot.position_limits).T
    posture = Posture(description.title or description.chain.name, COLOUR, np.clip(np.zeros(robot.dof), low, high))
    figure = space_figure(Scene(robot), [posture])
    [path] = write_figure(file.parent, file.stem, figure, (file.suffix[1:],))
    return path
