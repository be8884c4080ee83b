"""The figure of a path: where the tip goes, and the arm at the start, in the middle and at the end.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from tpbso_casadi.figures.courses import courses_of
from tpbso_casadi.figures.distances import closest_to_moving, description
from tpbso_casadi.figures.extent import extent_of
from tpbso_casadi.figures.moving import draw_moving, draw_ways
from tpbso_casadi.figures.scene import draw_bodies, draw_scene
from tpbso_casadi.figures.space.panels import Points, Posture, space_figure
from tpbso_casadi.figures.space.scene import Scene
from tpbso_casadi.figures.style.colours import CLOSEST
from tpbso_casadi.planning.planned_motion import PlannedMotion

SNAPSHOTS = (("initial", "#9aa5b1"), ("middle", "#5b6b7b"), ("final", "#1b2733"))
OPACITIES, CLOSE = (0.12, 0.22, 0.35), 0.6  # of obstacles that move at these times, and at the closest approach


@dataclass(frozen=True)
class Snapshot:
    """A time at which the arm is shown.

    Attributes:
        label: for a legend.
        colour: of the arm.
        time: s.
        opacity: of the obstacles that move.
    """

    label: str
    colour: str
    time: float
    opacity: float


def path_figure(plan: PlannedMotion) -> Figure:
    """(b) The tip's path, the arm at the start, in the middle and at the end, obstacles and milestones."""
    return PATH_FIGURES[plan.criteria.robot.dim](plan)


def path_in_plane(plan: PlannedMotion) -> Figure:
    """The figure of a path in the plane."""
    figure = Figure(figsize=(6.4, 6.0), layout="constrained")
    axes = figure.subplots()
    problem, trajectory = plan.criteria, plan.trajectory
    draw_scene(axes, problem)
    joints = plan.motion.joint_positions(plan.times)
    axes.plot(*joints[:, -1].T, color="#1f4fd8", linewidth=2, label="planned path", zorder=3)
    shown = snapshots(plan)
    times = np.array([snapshot.time for snapshot in shown])
    for snapshot, posture in zip(shown, plan.motion.joint_positions(times), strict=True):
        colour, label = snapshot.colour, snapshot.label
        draw_bodies(axes, problem.robot, posture, colour)
        axes.plot(*posture.T, "-o", color=colour, markerfacecolor="white", linewidth=1.8, label=label, zorder=4)
    for milestone in problem.milestones(trajectory):
        tip = plan.motion.joint_positions(np.array([milestone.time]))[:, -1]
        axes.plot(*tip.T, "D", color="#ff7f0e", markersize=7, label=milestone.label, zorder=5)
    courses = courses_of(problem.obstacles, plan.times)
    if courses:
        draw_moving(axes, courses_of(problem.obstacles, times), [snapshot.opacity for snapshot in shown])
        points = np.vstack([np.empty((0, 2)), *(marker.points for marker in problem.markers())])
        left, right, bottom, top = extent_of(problem, joints, points, courses)
        axes.set(xlim=(left, right), ylim=(bottom, top))
        draw_ways(axes, [course.middles for course in courses])
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.grid(alpha=0.3)
    axes.set_title(f"{problem.robot.dof} joints, T = {trajectory.duration:.4g} s")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def path_in_space(plan: PlannedMotion) -> Figure:
    """The figure of a path in space."""
    problem, trajectory = plan.criteria, plan.trajectory
    shown = snapshots(plan)
    theta = trajectory.at(np.array([snapshot.time for snapshot in shown]))
    postures = [
        Posture(snapshot.label, snapshot.colour, row, snapshot.time, snapshot.opacity)
        for snapshot, row in zip(shown, theta, strict=True)
    ]
    passed = [
        Points(milestone.label, plan.motion.joint_positions(np.array([milestone.time]))[:, -1])
        for milestone in problem.milestones(trajectory)
    ]
    tip = Points("planned path", plan.motion.joint_positions(plan.times)[:, -1])
    courses = courses_of(problem.obstacles, plan.times)
    scene = Scene(problem.robot, problem.obstacles, problem.markers(), courses)
    figure = space_figure(scene, postures, tip, passed, trajectory.at(plan.times))
    figure.suptitle(f"{problem.robot.dof} joints, T = {trajectory.duration:.4g} s")
    return figure


PATH_FIGURES = {2: path_in_plane, 3: path_in_space}  # by the robot's dimensions


def snapshots(plan: PlannedMotion) -> list[Snapshot]:
    """When the arm is shown: at the start, in the middle, at the end, and where it is closest to what moves."""
    times = (0.0, middle_time(plan), plan.trajectory.duration)
    shown = [
        Snapshot(f"{name} posture", colour, time, opacity)
        for (name, colour), time, opacity in zip(SNAPSHOTS, times, OPACITIES, strict=True)
    ]
    closest = closest_to_moving(plan.criteria.robot, plan.criteria.obstacles, plan.trajectory)
    return shown if closest is None else [*shown, Snapshot(description(closest), CLOSEST, closest.time, CLOSE)]


def middle_time(plan: PlannedMotion) -> float:
    """When the arm is shown in the middle, s: at the first milestone of the motion, else at half its duration."""
    milestones = plan.criteria.milestones(plan.trajectory)
    return milestones[0].time if milestones else plan.trajectory.duration / 2.0
