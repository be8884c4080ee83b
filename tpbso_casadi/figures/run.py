"""The paper's figures of a run: (a) convergence, (b) path, (c) joints over time.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.figures.limits import limits_figure
from tpbso_casadi.figures.measures import curve_figures, progress_figures
from tpbso_casadi.figures.scene import draw_bodies, draw_scene
from tpbso_casadi.planning.plan import Plan, convergence, first_feasible, step_name
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.storage.files import write_with

DPI = 150
JOINT_COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#e377c2", "#17becf")
SNAPSHOTS = (("initial", "#9aa5b1"), ("middle", "#5b6b7b"), ("final", "#1b2733"))


def draw_figures(folder: Path, plan: PlannedMotion) -> list[Path]:
    """Draw every figure of a plan into a folder; returns their paths."""
    figures = {name: draw(plan) for name, draw in FIGURES.items()}
    further = curve_figures(plan)
    if plan.searched is not None:
        figures |= {"convergence": convergence_figure(plan.searched)}
        further |= progress_figures(plan.searched)
    figures |= {name: figure for name, (_, figure) in further.items()}
    paths = {folder / f"{name}.png": figure for name, figure in figures.items()}
    for path, figure in paths.items():
        write_with(path, partial(figure.savefig, dpi=DPI))
    return list(paths)


def convergence_figure(plan: Plan) -> Figure:
    """(a) The best cost so far over the iterations; the infeasible phase is marked, as its cost is a penalty."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    iterations, cost = convergence(plan.search)
    objective = plan.problem.objective
    axes.set_xlabel(step_name(plan.search))
    axes.set_ylabel(f"best {objective.name} so far [{objective.unit}]")
    axes.set_title(f"{plan.scenario.solver.name.rsplit(':')[-1].upper()}: convergence")
    axes.grid(alpha=0.3)
    first = first_feasible(plan)
    if first is None:
        axes.step(iterations, cost, where="post", color="#d62728")
        axes.set_ylabel("best penalised cost so far")
        axes.set_title("no feasible candidate")
        return figure
    axes.step(iterations[first:], cost[first:], where="post", color="#1f77b4")
    axes.plot(iterations[-1], cost[-1], "o", color="#1f77b4", markersize=4)
    label = f"{cost[-1]:.4g} {objective.unit}"
    axes.annotate(label, (iterations[-1], cost[-1]), (-6, 10), textcoords="offset points", ha="right")
    axes.margins(y=0.12)
    if first > 0:
        axes.axvspan(0, iterations[first], color="#d62728", alpha=0.10, label="no feasible candidate yet")
    if plan.polish is not None and plan.polish.accepted:
        axes.axhline(
            plan.polish.after.objective,
            color="#2ca02c",
            linestyle="--",
            label=f"polished: {plan.polish.after.objective:.4g}",
        )
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper right")
    axes.set_xlim(0, max(int(iterations[-1]), 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def path_figure(plan: PlannedMotion) -> Figure:
    """(b) The tip's path, the arm at the start, in the middle and at the end, obstacles and milestones."""
    figure = Figure(figsize=(6.4, 6.0), layout="constrained")
    axes = figure.subplots()
    problem, trajectory = plan.criteria, plan.trajectory
    draw_scene(axes, problem)
    tip = plan.motion.joint_positions(plan.times)[:, -1]
    axes.plot(*tip.T, color="#1f4fd8", linewidth=2, label="planned path", zorder=3)
    snapshot_times = np.array([0.0, middle_time(plan), trajectory.duration])
    for (name, colour), posture in zip(SNAPSHOTS, plan.motion.joint_positions(snapshot_times), strict=True):
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


def joints_figure(plan: PlannedMotion) -> Figure:
    """(c) Angle, speed and acceleration of every joint over time, and the jerk where it is limited; with the limits."""
    samples = plan.trajectory.samples(plan.times)
    limits_of_joints = plan.criteria.robot.limits
    ranges = None if limits_of_joints.position is None else np.array(limits_of_joints.position).T
    speed, acceleration = np.array(limits_of_joints.speed), np.array(limits_of_joints.acceleration)
    rows = [
        ("angle [rad]", samples.theta, ranges),
        ("speed [rad/s]", samples.speed, np.array([-speed, speed])),
        ("acceleration [rad/s²]", samples.acceleration, np.array([-acceleration, acceleration])),
    ]
    if limits_of_joints.jerk is not None:
        jerk = np.array(limits_of_joints.jerk)
        rows.append(("jerk [rad/s³]", samples.derivative(3), np.array([-jerk, jerk])))
    figure = Figure(figsize=(7.2, 0.5 + 2.5 * len(rows)), layout="constrained")
    panels = figure.subplots(len(rows), 1, sharex=True)
    for axes, (label, values, limits) in zip(panels, rows, strict=True):
        for joint, column in enumerate(as_array(values).T):
            axes.plot(plan.times, column, color=colour_of(joint), label=f"joint {joint + 1}")
        if limits is not None:
            draw_limits(axes, limits)
        for milestone in plan.criteria.milestones(plan.trajectory):
            axes.axvline(milestone.time, color="#ff7f0e", linestyle=":", linewidth=1.2)
        axes.set_ylabel(label)
        axes.grid(alpha=0.3)
        axes.margins(x=0.0)
    panels[-1].set_xlabel("time [s]")
    handles, labels = panels[1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 5), frameon=False)
    return figure


def draw_limits(axes: Axes, limits: FloatArray) -> None:
    """Horizontal lines at the limits (2, k): one pair in grey when all joints share it, else one in each colour."""
    shared = bool(np.ptp(limits, axis=1).max() == 0.0)
    for joint, pair in enumerate(limits.T[:1] if shared else limits.T):
        for limit in pair:
            colour = "0.25" if shared else colour_of(joint)
            axes.axhline(limit, color=colour, linestyle="--", linewidth=1.0)
    axes.plot([], [], color="0.25", linestyle="--", linewidth=1.0, label="limit")


def middle_time(plan: PlannedMotion) -> float:
    """When the arm is shown in the middle, s: at the first milestone of the motion, else at half its duration."""
    milestones = plan.criteria.milestones(plan.trajectory)
    return milestones[0].time if milestones else plan.trajectory.duration / 2.0


def colour_of(joint: int) -> str:
    """The colour of a joint (0-based) in every figure."""
    return JOINT_COLOURS[joint % len(JOINT_COLOURS)]


FIGURES = {
    "path": path_figure,
    "joints": joints_figure,
    "limits": limits_figure,
}  # of every motion; a search has others
