"""The figure of distances over time: how far the arm is from obstacles, and what it has to keep.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems.certify.closest_approach import ClosestApproach
from tpbso_casadi.figures.distances import TIMES, DistanceCurve, closest_to_moving, description, distance_curves
from tpbso_casadi.figures.style.colours import CLOSEST, colour_of
from tpbso_casadi.planning.planned_motion import PlannedMotion

STANDING = "0.6"  # colour of what stands still


def clearance_figures(plan: PlannedMotion) -> dict[str, Figure]:
    """By file name, the figure of distances over time; none where no obstacle moves."""
    criteria = plan.criteria
    scene = criteria.robot, criteria.obstacles, plan.trajectory
    approach = closest_to_moving(*scene)
    if approach is None:
        return {}
    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    axes = figure.subplots()
    draw_distances(axes, distance_curves(*scene, plan.trajectory.times(TIMES)), approach)
    axes.set_title(f"obstacles that move, {description(approach)} ({approach.pair})", parse_math=False)
    figure.legend(loc="outside lower center", ncols=2, frameon=False)
    return {"clearance": figure}


def draw_distances(axes: Axes, curves: list[DistanceCurve], approach: ClosestApproach) -> None:
    """The arm's distances over time, what has to be kept of each, and the closest approach."""
    for curve in curves:
        colour = colour_of(curve.number - 1) if curve.number else STANDING
        axes.plot(curve.times, curve.distances, color=colour, linewidth=1.6, label=curve.label)
        if np.ptp(curve.kept) > 0.0:
            axes.plot(curve.times, curve.kept, color=colour, linestyle="--", label=f"kept from obstacle {curve.number}")
    if any(np.ptp(curve.kept) == 0.0 for curve in curves):
        axes.axhline(curves[0].kept[0], color="0.25", linestyle="--", linewidth=1.0, label="margin")
    axes.plot(approach.time, approach.distance, "o", color=CLOSEST, label="closest approach", zorder=5)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.set_xlim(curves[0].times[0], curves[0].times[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("distance of the arm [m]")
    axes.grid(alpha=0.3)
