"""The paper's figures of a run: (a) convergence, (b) path, (c) joints over time.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse as EllipsePatch
from matplotlib.ticker import MaxNLocator

from problems import PathFollowing, PointToPoint, Problem
from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.figures.path import PATH_FIGURES
from tpbso_casadi.planning.plan import Plan, convergence, first_feasible, step_name

DPI = 150
JOINT_COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#e377c2", "#17becf")
SNAPSHOTS = (("initial", "#9aa5b1"), ("middle", "#5b6b7b"), ("final", "#1b2733"))


def draw_figures(folder: Path, plan: Plan) -> list[Path]:
    """Draw every figure of a plan into a folder; returns their paths."""
    figures = {"convergence": convergence_figure, "path": path_figure, "joints": joints_figure}
    if isinstance(plan.problem, PathFollowing):
        figures |= PATH_FIGURES
    written = []
    for name, draw in figures.items():
        path = folder / f"{name}.png"
        draw(plan).savefig(path, dpi=DPI)
        written.append(path)
    return written


def convergence_figure(plan: Plan) -> Figure:
    """(a) The best cost so far over the iterations; infeasible bests are told apart, as their cost is a penalty."""
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    iterations, cost = convergence(plan.search)
    objective = plan.problem.measured_by
    axes.set_xlabel(step_name(plan.search))
    axes.set_ylabel(f"best {objective.name} so far [{objective.unit}]")
    axes.set_title(f"{plan.scenario.solver.name.rsplit(':')[-1].upper()}: convergence")
    axes.grid(alpha=0.3)
    first = first_feasible(plan)
    if first is None:
        axes.step(iterations, cost, where="post", color="#d62728")
        axes.set_ylabel("best penalised cost so far")
        axes.set_title("no feasible candidate was met")
        return figure
    axes.step(iterations[first:], cost[first:], where="post", color="#1f77b4")
    axes.plot(iterations[-1], cost[-1], "o", color="#1f77b4", markersize=4)
    label = f"{cost[-1]:.4g} {objective.unit}"
    axes.annotate(label, (iterations[-1], cost[-1]), (-6, 10), textcoords="offset points", ha="right")
    axes.margins(y=0.12)
    if first > 0:
        axes.axvspan(0, iterations[first], color="#d62728", alpha=0.10, label="no feasible candidate yet")
    if plan.polish is not None and plan.polish.accepted:
        axes.axhline(plan.objective, color="#2ca02c", linestyle="--", label=f"polished: {plan.objective:.4g}")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="upper right")
    axes.set_xlim(0, max(int(iterations[-1]), 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    return figure


def path_figure(plan: Plan) -> Figure:
    """(b) The tip's path, the arm at the start, in the middle and at the end, obstacles and the control point."""
    figure = Figure(figsize=(6.4, 6.0), layout="constrained")
    axes = figure.subplots()
    problem, trajectory = plan.problem, plan.trajectory
    draw_task(axes, problem)
    tip = as_array(problem.arm.tip(trajectory.samples(plan.times).theta))
    axes.plot(*tip.T, color="#1f4fd8", linewidth=2, label="planned path", zorder=3)
    middle = middle_time(plan)
    for (name, colour), time in zip(SNAPSHOTS, (0.0, middle, trajectory.duration), strict=True):
        x, y = arm_at(plan, time)
        axes.plot(x, y, "-o", color=colour, markerfacecolor="white", linewidth=1.8, label=f"{name} posture", zorder=4)
    if isinstance(problem, PointToPoint):
        x, y = arm_at(plan, middle)
        axes.plot(x[-1], y[-1], "D", color="#ff7f0e", markersize=7, label="control point", zorder=5)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.grid(alpha=0.3)
    axes.set_title(f"{problem.arm.links} links, T = {trajectory.duration:.4g} s")
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def joints_figure(plan: Plan) -> Figure:
    """(c) Angle, speed and acceleration of every joint over time, with the limits."""
    figure = Figure(figsize=(7.2, 8.0), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    samples = plan.trajectory.samples(plan.times)
    arm = plan.problem.arm
    ranges = None if arm.joint_limits is None else np.array(arm.joint_limits).T
    speed, acceleration = np.array(arm.max_speed), np.array(arm.max_acceleration)
    rows = (
        ("angle [rad]", samples.theta, ranges),
        ("speed [rad/s]", samples.speed, np.array([-speed, speed])),
        ("acceleration [rad/s²]", samples.acceleration, np.array([-acceleration, acceleration])),
    )
    for axes, (label, values, limits) in zip(panels, rows, strict=True):
        for joint, column in enumerate(as_array(values).T):
            axes.plot(plan.times, column, color=colour_of(joint), label=f"joint {joint + 1}")
        if limits is not None:
            draw_limits(axes, limits)
        if isinstance(plan.problem, PointToPoint):
            axes.axvline(middle_time(plan), color="#ff7f0e", linestyle=":", linewidth=1.2)
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


def draw_task(axes: Axes, problem: Problem) -> None:
    """Base, obstacles, and what the tip has to reach."""
    axes.plot(0.0, 0.0, "s", color="black", markersize=8, label="base", zorder=5)
    for obstacle in problem.obstacles:
        width, height = 2.0 * obstacle.semi_axes[0], 2.0 * obstacle.semi_axes[1]
        degrees = float(np.degrees(obstacle.angle))
        axes.add_patch(EllipsePatch(obstacle.center, width, height, angle=degrees, color="#d62728", alpha=0.35))
    if isinstance(problem, PathFollowing):
        axes.plot(*problem.path.array.T, "*", color="#2ca02c", markersize=8, label="given points", zorder=2)
    if isinstance(problem, PointToPoint):
        axes.plot(*problem.start, "x", color="#2ca02c", markersize=9, markeredgewidth=2.2, label="start", zorder=6)
        axes.plot(*problem.goal, "*", color="#2ca02c", markersize=12, label="goal", zorder=6)


def middle_time(plan: Plan) -> float:
    """When the arm is shown in the middle: at the control point, along a path at half the time."""
    if isinstance(plan.problem, PointToPoint):
        return float(plan.trajectory.breakpoints[1])
    return plan.trajectory.duration / 2.0


def arm_at(plan: Plan, time: float) -> tuple[FloatArray, FloatArray]:
    """Where base, joints and tip are, m: x and y, both (k + 1,), at one time in s."""
    theta = ca.DM(plan.trajectory.samples(np.array([time])).theta)
    x, y = plan.problem.arm.joint_positions(theta)
    return as_array(x).ravel(), as_array(y).ravel()


def colour_of(joint: int) -> str:
    """The colour of a joint (0-based) in every figure."""
    return JOINT_COLOURS[joint % len(JOINT_COLOURS)]
