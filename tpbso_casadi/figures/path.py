"""The paper's extra figures of a path: accuracy over the iterations, redundancy angle between its bounds."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from problems import PathFollowing
from problems.base.matrix import FloatArray, as_array
from solvers import DescentResult
from tpbso_casadi.planning.plan import Plan, convergence, step_name


def accuracy_figure(plan: Plan) -> Figure:
    """Trajectory accuracy (24) of the best candidate so far over the iterations: smaller is better."""
    problem = path_problem(plan)
    figure = Figure(figsize=(6.4, 4.2), layout="constrained")
    axes = figure.subplots()
    iterations, _ = convergence(plan.search)
    axes.step(iterations, accuracy_history(plan), where="post", color="#1f77b4")
    axes.axhline(problem.accuracy, color="0.25", linestyle="--", linewidth=1.0, label="limit")
    axes.set_xlabel(step_name(plan.search))
    axes.set_ylabel("trajectory accuracy [m]")
    axes.set_title("largest distance from a given point")
    axes.set_xlim(0, max(int(iterations[-1]), 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylim(0.0, 1.1 * max(axes.get_ylim()[1], problem.accuracy))
    axes.grid(alpha=0.3)
    axes.legend()
    return figure


def accuracy_history(plan: Plan) -> FloatArray:
    """Accuracy of the best so far after each iteration or start, (n,), m."""
    problem, best = path_problem(plan), plan.search.history.best
    if not isinstance(plan.search, DescentResult):
        return problem.accuracy_of(best)
    program = problem.nlp()
    return np.array([problem.accuracy_at(program.trajectory(x)) for x in best])


def redundancy_figure(plan: Plan) -> Figure:
    """Redundancy angle of each link beyond the second over time, with its bounds (23) at the given points."""
    problem = path_problem(plan)
    extra = problem.arm.links - 2
    figure = Figure(figsize=(6.8, 1.6 + 2.8 * extra), layout="constrained")
    panels = np.atleast_1d(figure.subplots(extra, 1, sharex=True))
    angles = np.cumsum(as_array(plan.trajectory.samples(plan.times).theta), axis=1)[:, 2:]
    phi, lower, upper = problem.redundancy_ranges(plan.trajectory)
    times = problem.point_times(plan.trajectory)
    for index, axes in enumerate(panels):
        axes.plot(plan.times, angles[:, index], color="#1f4fd8", label="planned")
        axes.plot(times, upper[:, index], ".", color="#d62728", label="upper bound at a given point")
        axes.plot(times, lower[:, index], ".", color="#9467bd", label="lower bound at a given point")
        axes.plot(times, phi[:, index], "*", color="#2ca02c", markersize=5, label="given point passed")
        axes.set_ylabel(f"redundancy angle $\\phi_{{{index + 3}}}$ [rad]")
        axes.grid(alpha=0.3)
        axes.margins(x=0.01)
    panels[-1].set_xlabel("time [s]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, frameon=False)
    return figure


def path_problem(plan: Plan) -> PathFollowing:
    """The problem of a plan that follows a path."""
    assert isinstance(plan.problem, PathFollowing)
    return plan.problem


PATH_FIGURES = {"accuracy": accuracy_figure, "redundancy": redundancy_figure}
