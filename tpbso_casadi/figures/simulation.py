"""The figure of a simulation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from problems.base import FloatArray
from problems.certify import WorstIs
from tpbso_casadi.figures.limits import DistanceCurve, distance_curves, spans
from tpbso_casadi.figures.palette import CLOSEST, DEFAULT, GIVEN, GREEN, LIMIT, OBSTACLE, PATH, line_of, shade_of
from tpbso_casadi.figures.scene import (
    Course,
    courses_of,
    draw_bodies,
    draw_moving,
    draw_scene,
    draw_ways,
    extent_of,
    labelled_times,
)
from tpbso_casadi.figures.space import VIEWS, Posture, draw_measurable, draw_solids
from tpbso_casadi.figures.space_scene import Scene
from tpbso_casadi.figures.style import SMALL, TWO_COLUMNS, EndLabel, in_print, label_ends, write_figure
from tpbso_casadi.planning import JudgedMotion
from tpbso_casadi.simulation import MEANINGS, SimulationRecord, simulated_motion, stands

HEIGHTS = {2: 4.0, 3: 3.1}  # of the scene by the robot's dimensions, inches
SHOWN = 5  # times at which obstacles are drawn
LIGHT, STRONG = 0.08, 0.4  # opacities of the first and of the last
ROWS_PER_SECOND = 100
ARM, STANDING = to_hex(shade_of(1.0)), "0.6"
STYLES = {"new": (GREEN, "o", 5.0), "old": ("0.55", ".", 3.0), "stop": (CLOSEST, "X", 5.5)}
"""Colour, marker and size of each kind of answer."""
HATCHES = {"new": "", "old": "", "stop": "///"}  # of its bars


def draw_simulation(folder: Path, record: SimulationRecord, formats: Sequence[str] = DEFAULT) -> list[Path]:
    """Draw ``simulation.png`` into a folder, or the same in other formats."""
    return write_figure(folder, "simulation", simulation_figure(record), formats)


@in_print
def simulation_figure(record: SimulationRecord) -> Figure:
    """A figure of the tool's path and obstacles; below, distances and the time of each answer."""
    motion = simulated_motion(record)
    scene_height = HEIGHTS[record.robot.dim]
    figure = Figure(figsize=(TWO_COLUMNS, scene_height + 3.9), layout="constrained")
    grid = figure.add_gridspec(3, 1, height_ratios=(scene_height, 1.5, 1.1))
    axes = SCENES[record.robot.dim](figure, grid[0], record, motion)
    below = figure.add_subplot(grid[1])
    draw_distances(below, record)
    draw_answers(figure.add_subplot(grid[2], sharex=below), record)
    kinds = [replan.kind for replan in record.replans]
    counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in MEANINGS)
    figure.suptitle(f"simulation of the planner, {record.duration:.4g} s: {len(kinds)} replans ({counts})")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def row_times(record: SimulationRecord) -> FloatArray:
    """Times in s at which to draw what was executed."""
    return record.executed.times(int(np.ceil(ROWS_PER_SECOND * record.duration)) + 1)


def draw_replans(axes: Axes, record: SimulationRecord, motion: JudgedMotion, columns: list[int]) -> None:
    """The way of the tool, and on it where each answer was executed from, by its kind."""
    axes.plot(*motion.joint_positions(row_times(record))[:, -1, columns].T, color=PATH, linewidth=1.2, label="tool")
    for kind, (colour, marker, size) in STYLES.items():
        times = np.array([replan.time + record.settings.every for replan in record.replans if replan.kind == kind])
        if times.size:
            places = motion.joint_positions(np.minimum(times, record.duration))[:, -1, columns]
            label = f"replan: {MEANINGS[kind]}"
            axes.plot(*places.T, marker, color=colour, markersize=size, linestyle="none", label=label, zorder=6)


def draw_times(axes: Axes, courses: tuple[Course, ...], columns: list[int]) -> None:
    """The first and the last time at which obstacles are drawn, on their middles."""
    for course in courses:
        for text, place in labelled_times(replace(course, times=course.times[[0, -1]])):
            axes.annotate(text, tuple(place[columns]), fontsize=7, ha="center", va="center", zorder=7)


def in_plane(figure: Figure, place: SubplotSpec, record: SimulationRecord, motion: JudgedMotion) -> Axes:
    """The scene of an arm in the plane."""
    axes, times, criteria = figure.add_subplot(place), row_times(record), motion.criteria
    joints = motion.joint_positions(times)
    draw_scene(axes, criteria)
    label = f"moving obstacle, every {record.duration / (SHOWN - 1):.3g} s"
    draw_moving(axes, shown_courses(record), opacities().tolist(), label)
    draw_bodies(axes, record.robot, joints[-1], ARM)
    axes.plot(*joints[-1].T, "-o", color=ARM, markerfacecolor="white", linewidth=1.8, label="at the end", zorder=4)
    courses = courses_of(record.obstacles, times)
    points = np.vstack([marker.points for marker in criteria.task.markers()])
    left, right, bottom, top = extent_of(criteria, joints, points, courses)
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top), xlabel="x [m]", ylabel="y [m]")
    draw_ways(axes, [course.middles for course in courses])
    draw_times(axes, shown_courses(record), [0, 1])
    draw_replans(axes, record, motion, [0, 1])
    return axes


