"""Distances over time, as numbers and as figures.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from problems import Obstacle, Robot, Trajectory
from problems.base import FloatArray, as_array
from problems.certify import ClosestApproach, closest_approach
from problems.limits import Clearance, CollisionPair, clearances, reachable_pairs
from tpbso_casadi.figures.labels import EndLabel, label_ends
from tpbso_casadi.figures.palette import CLOSEST, LIMIT, line_of
from tpbso_casadi.figures.style import ONE_COLUMN, in_print
from tpbso_casadi.planning import PlannedMotion

TIMES = 1001  # at least, equally many in each piece


@dataclass(frozen=True)
class DistanceCurve:
    """The distance of an arm from an obstacle that moves, or from the nearest of those that stand.

    Attributes:
        number: of the obstacle, 1, 2, ...; 0 for those that stand.
        times: (n,), s.
        distances: lower bounds that are as sharp as those of the limits, (n,), m; negative where the two meet.
        kept: what has to be kept, (n,), m.
    """

    number: int
    times: FloatArray
    distances: FloatArray
    kept: FloatArray

    @property
    def label(self) -> str:
        """For a legend."""
        return f"obstacle {self.number}, moving" if self.number else "nearest standing obstacle"

    @property
    def short_label(self) -> str:
        """For the end of a line."""
        return f"obstacle {self.number}" if self.number else "standing"


def distance_curves(
    robot: Robot, obstacles: Sequence[Obstacle], trajectory: Trajectory, times: FloatArray
) -> list[DistanceCurve]:
    """How far a robot is from obstacles at times (n,) in s: from each that moves, from the nearest that stands."""
    frames, clock = robot.positions(ca.DM(trajectory.at(times))), ca.DM(times)

    def curve(number: int, pairs: list[CollisionPair]) -> DistanceCurve:
        nearest = as_array(clearances([pair.without_growth() for pair in pairs], frames, clock)).min(axis=1)
        return DistanceCurve(number, times, nearest, robot.margin + pairs[0].growth_rate * times)

    pairs = sorted(pairs_of(robot, obstacles), key=_number)
    return [curve(number, list(group)) for number, group in groupby(pairs, _number)]


def pairs_of(robot: Robot, obstacles: Sequence[Obstacle]) -> list[CollisionPair]:
    """All bodies that a joint moves, and all obstacles, however far apart; distances, not only whether they touch."""
    return [replace(pair, measured=True) for pair in reachable_pairs(robot, obstacles, spare=np.inf)]


def _number(pair: CollisionPair) -> int:
    return pair.number if pair.is_time_dependent else 0


def closest_to_moving(robot: Robot, obstacles: Sequence[Obstacle], trajectory: Trajectory) -> ClosestApproach | None:
    """When a robot is closest to an obstacle that moves; None where nothing can touch one."""
    if not any(obstacle.moves for obstacle in obstacles):
        return None
    pairs = tuple(pair for pair in pairs_of(robot, obstacles) if pair.is_time_dependent)
    return closest_approach(Clearance(robot, pairs), trajectory)


def description(approach: ClosestApproach) -> str:
    """How close to an obstacle that moves, and when, in two lines."""
    apart = f"{1000.0 * approach.distance:.1f} mm at {approach.time:.3g} s"
    return f"closest to a moving obstacle:\n{apart} ({approach.pair})"


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
