"""The path figure, in the plane and in space: postures along a motion, the closest approach, points that are passed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems.base import FloatArray
from problems.certify import WorstIs
from problems.core import AskedSolid
from problems.limits import CollisionPair, CoverClearance
from tpbso_casadi.figures.curves import headline
from tpbso_casadi.figures.limits import pairs_of
from tpbso_casadi.figures.palette import CLOSEST, PATH, shade_of
from tpbso_casadi.figures.scene import (
    DIAMOND,
    Course,
    Points,
    courses_of,
    draw_band,
    draw_bodies,
    draw_moving,
    draw_scene,
    draw_ways,
    extent_of,
    time_labels,
)
from tpbso_casadi.figures.space import Posture, Way, parted, space_figure
from tpbso_casadi.figures.space_scene import Scene
from tpbso_casadi.figures.style import (
    ONE_COLUMN,
    PlaceLabel,
    in_print,
    label_places,
    lay_out,
    legend_columns,
    title_figure,
)
from tpbso_casadi.planning import JudgedMotion, PlannedMotion

COUNT = 9
OPACITIES, CLOSE = (0.12, 0.22, 0.35), 0.55  # of obstacles that move: at the start, halfway, at the end; when closest


@dataclass(frozen=True)
class Snapshot:
    """A time at which the arm is shown.

    Attributes:
        label: of it; empty for those between start and goal.
        colour: of the arm.
        time: s.
        opacity: of the obstacles that move; 0 where they are not shown.
    """

    label: str
    colour: Any
    time: float
    opacity: float = 0.0


def fan_of(motion: JudgedMotion) -> list[Snapshot]:
    """``COUNT`` postures, equally spaced in time, the first at the start, the last at the end, from light to dark."""
    shares = np.linspace(0.0, 1.0, COUNT)
    labels = {0: "start", COUNT - 1: "end"}
    opacities = dict(zip((0, COUNT // 2, COUNT - 1), OPACITIES, strict=True))
    return [
        Snapshot(labels.get(k, ""), shade_of(share), share * motion.trajectory.duration, opacities.get(k, 0.0))
        for k, share in enumerate(shares.tolist())
    ]


def snapshots(motion: JudgedMotion) -> list[Snapshot]:
    """The fan, and the posture of the closest approach to an obstacle, if there is one within reach."""
    closest = motion.closest_approach
    fan = fan_of(motion)
    return fan if closest is None else [*fan, Snapshot("closest", CLOSEST, closest.time, CLOSE)]


def times_of(shown: list[Snapshot]) -> FloatArray:
    """The times of the postures in a fan, (n,), s."""
    return np.array([snapshot.time for snapshot in shown])


def legend_of(motion: JudgedMotion) -> str:
    """The text of a legend on the fan of postures."""
    return f"{COUNT} postures, every {motion.trajectory.duration / (COUNT - 1):.3g} s, light to dark"


OUTLINE_CORNERS = 4096  # of an outline that is curved
STEP = 1e-5  # m: of differences


@dataclass(frozen=True)
class Nearest:
    """The closest approach of a motion to an obstacle.

    Attributes:
        time: s.
        distance: between the surfaces, m; not positive where they touch.
        points: on the arm and on the obstacle, (2, dim), m.
    """

    time: float
    distance: float
    points: FloatArray

    @property
    def label(self) -> str:
        """How close, and when."""
        apart = WorstIs.FOUND.distance(self.distance) if self.distance > 0.0 else "touches"
        return f"{apart} at {self.time:.3g} s"


def nearest_of(motion: JudgedMotion) -> Nearest | None:
    """The closest approach; None where no obstacle is within reach."""
    approach = motion.closest_approach
    if approach is None:
        return None
    time = approach.time
    criteria, _ = next(motion.criteria.at_times(np.array([time])))
    robot = criteria.robot
    covers = [limit for limit in criteria.judged_limits if isinstance(limit, CoverClearance)]
    if covers:
        at = np.array([time])
        found = covers[0].without_growth().closest(motion.trajectory.at(at), at)
        return Nearest(time, approach.distance, found.points[0])
    frames = robot.positions(ca.DM(motion.trajectory.at(np.array([time]))))
    named = [pair for pair in pairs_of(robot, criteria.obstacles) if str(pair) == approach.pair]
    pair = min(named, key=lambda pair: pair.distance(frames, ca.DM(time)))  # balls of a link share its name
    middle, point = NEAREST[robot.dim](pair, [np.asarray(ca.DM(frame)).ravel() for frame in frames], time)
    way = point - middle
    share = float(pair.body.radius) / max(float(np.linalg.norm(way)), 1e-12)
    return Nearest(time, approach.distance, np.array([middle + min(share, 1.0) * way, point]))


def in_plane(pair: CollisionPair, frames: list[FloatArray], time: float) -> tuple[FloatArray, FloatArray]:
    """The nearest points of a body's middle line and of an obstacle's outline, each (2,), m."""
    start, end = (frames[number] for number in (pair.body.start, pair.body.end))
    corners = pair.obstacle.at(time).outline(OUTLINE_CORNERS)
    following = np.roll(corners, -1, axis=0)
    on_line = projected(corners, np.tile(start, (len(corners), 1)), np.tile(end, (len(corners), 1)))
    of_line = np.vstack([on_line, np.tile(start, (len(corners), 1)), np.tile(end, (len(corners), 1))])
    of_outline = np.vstack([corners, projected(start, corners, following), projected(end, corners, following)])
    row = int(np.square(of_line - of_outline).sum(axis=1).argmin())
    return of_line[row], of_outline[row]


def projected(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """The nearest points of segments (n, dim) to a point (dim,), or to one point each, (n, dim)."""
    way = end - start
    length = np.maximum(np.square(way).sum(axis=1), 1e-300)
    share = np.clip(((point - start) * way).sum(axis=1) / length, 0.0, 1.0)
    return np.asarray(start + share[:, None] * way)


def in_space(pair: CollisionPair, frames: list[FloatArray], time: float) -> tuple[FloatArray, FloatArray]:
    """The middle of a ball and the obstacle's point nearest to it, each (3,), m: where its distance falls fastest."""
    center = frames[pair.body.start]
    around = center + STEP * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
    seen = AskedSolid.of(pair.obstacle.without_growth())
    distances = seen.distances(np.vstack([around.T, np.full(len(around), time)]))
    return center, center - distances[0] * (distances[1:4] - distances[4:]) / (2.0 * STEP)


NEAREST = {2: in_plane, 3: in_space}  # by the robot's dimensions


def passed_by(motion: JudgedMotion) -> list[Points]:
    """Places of the tool at the motion's times of interest, each (1, dim), m."""
    return [
        Points(milestone.label, motion.joint_positions(np.array([milestone.time]))[:, -1])
        for milestone in motion.criteria.milestones(motion.trajectory)
    ]


def draw_passed(axes: Axes, passed: Sequence[Points]) -> None:
    """Draw such places in the plane."""
    for points in passed:
        axes.plot(*points.places.T, **DIAMOND)


WIDTH, HEIGHTS, AROUND = 5.0, (2.4, 4.6), (0.7, 1.5)  # inches: of a figure, of its axes; beside and below those
ENDS = ("start", "end")  # of the fan, which are emphasised


@in_print
def path_in_plane(plan: PlannedMotion) -> Figure:
    """The tool's path, a fan of postures, obstacles, what the task states, and the closest approach."""
    criteria, motion = plan.criteria, plan.motion
    shown, joints = snapshots(motion), motion.joint_positions(plan.times)
    courses = courses_of(criteria.task.scenery, plan.times)
    points = np.vstack([np.empty((0, 2)), *(marker.points for marker in criteria.task.markers())])
    left, right, bottom, top = extent_of(criteria, joints, points, courses)
    figure = Figure(figsize=size_of(right - left, top - bottom), layout="constrained")
    axes = figure.subplots()
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top), xlabel="x [m]", ylabel="y [m]")
    draw_scene(axes, criteria)
    for marker in criteria.task.markers():
        draw_band(axes, marker)
    axes.plot(*joints[:, -1].T, color=PATH, linewidth=1.8, label="path of the tool", zorder=5)
    draw_fan(axes, plan, shown)
    seen = [snapshot for snapshot in shown if snapshot.opacity]
    still = courses_of(criteria.task.scenery, times_of(seen))
    if courses:
        draw_moving(axes, still, [snapshot.opacity for snapshot in seen])
        draw_ways(axes, [course.middles for course in courses])
    draw_passed(axes, passed_by(motion))
    nearest = nearest_of(motion)
    if nearest is not None:
        draw_nearest(axes, nearest)
    title_figure(figure, headline(plan))
    labels = axes.get_legend_handles_labels()[1]
    figure.legend(loc="outside lower center", ncols=min(2, legend_columns(labels, figure.get_figwidth())))
    lay_out(figure)  # so that places are final
    outlines = [obstacle.outline() for obstacle in criteria.task.scenery if not obstacle.moves]
    ways = [joints[:, -1], *motion.joint_positions(times_of(shown)), *outlines, *(c.middles for c in courses)]
    label_places(axes, labels_of(plan, nearest, still), ways)
    return figure


def size_of(width: float, height: float) -> tuple[float, float]:
    """The size in inches of a figure that shows so many metres."""
    beside, below = AROUND
    tall = float(np.clip((WIDTH - beside) * height / width, *HEIGHTS))
    return float(np.clip(tall * width / height + beside, ONE_COLUMN, WIDTH)), tall + below


def draw_fan(axes: Axes, plan: PlannedMotion, shown: Sequence[Snapshot]) -> None:
    """Postures from light to dark, the ends strong; that of the closest approach dashed."""
    label = legend_of(plan.motion)
    for snapshot, posture in zip(shown, plan.motion.joint_positions(times_of(list(shown))), strict=True):
        strong, closest = snapshot.label in ENDS, snapshot.colour == CLOSEST
        if strong or closest:
            draw_bodies(axes, plan.criteria.robot, posture, snapshot.colour)
        axes.plot(
            *posture.T, "--" if closest else "-", marker="o", color=snapshot.colour, markerfacecolor="white",
            markersize=4.0 if strong else 2.5, linewidth=2.0 if strong else 1.0, zorder=4 if strong else 3,
            label="posture at the closest approach" if closest else label if snapshot.label == "end" else None,
        )  # fmt: skip


def draw_nearest(axes: Axes, nearest: Nearest) -> None:
    """The line between the two nearest points."""
    axes.plot(*nearest.points.T, color=CLOSEST, linewidth=1.6, marker=".", markersize=4.0, zorder=7)
    axes.plot(*nearest.points.mean(axis=0), "o", color=CLOSEST, fillstyle="none", markersize=9.0, zorder=7)


def labels_of(plan: PlannedMotion, nearest: Nearest | None, courses: Sequence[Course]) -> list[PlaceLabel]:
    """Labels of points: the distance, start and goal, places that are passed, obstacles, and their times."""
    motion, criteria = plan.motion, plan.criteria
    labels = [] if nearest is None else [PlaceLabel(nearest.label, nearest.points.mean(axis=0), CLOSEST)]
    ends = motion.joint_positions(np.array([0.0, plan.trajectory.duration]))[:, -1]
    labels += [PlaceLabel("start", ends[0]), PlaceLabel("goal", ends[1])]
    labels += [PlaceLabel(points.label, points.places[0]) for points in passed_by(motion)]
    standing = [(n, obstacle) for n, obstacle in enumerate(criteria.task.scenery, start=1) if not obstacle.moves]
    if len(criteria.task.scenery) > 1:
        labels += [PlaceLabel(f"{number}", obstacle.outline().mean(axis=0)) for number, obstacle in standing]
    return labels + time_labels(courses)


def path_in_space(plan: PlannedMotion) -> Figure:
    """Three views of the tool's path, a fan of postures, obstacles and the closest approach; and a picture of it."""
    criteria, motion = plan.criteria, plan.motion
    shown, nearest = snapshots(motion), nearest_of(motion)
    labels = {"": "", "start": "first posture", "end": legend_of(motion), "closest": "posture at the closest approach"}
    postures = [
        Posture(labels[snapshot.label], snapshot.colour, theta, snapshot.time, snapshot.opacity, bool(snapshot.label))
        for snapshot, theta in zip(shown, motion.trajectory.at(times_of(shown)), strict=True)
    ]
    points, strokes = motion.joint_positions(plan.times), criteria.robot.strokes
    tools = [points[:, stroke][:, -1] for stroke in strokes]
    ends = [Points(name, tool[[row]]) for tool in tools for name, row in (("start", 0), ("goal", -1))]
    way = Way(
        path=Points("path of the tool" if len(tools) == 1 else "paths of the tools", parted(tools)),
        passed=tuple(passed_by(motion)),
        named=(*ends, *passed_by(motion)),
        nearest=None if nearest is None else Points(nearest.label, nearest.points),
    )
    scene = Scene(
        criteria.robot, criteria.task.scenery, criteria.task.markers(), courses_of(criteria.task.scenery, plan.times)
    )
    swept, title = motion.trajectory.at(plan.times), headline(plan).replace("\n", ", ", 1)
    return space_figure(scene, postures, way, swept, title)


PATH_FIGURES = {2: path_in_plane, 3: path_in_space}  # by the robot's dimensions


def path_figure(plan: PlannedMotion) -> Figure:
    """(b) The tool's path, a fan of postures, obstacles, what the task states, and the closest approach."""
    return PATH_FIGURES[plan.criteria.robot.dim](plan)