def in_space(figure: Figure, place: SubplotSpec, record: SimulationRecord, motion: JudgedMotion) -> Axes:
    """The scene of a robot in space, from above and from the front."""
    times, criteria = row_times(record), motion.criteria
    courses = courses_of(record.obstacles, times)
    scene = Scene(record.robot, record.obstacles, criteria.task.markers(), courses)
    theta = record.executed.at(times)
    bounds = scene.bounds(theta)
    last = Posture("at the end", ARM, theta[-1], record.duration, STRONG)
    grid = place.subgridspec(1, 2)
    panels = [figure.add_subplot(grid[column]) for column in range(2)]
    for axes, name, columns in zip(panels, ("top", "front"), ([0, 1], [0, 2]), strict=True):
        view, across, along = VIEWS[name]
        draw_measurable(axes, view, scene, [last])
        for time, opacity in zip(shown_times(record)[:-1], opacities()[:-1], strict=True):
            solids = scene.solids_at(float(time))
            draw_solids(axes, view, [solids[number] for number in scene.moving], opacity, opacity)
        low, high = bounds[:, columns]
        axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel=across, ylabel=along)
        draw_ways(axes, [course.middles[:, columns] for course in courses])
        draw_times(axes, shown_courses(record), columns)
        draw_replans(axes, record, motion, columns)
        axes.set_title(name, loc="left")
    return panels[0]


SCENES = {2: in_plane, 3: in_space}  # by the robot's dimensions


def shown_times(record: SimulationRecord) -> FloatArray:
    """When obstacles are drawn, (SHOWN,), s."""
    return np.linspace(0.0, record.duration, SHOWN)


def opacities() -> FloatArray:
    """Opacities of obstacles at these times, (SHOWN,)."""
    return np.linspace(LIGHT, STRONG, SHOWN)


def shown_courses(record: SimulationRecord) -> tuple[Course, ...]:
    """The obstacles that move, at these times."""
    return courses_of(record.obstacles, shown_times(record))


def draw_distances(axes: Axes, record: SimulationRecord) -> None:
    """How far the arm truly was from obstacles; below, when new motions and stops were answered, and goals reached."""
    curves = distance_curves(record.robot, record.obstacles, record.executed, row_times(record))
    for curve in curves:
        line = line_of(curve.number - 1) if curve.number else {"color": STANDING}
        axes.plot(curve.times, curve.distances, linewidth=1.2, label=curve.label, **line)
    if curves:
        mark_closest(axes, curves)
    axes.axhline(0.0, color=OBSTACLE, linewidth=0.8)
    draw_standstills(axes, record)
    for visit in record.visits:
        axes.axvline(visit.time, color=GIVEN, linestyle=":", linewidth=1.2)
    for kind, times in answer_times(record):
        colour, *_ = STYLES[kind]
        if len(times):  # a line without points would be laid out as if it reached the figure's corner
            axes.plot(times, np.zeros(len(times)), "|", color=colour, markersize=14, markeredgewidth=1.5, clip_on=False)
    axes.set_ylabel("distance of\nthe arm [m]")
    axes.set_xlim(0.0, record.duration)
    axes.tick_params(labelbottom=False)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=SMALL, ncols=3)


def draw_standstills(axes: Axes, record: SimulationRecord) -> None:
    """When the arm stood: something may have come to it then."""
    breaks, label = record.executed.breakpoints, "the arm stands"
    for first, last in spans(stands(record.executed)):
        axes.axvspan(breaks[first], breaks[last + 1], color="0.9", linewidth=0.0, zorder=0, label=label)
        label = "_"


def mark_closest(axes: Axes, curves: list[DistanceCurve]) -> None:
    """The smallest distance of all."""
    nearest = min(curves, key=lambda curve: float(curve.distances.min()))
    row = int(nearest.distances.argmin())
    label = f"closest: {WorstIs.FOUND.distance(nearest.distances[row])} at {nearest.times[row]:.3g} s"
    axes.plot(nearest.times[row], nearest.distances[row], "o", color=CLOSEST, markersize=5, label=label, zorder=5)


def answer_times(record: SimulationRecord) -> Iterator[tuple[str, list[float]]]:
    """When answers other than to go on were executed from, by kind, s."""
    for kind in ("new", "stop"):
        yield kind, [replan.time + record.settings.every for replan in record.replans if replan.kind == kind]


def draw_answers(axes: Axes, record: SimulationRecord) -> None:
    """How long each answer took, and how long it might."""
    every = record.settings.every
    for kind, (colour, *_) in STYLES.items():
        chosen = [replan for replan in record.replans if replan.kind == kind]
        heights = [1000.0 * replan.seconds for replan in chosen]
        style: dict[str, Any] = {"facecolor": colour, "edgecolor": "white", "linewidth": 0.0, "hatch": HATCHES[kind]}
        axes.bar([replan.time for replan in chosen], heights, 0.8 * every, align="edge", **style)
    axes.axhline(1000.0 * every, color=LIMIT, linestyle="--", linewidth=1.0)
    axes.set_xlabel("time [s]")
    axes.set_ylabel("ms per replan")
    axes.grid(visible=False, axis="x")
    axes.margins(y=0.1)
    label_ends(axes, [EndLabel("until the\nnext tick", 1000.0 * every, LIMIT)])
