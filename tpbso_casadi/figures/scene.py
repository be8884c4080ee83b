"""Scenes in the plane: obstacles, bodies, what a task states, what moves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch, Polygon
from matplotlib.path import Path

from problems import Obstacle, Robot
from problems.assembly import Criteria
from problems.base import FloatArray
from problems.robots import Body
from problems.scene import standing
from problems.tasks import Marker, MarkerKind
from tpbso_casadi.figures.palette import COURSE, GIVEN, OBSTACLE, ORANGE
from tpbso_casadi.figures.style import PlaceLabel


@dataclass(frozen=True)
class Course:
    """An obstacle that moves.

    Attributes:
        number: of the obstacle, 1, 2, ...
        obstacle: itself.
        times: at which it is looked at, (n,), s.
    """

    number: int
    obstacle: Obstacle
    times: FloatArray

    @cached_property
    def frames(self) -> FloatArray:
        """The frame of the obstacle at each time: origin and axes in rows, (n, dim + 1, dim), m and unit vectors."""
        corners = placed(self.obstacle, np.vstack([np.zeros(self.obstacle.dim), np.eye(self.obstacle.dim)]), self.times)
        return np.concatenate([corners[:, :1], corners[:, 1:] - corners[:, :1]], axis=1)

    @cached_property
    def outlines(self) -> FloatArray:
        """Points on its boundary at each time, (n, m, dim), m."""
        return placed(self.obstacle, self.obstacle.unmoved.outline(), self.times)

    @cached_property
    def middles(self) -> FloatArray:
        """The middle of the obstacle at each time, (n, dim), m."""
        return placed(self.obstacle, self.obstacle.unmoved.bounding_box().mean(axis=0)[None], self.times)[:, 0]

    def within(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """The corners of all that is seen of it in a box, over all times, (2, dim), m; (0, dim) if nothing is.

        Args:
            lower: corner of the box, (dim,), m.
            upper: likewise.
        """
        lows, highs = self.outlines.min(axis=1), self.outlines.max(axis=1)
        meets = ((highs >= lower) & (lows <= upper)).all(axis=1)
        if not meets.any():
            return np.empty((0, len(lower)))
        return np.asarray(np.clip([lows[meets].min(axis=0), highs[meets].max(axis=0)], lower, upper))


def placed(obstacle: Obstacle, points: FloatArray, times: FloatArray) -> FloatArray:
    """Points (m, dim), m, that move with an obstacle, at times (n,) in s: (n, m, dim), m."""
    frames = obstacle.frames(times)
    return np.repeat(points[None], len(times), axis=0) if frames is None else frames.placed(points)


def courses_of(obstacles: Sequence[Obstacle], times: FloatArray) -> tuple[Course, ...]:
    """The courses of the obstacles that move, at times (n,) in s."""
    return tuple(
        Course(number, obstacle, times) for number, obstacle in enumerate(obstacles, start=1) if obstacle.moves
    )


PADDING = 0.06  # around everything drawn, of its larger side


def extent_of(
    criteria: Criteria, joints: FloatArray, points: FloatArray, courses: Sequence[Course] = ()
) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of everything drawn in the plane, with some padding, m.

    Obstacles that move are shown as far as the arm reaches.

    Args:
        criteria: whose arm and obstacles are drawn.
        joints: where base, joints and tip are, (n, frames, 2), m.
        points: that the tip has to reach, (p, 2), m.
        courses: of the obstacles that move.
    """
    robot = criteria.robot
    boxes = [obstacle.bounding_box() for obstacle in standing(criteria.task.scenery)]
    thickest = max((float(body.radius) for body in robot.bodies.each), default=0.0)
    base, reach = np.array(robot.base), robot.reach()[1] + thickest
    boxes += [course.within(base - reach, base + reach) for course in courses]
    places = joints.reshape(-1, 2)
    shown = np.vstack([places - thickest, places + thickest, points, *boxes])
    lower, upper = shown.min(axis=0), shown.max(axis=0)
    padding = PADDING * float((upper - lower).max())
    return lower[0] - padding, upper[0] + padding, lower[1] - padding, upper[1] + padding


DIAMOND: dict[str, Any] = {
    "marker": "D", "linestyle": "none", "color": ORANGE, "markeredgecolor": "0.1", "markeredgewidth": 0.6,
    "markersize": 5.0, "zorder": 6,
}  # fmt: skip
STATED: dict[str, Any] = {"linestyle": "none", "color": GIVEN}
MARKER_STYLES: dict[MarkerKind, dict[str, Any]] = {
    MarkerKind.START: STATED | {"marker": "x", "markersize": 7, "markeredgewidth": 2.0, "zorder": 6},
    MarkerKind.VIA: DIAMOND,
    MarkerKind.GOAL: STATED | {"marker": "*", "markersize": 10, "zorder": 6},
    MarkerKind.POINTS: STATED | {"marker": ".", "markersize": 4, "zorder": 2},
}


def draw_scene(axes: Axes, criteria: Criteria) -> None:
    """Draw the base of the arm, the obstacles that stand and the markers of the task."""
    axes.plot(*criteria.robot.base, "s", color="black", markersize=6, label="base", zorder=5)
    for number, obstacle in enumerate(standing(criteria.task.scenery)):
        draw_obstacle(axes, obstacle.outline()).set_label("_" if number else "obstacle")
    for marker in criteria.task.markers():
        x, y = marker.points.T
        axes.plot(x, y, label=marker.label, **MARKER_STYLES[marker.kind])


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
    return [body for body in robot.bodies.each if float(body.radius) > 0.0]


def capsule(body: Body, skeleton: FloatArray, count: int = 16) -> FloatArray:
    """The outline of a body in the plane: half a circle around each end; (2 count, 2), m."""
    start, end = skeleton[body.start], skeleton[body.end]
    ahead = np.arctan2(*(end - start)[::-1])
    turn = np.linspace(-np.pi / 2.0, np.pi / 2.0, count)
    phases, centres = np.concatenate([ahead + turn, ahead + np.pi + turn]), np.repeat([end, start], count, axis=0)
    return np.asarray(centres + float(body.radius) * np.column_stack([np.cos(phases), np.sin(phases)]))


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


CORNERS = 48  # of a circle


def draw_band(axes: Axes, marker: Marker) -> None:
    """Shade what is near enough to the points of a marker, (n, 2), or to the lines between them, if it says so."""
    if not marker.tolerance > 0.0:
        return
    pieces = outlines(marker.points, marker.tolerance, joined=marker.connects_points)
    path = Path.make_compound_path(*(Path(piece, closed=True) for piece in pieces))
    label = f"within {1000.0 * marker.tolerance:.4g} mm of {'the path' if marker.connects_points else 'a given point'}"
    axes.add_patch(PathPatch(path, facecolor=GIVEN, alpha=0.16, linewidth=0.0, label=label, zorder=1))


def outlines(points: FloatArray, width: float, *, joined: bool) -> Sequence[FloatArray]:
    """Counter-clockwise outlines (m, 2) of the region within a width of points (n, 2), or of lines."""
    turn = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    circle = width * np.column_stack([np.cos(turn), np.sin(turn)])
    found = [point + circle for point in points]
    for start, end in pairwise(points) if joined else ():
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            across = width * np.array([[0.0, -1.0], [1.0, 0.0]]) @ (end - start) / length
            corners = [start - across, end - across, end + across, start + across]
            found.append(np.array([*corners, corners[0]]))
    return found


@dataclass(frozen=True)
class Points:
    """Positions (n, dim), m, and what they are called."""

    label: str
    places: FloatArray
