"""Curves over time and over evaluations: joints, convergence, progress.

Along a path these are the paper's two extra figures: trajectory accuracy and redundancy angle.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from problems import CertificateStatus, Problem
from problems.assembly import MotionStage
from problems.base import FloatArray, Matrix, as_array
from problems.tasks import BoundedCurve, ProgressMeasure
from solvers import Result
from tpbso_casadi.figures.palette import BLUE, GIVEN, GREEN, LIMIT, ORANGE, PATH, PURPLE, VERMILLION, colour_of, line_of
from tpbso_casadi.figures.style import (
    LINE_HEIGHT,
    ONE_COLUMN,
    SMALL,
    TWO_COLUMNS,
    EndLabel,
    in_print,
    label_ends,
    title_figure,
)
from tpbso_casadi.plain import visible
from tpbso_casadi.planning import PlannedMotion, alternatives, convergence, first_feasible, step_name

STATUSES = {
    CertificateStatus.CERTIFIED: "certified for all t",
    CertificateStatus.VIOLATED: "a limit is violated",
    CertificateStatus.UNDECIDED: "not certified: undecided",
}


def headline(plan: PlannedMotion) -> str:
    """The name of the case, objective, duration, joints, certificate and clearance, in two lines or three."""
    objective, duration = plan.criteria.objective, plan.trajectory.duration
    value = f"{objective.name} {plan.objective:.4g} {objective.unit}".rstrip()
    is_duration = f"{plan.objective:.4g} {objective.unit}" == f"{duration:.4g} s"
    first = f"{objective.name} T = {duration:.4g} s" if is_duration else f"{value}, T = {duration:.4g} s"
    name = visible(plan.name).replace("$", r"\$")
    named = f"{name}: " if name and name.isascii() else ""  # fonts may lack other letters
    robot = plan.criteria.robot
    lines = f"{named}{first}", f"{robot.dof} joints, {STATUSES[plan.motion.status]}", plan.criteria.assumed
    return "\n".join(line for line in (*lines, plan.motion.clearance_in_words) if line)


HEIGHT = 2.6  # inches
DECADES = 30.0  # from this ratio of the largest to the least cost on the axis is logarithmic


@in_print
def convergence_figure(plan: PlannedMotion) -> Figure:
    """(a) The best cost so far over the iterations; the infeasible phase is marked, as its cost is a penalty."""
    figure = Figure(figsize=(ONE_COLUMN, HEIGHT), layout="constrained")
    axes = figure.subplots()
    problem, search = searched(plan)
    iterations, cost = convergence(search)
    objective, first = problem.criteria.objective, first_feasible(problem, search)
    solver = plan.scenario.solver.name.rsplit(":")[-1].upper()
    axes.set_xlabel(step_name(search))
    axes.set_ylabel(f"best {objective.name} so far [{objective.unit}]" if first is not None else "penalised cost")
    axes.set_xlim(0, max(int(iterations[-1]), 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    if first is None:
        axes.set_title(f"{solver}: no feasible candidate")
        draw_cost(axes, iterations, cost, VERMILLION)
        return figure
    axes.set_title(f"{solver}: {search.evaluations} evaluations")
    draw_cost(axes, iterations[first:], cost[first:], BLUE)
    labels = [EndLabel(f"{cost[-1]:.4g}", cost[-1], BLUE)]
    if plan.polish is not None and plan.polish.accepted:
        polished = plan.polish.after.objective
        axes.axhline(polished, color=GREEN, linestyle="--")
        labels.append(EndLabel(f"{polished:.4g}, polished", polished, GREEN))
    if first > 0:
        label = "nothing feasible yet"
        axes.axvspan(0, iterations[first], facecolor="0.88", hatch="///", edgecolor="0.75", linewidth=0.0, label=label)
        axes.legend(loc="upper right")
    label_ends(axes, labels)
    return figure


def draw_cost(axes: Axes, iterations: FloatArray, cost: FloatArray, colour: str) -> None:
    """The cost as steps, on a logarithmic axis where it spans decades."""
    axes.step(iterations, cost, where="post", color=colour)
    axes.plot(iterations[-1], cost[-1], "o", color=colour, markersize=3.5, clip_on=False)
    known = cost[np.isfinite(cost)]
    if known.size and known.min() > 0.0 and known.max() > DECADES * known.min():
        axes.set_yscale("log")
    axes.margins(y=0.08)


PANEL_HEIGHT, FRAME = 1.35, 0.9  # inches: of a panel at least; above and below all
MOST_NAMED = 12  # stages with names above the curves
FAR = 2.5  # times the largest value: a limit beyond that is named at the edge and does not stretch the axis


@dataclass(frozen=True)
class Row:
    """A quantity of all joints.

    Attributes:
        label: of the axis.
        values: (n, k).
        sizes: limits of the sizes, (k,); none where there are none.
        ranges: limits that are not symmetric, (2, k).
    """

    label: str
    values: Matrix
    sizes: FloatArray | None = None
    ranges: FloatArray | None = None


@in_print
def joints_figure(plan: PlannedMotion) -> Figure:
    """(c) Angle, speed and acceleration of every joint over time, jerk where it is limited, torque where known."""
    rows, names = list(rows_of(plan)), plan.criteria.robot.joints.names
    heights = np.array(
        [max(PANEL_HEIGHT, len(names) * LINE_HEIGHT * SMALL / 72.0 + 0.15), *[PANEL_HEIGHT] * (len(rows) - 1)]
    )
    figure = Figure(figsize=(TWO_COLUMNS, FRAME + float(heights.sum())), layout="constrained")
    panels = figure.subplots(len(rows), 1, sharex=True, gridspec_kw={"height_ratios": heights})
    for axes, row in zip(panels, rows, strict=True):
        axes.set_ylabel(row.label)
        axes.set_xlim(plan.times[0], plan.times[-1])
        values = as_array(row.values)
        for joint, column in enumerate(values.T):
            axes.plot(plan.times, column, label=names[joint], **line_of(joint))
        for milestone in plan.criteria.milestones(plan.trajectory):
            axes.axvline(milestone.time, color=ORANGE, linestyle=":", linewidth=1.2)
        draw_limits(axes, row, names, float(np.abs(values).max()))
    for milestone in plan.criteria.milestones(plan.trajectory):
        place = {"xycoords": panels[0].get_xaxis_transform(), "ha": "center", "va": "bottom", "fontsize": SMALL}
        panels[0].annotate(milestone.label, (milestone.time, 1.0), **place)
    draw_stages(panels, plan.motion.stages)
    ends = as_array(rows[0].values)[-1]
    label_ends(panels[0], [EndLabel(names[j], float(end), colour_of(j)) for j, end in enumerate(ends)])
    panels[-1].set_xlabel("time [s]")
    title_figure(figure, headline(plan).replace("\n", ", ", 1))
    return figure


def draw_stages(panels: Sequence[Axes], stages: Sequence[MotionStage]) -> None:
    """Lines where stages meet that take time, and their names above, or numbers where they are many."""
    lasting = [stage for stage in stages if stage.end > stage.start]
    for stage in lasting[1:]:
        for axes in panels:
            axes.axvline(stage.start, color=LIMIT, linestyle=":", linewidth=0.6)
    for stage in lasting:
        number, _, kind = stage.name.rpartition(" ")
        text = f"{number}\n{kind}" if len(lasting) <= MOST_NAMED else number
        place: Any = {"xycoords": panels[0].get_xaxis_transform(), "ha": "center", "va": "bottom", "fontsize": SMALL}
        panels[0].annotate(text, ((stage.start + stage.end) / 2.0, 1.0), **place)


def rows_of(plan: PlannedMotion) -> Iterator[Row]:
    """The curves of the joints, with their limits."""
    robot, samples = plan.criteria.robot, plan.trajectory.samples(plan.times)
    limits, unit = robot.limits, alternatives(robot.joints.units)
    ranges = None if limits.position is None else np.array(limits.position).T
    yield Row(f"{'angle' if unit == 'rad' else 'position'} [{unit}]", samples.theta, ranges=ranges)
    yield Row(f"speed [{unit}/s]", samples.speed, np.array(limits.speed))
    yield Row(f"acceleration [{unit}/s²]", samples.acceleration, np.array(limits.acceleration))
    if limits.jerk is not None:
        yield Row(f"jerk [{unit}/s³]", samples.derivative(3), np.array(limits.jerk))
    torques = plan.motion.torques(plan.times)
    if torques is not None:
        most = None if limits.torque is None else np.array(limits.torque)
        yield Row(f"torque [{alternatives(robot.joints.torque_units)}]", ca.DM(torques), most)


def draw_limits(axes: Axes, row: Row, names: Sequence[str], largest: float) -> None:
    """Lines at limits: of sizes in grey with the names of joints that share one, of ranges in the joint's colour."""
    for joint, pair in enumerate(() if row.ranges is None else row.ranges.T):
        for limit in pair:
            axes.axhline(limit, color=colour_of(joint), linestyle=(0, (1, 2.5)), linewidth=0.8)
    if row.sizes is None:
        return
    near = [size for size in row.sizes if size <= FAR * largest]
    top = 1.08 * max([largest, *near])
    axes.set_ylim(-top, top)
    for size in sorted(set(near)):
        for limit in (-size, size):
            axes.axhline(limit, color=LIMIT, linestyle="--", linewidth=0.8)
    labels = [EndLabel(text, size, LIMIT) for size, text in limit_labels(row.sizes, names)]
    label_ends(axes, labels)


