"""The figure of joints over time.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems.base.matrix import FloatArray, Matrix, as_array
from tpbso_casadi.figures.captions import headline
from tpbso_casadi.figures.style.colours import LIMIT, ORANGE, colour_of, line_of
from tpbso_casadi.figures.style.labels import LINE_HEIGHT, EndLabel, label_ends
from tpbso_casadi.figures.style.paper import SMALL, TWO_COLUMNS, in_print
from tpbso_casadi.planning.joint_quantities import alternatives
from tpbso_casadi.planning.planned_motion import PlannedMotion

HEIGHT, FRAME = 1.35, 0.9  # inches: of a panel at least; above and below all
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
    rows, joints = list(rows_of(plan)), plan.criteria.robot.dof
    heights = np.array([max(HEIGHT, joints * LINE_HEIGHT * SMALL / 72.0 + 0.15), *[HEIGHT] * (len(rows) - 1)])
    figure = Figure(figsize=(TWO_COLUMNS, FRAME + float(heights.sum())), layout="constrained")
    panels = figure.subplots(len(rows), 1, sharex=True, gridspec_kw={"height_ratios": heights})
    for axes, row in zip(panels, rows, strict=True):
        axes.set_ylabel(row.label)
        axes.set_xlim(plan.times[0], plan.times[-1])
        values = as_array(row.values)
        for joint, column in enumerate(values.T):
            axes.plot(plan.times, column, label=f"joint {joint + 1}", **line_of(joint))
        for milestone in plan.criteria.milestones(plan.trajectory):
            axes.axvline(milestone.time, color=ORANGE, linestyle=":", linewidth=1.2)
        draw_limits(axes, row, float(np.abs(values).max()))
    for milestone in plan.criteria.milestones(plan.trajectory):
        place = {"xycoords": panels[0].get_xaxis_transform(), "ha": "center", "va": "bottom", "fontsize": SMALL}
        panels[0].annotate(milestone.label, (milestone.time, 1.0), **place)
    ends = as_array(rows[0].values)[-1]
    label_ends(panels[0], [EndLabel(f"joint {j + 1}", float(end), colour_of(j)) for j, end in enumerate(ends)])
    panels[-1].set_xlabel("time [s]")
    figure.suptitle(headline(plan).replace("\n", ", "))
    return figure


def rows_of(plan: PlannedMotion) -> Iterator[Row]:
    """What is known of the joints, with its limits."""
    robot, samples = plan.criteria.robot, plan.trajectory.samples(plan.times)
    limits, unit = robot.limits, alternatives(robot.joint_units)
    ranges = None if limits.position is None else np.array(limits.position).T
    yield Row(f"{'angle' if unit == 'rad' else 'position'} [{unit}]", samples.theta, ranges=ranges)
    yield Row(f"speed [{unit}/s]", samples.speed, np.array(limits.speed))
    yield Row(f"acceleration [{unit}/s²]", samples.acceleration, np.array(limits.acceleration))
    if limits.jerk is not None:
        yield Row(f"jerk [{unit}/s³]", samples.derivative(3), np.array(limits.jerk))
    torques = plan.motion.torques(plan.times)
    if torques is not None:
        most = None if limits.torque is None else np.array(limits.torque)
        yield Row(f"torque [{alternatives(robot.torque_units)}]", ca.DM(torques), most)


def draw_limits(axes: Axes, row: Row, largest: float) -> None:
    """Lines at limits: of sizes in grey with a label for the joints that share one, of ranges in the joint's colour."""
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
    labels = [EndLabel(text, size, LIMIT) for size, text in limit_labels(row.sizes)]
    label_ends(axes, labels)


def limit_labels(sizes: FloatArray) -> list[tuple[float, str]]:
    """Each limit and what is said of it: its size, and whose it is where joints differ."""
    shared = len(set(sizes.tolist())) == 1
    return [
        (size, f"± {size:g}" if shared else f"± {size:g}, joint {numbers(np.flatnonzero(sizes == size) + 1)}")
        for size in sorted(set(sizes.tolist()))
    ]


def numbers(joints: np.ndarray) -> str:
    """Increasing numbers with those that follow each other as a range: 1-4, 6."""
    breaks = np.concatenate([[0], np.cumsum([after > before + 1 for before, after in pairwise(joints)])])
    runs = [[int(joint) for joint, _ in run] for _, run in groupby(zip(joints, breaks, strict=True), lambda p: p[1])]
    return ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
