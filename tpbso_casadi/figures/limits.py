"""The figure of limits over time: how much of its speed, acceleration, jerk and torque each joint uses.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems.base.matrix import FloatArray
from tpbso_casadi.planning.joint_quantities import shares_of_limits
from tpbso_casadi.planning.planned_motion import PlannedMotion

STYLES = {
    "speed": ("#0072b2", "-"),
    "acceleration": ("#d55e00", "--"),
    "jerk": ("#009e73", ":"),
    "torque": ("#cc79a7", "-."),
}  # colour and line of each kind of limit
TIMES = 2001  # at least, equally many in each piece
BINDING = 0.995  # of a limit


def limits_figure(plan: PlannedMotion) -> Figure:
    """Above, of each kind of limit, the largest share that any joint uses; below, where each joint is at one."""
    trajectory, times = plan.trajectory, plan.trajectory.times(TIMES)
    limited = shares_of_limits(plan.criteria.robot, trajectory, times)
    shares = {name: np.abs(shares) for name, shares in limited}
    joints = plan.criteria.robot.dof
    figure = Figure(figsize=(7.2, 3.6 + 0.32 * joints), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [3.0, 0.4 + 0.4 * joints]})
    for name, used in shares.items():
        colour, style = STYLES[name]
        above.plot(times, used.max(axis=1), color=colour, linestyle=style, linewidth=1.6, label=name)
    above.axhline(1.0, color="0.25", linewidth=0.8)
    above.set_ylim(0.0, 1.12)
    above.set_ylabel("largest share of a limit")
    above.grid(alpha=0.3)
    draw_binding(below, times, shares, joints)
    bound = np.any([used.max(axis=1) >= BINDING for used in shares.values()], axis=0)
    share_bound = float(np.sum(np.diff(times) * (bound[1:] & bound[:-1])) / trajectory.duration)
    above.set_title(f"a limit binds during {share_bound:.0%} of {trajectory.duration:.4g} s")
    handles = above.get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=len(shares), frameon=False)
    return figure


def draw_binding(axes: Axes, times: FloatArray, shares: dict[str, FloatArray], joints: int) -> None:
    """A bar for each joint wherever it is at a limit, in the colour and the height of the kind of limit."""
    height = 0.8 / len(shares)
    for row, (name, used) in enumerate(shares.items()):
        colour, _ = STYLES[name]
        for joint in range(joints):
            for start, end in spans(used[:, joint] >= BINDING):
                bottom = joint + 1.4 - (row + 1) * height
                axes.broken_barh([(times[start], times[end] - times[start])], (bottom, height), color=colour)
    axes.set_yticks(range(1, joints + 1), [f"joint {joint}" for joint in range(1, joints + 1)])
    axes.set_ylim(joints + 0.6, 0.4)
    axes.set_xlim(times[0], times[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("at a limit")
    axes.grid(alpha=0.3, axis="x")


def spans(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(start), int(end) - 1) for start, end in zip(edges[::2], edges[1::2], strict=True)]