def limit_labels(sizes: FloatArray, names: Sequence[str]) -> list[tuple[float, str]]:
    """Each limit and what is said of it: its size, and whose it is where joints differ."""
    shared = len(set(sizes.tolist())) == 1
    return [
        (size, f"± {size:g}" if shared else f"± {size:g}, {ranges_of(names, np.flatnonzero(sizes == size))}")
        for size in sorted(set(sizes.tolist()))
    ]


def ranges_of(names: Sequence[str], joints: np.ndarray) -> str:
    """Names of joints by their increasing numbers (from 0 on), those that follow each other as a range in two lines."""
    breaks = np.concatenate([[0], np.cumsum([after > before + 1 for before, after in pairwise(joints)])])
    runs = [[names[joint] for joint, _ in run] for _, run in groupby(zip(joints, breaks, strict=True), lambda p: p[1])]
    return ", ".join(f"{run[0]}\nto {run[-1]}" if len(run) > 1 else run[0] for run in runs)


def searched(plan: PlannedMotion) -> tuple[Problem[Any], Result]:
    """The problem of a plan and the record of its search, of a plan that was searched for here."""
    assert plan.problem is not None and plan.search is not None
    return plan.problem, plan.search


def progress_figures(plan: PlannedMotion) -> dict[str, tuple[str, Figure]]:
    """Captions and figures of the problem's progress measures, by file name."""
    measures = searched(plan)[0].progress_measures()
    return {measure.name: (measure.label, progress_figure(plan, measure)) for measure in measures}


