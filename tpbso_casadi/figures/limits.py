"""The figure of limits over time: how much of its speed, acceleration, jerk and torque each joint uses.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.style.colours import DASHES, LIMIT, colour_of
from tpbso_casadi.figures.style.labels import EndLabel, label_ends
from tpbso_casadi.figures.style.paper import TWO_COLUMNS, in_print
from tpbso_casadi.planning.joint_quantities import shares_of_limits
from tpbso_casadi.planning.planned_motion import PlannedMotion

STYLES = {
    "speed": (colour_of(0), DASHES[0], ""),
    "acceleration": (colour_of(1), DASHES[1], "///"),
    "jerk": (colour_of(2), DASHES[2], "..."),
    "torque": (colour_of(3), DASHES[3], "xxx"),
}  # colour, dashes and hatch of each kind of limit
TIMES = 2001  # at least, equally many in each piece
BINDING = 0.995  # of a limit


@in_print
def limits_figure(plan: PlannedMotion) -> Figure:
    """Above, of each kind of limit, the largest share that any joint uses; below, where each joint is at one."""
    trajectory, times = plan.trajectory, plan.trajectory.times(TIMES)
    limited = shares_of_limits(plan.criteria.robot, trajectory, times)
    shares = {name: np.abs(shares) for name, shares in limited}
    joints = plan.criteria.robot.dof
    figure = Figure(figsize=(TWO_COLUMNS, 2.7 + 0.22 * joints), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.7, 0.3 + 0.22 * joints]})
    above.set_ylim(0.0, 1.12)
    for name, used in shares.items():
        colour, dashes, _ = STYLES[name]
        above.plot(times, used.max(axis=1), color=colour, linestyle=dashes, label=name)
    above.axhline(1.0, color=LIMIT, linewidth=0.8)
    above.set_ylabel("largest share of a limit")
    draw_binding(below, times, shares, joints)
    bound = np.any([used.max(axis=1) >= BINDING for used in shares.values()], axis=0)
    share_bound = float(np.sum(np.diff(times) * (bound[1:] & bound[:-1])) / trajectory.duration)
    above.set_title(f"a limit binds during {share_bound:.0%} of {trajectory.duration:.4g} s")
    ends = {name: float(used[-1].max()) for name, used in shares.items()}
    label_ends(above, [EndLabel(name, end, STYLES[name][0]) for name, end in ends.items()])
    handles = [Patch(label=name, **bar_style(name)) for name in shares]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(shares))
    return figure


def draw_binding(axes: Axes, times: FloatArray, shares: dict[str, FloatArray], joints: int) -> None:
    """A bar for each joint wherever it is at a limit, in the colour and the height of the kind of limit."""
    height = 0.8 / len(shares)
    for row, (name, used) in enumerate(shares.items()):
        for joint in range(joints):
            bottom = joint + 1.4 - (row + 1) * height
            bars = [(times[start], times[end] - times[start]) for start, end in spans(used[:, joint] >= BINDING)]
            if bars:
                axes.broken_barh(bars, (bottom, height), facecolor=STYLES[name][0], edgecolor=STYLES[name][0])
                axes.broken_barh(bars, (bottom, height), **bar_style(name) | {"facecolor": "none"})
    axes.set_yticks(range(1, joints + 1), [f"joint {joint}" for joint in range(1, joints + 1)])
    axes.set_ylim(joints + 0.6, 0.4)
    axes.set_xlim(times[0], times[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("at a limit")
    axes.grid(visible=False, axis="y")


def bar_style(name: str) -> dict[str, Any]:
    """Colour and hatch of the bars of a kind of limit."""
    colour, _, hatch = STYLES[name]
    return {"facecolor": colour, "hatch": hatch, "edgecolor": "white", "linewidth": 0.0}


def spans(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(start), int(end) - 1) for start, end in zip(edges[::2], edges[1::2], strict=True)]
