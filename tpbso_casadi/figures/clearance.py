"""The figure of distances over time: how far the arm is from obstacles, and what it has to keep.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems.certify.closest_approach import ClosestApproach
from tpbso_casadi.figures.distances import TIMES, DistanceCurve, closest_to_moving, description, distance_curves
from tpbso_casadi.figures.style.colours import CLOSEST, LIMIT, line_of
from tpbso_casadi.figures.style.labels import EndLabel, label_ends
from tpbso_casadi.figures.style.paper import ONE_COLUMN, in_print
from tpbso_casadi.planning.planned_motion import PlannedMotion

STANDING = "0.6"  # colour of what stands still
KEPT = (0, (2, 1.5))
HEIGHT = 2.6  # inches


@in_print
def clearance_figure(curves: list[DistanceCurve], approach: ClosestApproach) -> Figure:
    """Distances over time, and what is closest when."""
    figure = Figure(figsize=(ONE_COLUMN, HEIGHT), layout="constrained")
    axes = figure.subplots()
    draw_distances(axes, curves, approach)
    axes.set_title(description(approach), parse_math=False)
    return figure


def clearance_drawings(plan: PlannedMotion) -> dict[str, Callable[[], Figure]]:
    """By file name, what draws the figure of distances over time; none where no obstacle moves."""
    criteria = plan.criteria
    scene = criteria.robot, criteria.obstacles, plan.trajectory
    approach = closest_to_moving(*scene)
    if approach is None:
        return {}
    return {"clearance": lambda: clearance_figure(distance_curves(*scene, plan.trajectory.times(TIMES)), approach)}


def draw_distances(axes: Axes, curves: list[DistanceCurve], approach: ClosestApproach) -> None:
    """The arm's distances over time, what has to be kept of each, and the closest approach."""
    labels = []
    for curve in curves:
        line = line_of(curve.number - 1) if curve.number else {"color": STANDING}
        axes.plot(curve.times, curve.distances, label=curve.label, **line)
        labels.append(EndLabel(curve.short_label, float(curve.distances[-1]), line["color"]))
        if np.ptp(curve.kept) > 0.0:
            kept = f"kept from obstacle {curve.number}"
            axes.plot(curve.times, curve.kept, color=line["color"], linestyle=KEPT, linewidth=0.8, label=kept)
            labels.append(EndLabel(f"kept from {curve.number}", float(curve.kept[-1]), line["color"]))
    if any(np.ptp(curve.kept) == 0.0 for curve in curves):
        axes.axhline(curves[0].kept[0], color=LIMIT, linestyle=KEPT, linewidth=0.8, label="margin")
        labels.append(EndLabel("margin", float(curves[0].kept[0]), LIMIT))
    axes.plot(approach.time, approach.distance, "o", color=CLOSEST, label="closest approach", zorder=5)
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.set_xlim(curves[0].times[0], curves[0].times[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("distance of the arm [m]")
    label_ends(axes, labels)