@in_print
def progress_figure(plan: PlannedMotion, measure: ProgressMeasure) -> Figure:
    """A measure of the best candidate so far over the iterations."""
    figure = Figure(figsize=(ONE_COLUMN, HEIGHT), layout="constrained")
    axes = figure.subplots()
    _, search = searched(plan)
    iterations, _ = convergence(search)
    history = progress_history(plan, measure)
    axes.step(iterations, history, where="post", color=BLUE)
    axes.axhline(measure.limit, color=LIMIT, linestyle="--", linewidth=0.8)
    axes.set_xlabel(step_name(search))
    axes.set_ylabel(f"{measure.label} [{measure.unit}]")
    axes.set_title(measure.title)
    axes.set_xlim(0, max(int(iterations[-1]), 1))
    axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6))
    axes.set_ylim(0.0, 1.1 * max(axes.get_ylim()[1], measure.limit))
    reached = float(history[-1])
    label_ends(axes, [EndLabel(f"{reached:.3g}", reached, BLUE), EndLabel("limit", measure.limit, LIMIT)])
    return figure


def progress_history(plan: PlannedMotion, measure: ProgressMeasure) -> FloatArray:
    """A measure of the best candidate so far after each iteration or start, (n,), in its unit."""
    problem, search = searched(plan)
    if not search.in_program_variables:
        return measure.of_candidates(search.history.best)
    program = problem.nlp()
    return np.array([measure.of_trajectory(program.trajectory(x)) for x in search.history.best])


def curve_figures(plan: PlannedMotion) -> dict[str, tuple[str, Figure]]:
    """Captions and figures of the problem's bounded curves, by file name; curves of one name share a figure."""
    groups = curve_groups(plan)
    return {name: (group[0].label, curve_figure(plan.times, group)) for name, group in groups.items()}


def curve_groups(plan: PlannedMotion) -> dict[str, tuple[BoundedCurve, ...]]:
    """The problem's bounded curves by the file name of their figure."""
    curves = plan.criteria.task.bounded_curves(plan.trajectory)
    return {name: tuple(group) for name, group in groupby(curves, key=lambda curve: curve.name)}


@in_print
def curve_figure(times: FloatArray, curves: Sequence[BoundedCurve]) -> Figure:
    """Each curve at times (n,) in s over its bounds, one panel each."""
    figure = Figure(figsize=(TWO_COLUMNS, 0.9 + 2.0 * len(curves)), layout="constrained")
    panels = figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0]
    for axes, curve in zip(panels, curves, strict=True):
        axes.fill_between(curve.times, curve.lower, curve.upper, color=GIVEN, alpha=0.12, linewidth=0.0)
        axes.plot(times, curve.value(times), color=PATH, label="planned")
        small = {"linestyle": "none", "markersize": 3.0}
        axes.plot(curve.times, curve.upper, "v", color=VERMILLION, label=f"upper bound at a {curve.event}", **small)
        axes.plot(curve.times, curve.lower, "^", color=PURPLE, label=f"lower bound at a {curve.event}", **small)
        axes.plot(curve.times, curve.value(curve.times), "o", color=GIVEN, label=f"{curve.event} passed", **small)
        axes.set_ylabel(f"{curve.label} ${curve.symbol}$ [{curve.unit}]")
        axes.margins(x=0.01)
    panels[0].set_title(f"{curves[0].label} between its bounds")
    panels[-1].set_xlabel("time [s]")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure
