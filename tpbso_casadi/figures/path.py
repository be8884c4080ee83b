"""The path figure, in the plane and in space.

Imported only where a figure is drawn: matplotlib is slow to load.

Imported only where a figure is drawn: matplotlib is slow to load.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tpbso_casadi.figures.curves import headline
from tpbso_casadi.figures.labels import PlaceLabel, label_places
from tpbso_casadi.figures.palette import CLOSEST, PATH
from tpbso_casadi.figures.postures import (
    Nearest,
    Points,
    Snapshot,
    draw_band,
    draw_passed,
    legend_of,
    nearest_of,
    passed_by,
    snapshots,
    times_of,
)
from tpbso_casadi.figures.scene import (
    Course,
    courses_of,
    draw_bodies,
    draw_moving,
    draw_scene,
    draw_ways,
    extent_of,
    time_labels,
)
from tpbso_casadi.figures.space import Posture, Way, space_figure
from tpbso_casadi.figures.space_scene import Scene
from tpbso_casadi.figures.style import ONE_COLUMN, in_print
from tpbso_casadi.planning import PlannedMotion

WIDTH, HEIGHTS, AROUND = 5.0, (2.4, 4.6), (0.7, 1.5)  # inches: of a figure, of its axes; beside and below those
ENDS = ("start", "end")  # of the fan, which are emphasised


@in_print
def path_in_plane(plan: PlannedMotion) -> Figure:
    """The tool's path, a fan of postures, obstacles, what the task states, and the closest approach."""
    problem, motion = plan.criteria, plan.motion
    shown, joints = snapshots(motion), motion.joint_positions(plan.times)
    courses = courses_of(problem.obstacles, plan.times)
    points = np.vstack([np.empty((0, 2)), *(marker.points for marker in problem.markers())])
    left, right, bottom, top = extent_of(problem, joints, points, courses)
    figure = Figure(figsize=size_of(right - left, top - bottom), layout="constrained")
    axes = figure.subplots()
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top), xlabel="x [m]", ylabel="y [m]")
    draw_scene(axes, problem)
    for marker in problem.markers():
        draw_band(axes, marker)
    axes.plot(*joints[:, -1].T, color=PATH, linewidth=1.8, label="path of the tool", zorder=5)
    draw_fan(axes, plan, shown)
    seen = [snapshot for snapshot in shown if snapshot.opacity]
    still = courses_of(problem.obstacles, times_of(seen))
    if courses:
        draw_moving(axes, still, [snapshot.opacity for snapshot in seen])
        draw_ways(axes, [course.middles for course in courses])
    draw_passed(axes, passed_by(motion))
    nearest = nearest_of(motion)
    if nearest is not None:
        draw_nearest(axes, nearest)
    figure.suptitle(headline(plan))
    figure.legend(loc="outside lower center", ncols=2 if right - left > 0.7 * (top - bottom) else 1)
    figure.draw_without_rendering()  # so that places are final
    outlines = [obstacle.outline() for obstacle in problem.obstacles if not obstacle.moves]
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
    """What stands beside points: the distance, start and goal, places that are passed, obstacles, and their times."""
    motion, problem = plan.motion, plan.criteria
    labels = [] if nearest is None else [PlaceLabel(nearest.label, nearest.points.mean(axis=0), CLOSEST)]
    ends = motion.joint_positions(np.array([0.0, plan.trajectory.duration]))[:, -1]
    labels += [PlaceLabel("start", ends[0]), PlaceLabel("goal", ends[1])]
    labels += [PlaceLabel(points.label, points.places[0]) for points in passed_by(motion)]
    standing = [(n, obstacle) for n, obstacle in enumerate(problem.obstacles, start=1) if not obstacle.moves]
    if len(problem.obstacles) > 1:
        labels += [PlaceLabel(f"{number}", obstacle.outline().mean(axis=0)) for number, obstacle in standing]
    return labels + time_labels(courses)


def path_in_space(plan: PlannedMotion) -> Figure:
    """Three views of the tool's path, a fan of postures, obstacles and the closest approach; and a picture of it."""
    problem, motion = plan.criteria, plan.motion
    shown, nearest = snapshots(motion), nearest_of(motion)
    labels = {"": "", "start": "first posture", "end": legend_of(motion), "closest": "posture at the closest approach"}
    postures = [
        Posture(labels[snapshot.label], snapshot.colour, theta, snapshot.time, snapshot.opacity, bool(snapshot.label))
        for snapshot, theta in zip(shown, motion.trajectory.at(times_of(shown)), strict=True)
    ]
    tool = motion.joint_positions(plan.times)[:, -1]
    way = Way(
        path=Points("path of the tool", tool),
        passed=tuple(passed_by(motion)),
        named=(Points("start", tool[:1]), Points("goal", tool[-1:]), *passed_by(motion)),
        nearest=None if nearest is None else Points(nearest.label, nearest.points),
    )
    scene = Scene(problem.robot, problem.obstacles, problem.markers(), courses_of(problem.obstacles, plan.times))
    figure = space_figure(scene, postures, way, motion.trajectory.at(plan.times))
    figure.suptitle(headline(plan).replace("\n", ", "))
    return figure


PATH_FIGURES = {2: path_in_plane, 3: path_in_space}  # by the robot's dimensions


def path_figure(plan: PlannedMotion) -> Figure:
    """(b) The tool's path, a fan of postures, obstacles, what the task states, and the closest approach."""
    return PATH_FIGURES[plan.criteria.robot.dim](plan)
