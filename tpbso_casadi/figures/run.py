"""The paper's figures of a run: (a) convergence, (b) path, (c) joints over time.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.figures.clearance import clearance_figures
from tpbso_casadi.figures.limits import limits_figure
from tpbso_casadi.figures.measures import curve_figures, progress_figures
from tpbso_casadi.figures.paths import path_figure
from tpbso_casadi.figures.style.colours import colour_of
from tpbso_casadi.figures.style.files import write_figure
from tpbso_casadi.figures.style.formats import DEFAULT
from tpbso_casadi.planning.joint_quantities import alternatives
from tpbso_casadi.planning.plan import convergence, first_feasible, step_name
from tpbso_casadi.planning.planned_motion import PlannedMotion, SearchedMotion


def draw_figures(folder: Path, plan: PlannedMotion, formats: Sequence[str] = DEFAULT) -> list[Path]:
    """Draw every figure of a plan into a folder; returns their paths."""
    figures = {name: draw(plan) for name, draw in FIGURES.items()} | clearance_figures(plan)
    further = curve_figures(plan)
    if plan.searched is not None:
        figures |= {"convergence": convergence_figure(plan.searched)}
        further |= progress_figures(plan.searched)
    figures |= {name: figure for name, (_, figure) in further.items()}
    return [path for name, figure in figures.items() for path in write_figure(folder, name, figure, formats)]


def convergence_figure(plan: SearchedMotion) -> Figure:
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


def joints_figure(plan: PlannedMotion) -> Figure:
    """(c) Angle, speed and acceleration of every joint over time, jerk where it is limited, torque where known."""
    samples = plan.trajectory.samples(plan.times)
    limits_of_joints = plan.criteria.robot.limits
    unit = alternatives(plan.criteria.robot.joint_units)
    ranges = None if limits_of_joints.position is None else np.array(limits_of_joints.position).T
    speed, acceleration = np.array(limits_of_joints.speed), np.array(limits_of_joints.acceleration)
    rows = [
        (f"{'angle' if unit == 'rad' else 'position'} [{unit}]", samples.theta, ranges),
        (f"speed [{unit}/s]", samples.speed, np.array([-speed, speed])),
        (f"acceleration [{unit}/s²]", samples.acceleration, np.array([-acceleration, acceleration])),
    ]
    if limits_of_joints.jerk is not None:
        jerk = np.array(limits_of_joints.jerk)
        rows.append((f"jerk [{unit}/s³]", samples.derivative(3), np.array([-jerk, jerk])))
    torques = plan.motion.torques(plan.times)
    if torques is not None:
        most = None if limits_of_joints.torque is None else np.outer([-1.0, 1.0], limits_of_joints.torque)
        rows.append((f"torque [{alternatives(plan.criteria.robot.torque_units)}]", ca.DM(torques), most))
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


FIGURES = {
    "path": path_figure,
    "joints": joints_figure,
    "limits": limits_figure,
}  # of every motion; a search has others
