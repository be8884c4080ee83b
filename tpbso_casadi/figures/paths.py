"""The figure of a path: where the tip goes, and the arm at the start, in the middle and at the end.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.scene import draw_bodies, draw_scene
from tpbso_casadi.figures.space.panels import Points, Posture, space_figure
from tpbso_casadi.figures.space.scene import Scene
from tpbso_casadi.planning.planned_motion import PlannedMotion

SNAPSHOTS = (("initial", "#9aa5b1"), ("middle", "#5b6b7b"), ("final", "#1b2733"))


def path_figure(plan: PlannedMotion) -> Figure:
    """(b) The tip's path, the arm at the start, in the middle and at the end, obstacles and milestones."""
    return PATH_FIGURES[plan.criteria.robot.dim](plan)


def path_in_plane(plan: PlannedMotion) -> Figure:
    """The figure of a path in the plane."""
    figure = Figure(figsize=(6.4, 6.0), layout="constrained")
    axes = figure.subplots()
    problem, trajectory = plan.criteria, plan.trajectory
    draw_scene(axes, problem)
    tip = plan.motion.joint_positions(plan.times)[:, -1]
    axes.plot(*tip.T, color="#1f4fd8", linewidth=2, label="planned path", zorder=3)
    for (name, colour), posture in zip(SNAPSHOTS, plan.motion.joint_positions(snapshot_times(plan)), strict=True):
        label = f"{name} posture"
        draw_bodies(axes, problem.robot, posture, colour)
        axes.plot(*posture.T, "-o", color=colour, markerfacecolor="white", linewidth=1.8, label=label, zorder=4)
    for milestone in problem.milestones(trajectory):
        tip = plan.motion.joint_positions(np.array([milestone.time]))[:, -1]
        axes.plot(*tip.T, "D", color="#ff7f0e", markersize=7, label=milestone.label, zorder=5)
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
    theta = trajectory.at(snapshot_times(plan))
    postures = [Posture(f"{name} posture", colour, row) for (name, colour), row in zip(SNAPSHOTS, theta, strict=True)]
    passed = [
        Points(milestone.label, plan.motion.joint_positions(np.array([milestone.time]))[:, -1])
        for milestone in problem.milestones(trajectory)
    ]
    tip = Points("planned path", plan.motion.joint_positions(plan.times)[:, -1])
    scene = Scene(problem.robot, problem.obstacles, problem.markers())
    figure = space_figure(scene, postures, tip, passed, trajectory.at(plan.times))
    figure.suptitle(f"{problem.robot.dof} joints, T = {trajectory.duration:.4g} s")
    return figure


PATH_FIGURES = {2: path_in_plane, 3: path_in_space}  # by the robot's dimensions


def snapshot_times(plan: PlannedMotion) -> FloatArray:
    """When the arm is shown, s: one time for each of ``SNAPSHOTS``."""
    return np.array([0.0, middle_time(plan), plan.trajectory.duration])


def middle_time(plan: PlannedMotion) -> float:
    """When the arm is shown in the middle, s: at the first milestone of the motion, else at half its duration."""
    milestones = plan.criteria.milestones(plan.trajectory)
    return milestones[0].time if milestones else plan.trajectory.duration / 2.0
