"""What binds over time: limits, distances from obstacles; and the structure of a program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from problems import Constraint, Obstacle, Robot, Trajectory
from problems.base import FloatArray, as_array
from problems.certify import ClosestApproach, WorstIs, closest_approach, jacobian_pattern
from problems.limits import SAMPLING_MARGIN, Clearance, CollisionPair, clearances, reachable_pairs
from tpbso_casadi.figures.palette import BLUE, BROKEN, CLOSEST, DASHES, DEFAULT, LIMIT, colour_of, line_of
from tpbso_casadi.figures.style import ONE_COLUMN, SMALL, TWO_COLUMNS, EndLabel, in_print, label_ends, write_figure
from tpbso_casadi.planning import PlannedMotion, shares_of_limits
from tpbso_casadi.scenario import Scenario

STYLES = {
    "speed": (colour_of(0), DASHES[0], ""),
    "acceleration": (colour_of(1), DASHES[1], "///"),
    "jerk": (colour_of(2), DASHES[2], "..."),
    "torque": (colour_of(3), DASHES[3], "xxx"),
}  # colour, dashes and hatch of each kind of limit
LIMIT_TIMES = 2001  # at least, equally many in each piece
BINDING = 0.995  # of a limit
BAND = 0.15  # opacity of where a limit is broken


@in_print
def limits_figure(plan: PlannedMotion) -> Figure:
    """Above, of each kind of limit, the largest share that any joint uses; below, where each joint is at one."""
    trajectory, times = plan.trajectory, plan.motion.spread_times(LIMIT_TIMES)
    limited = shares_of_limits(plan.criteria, trajectory, times)
    shares = {name: np.abs(shares) for name, shares in limited}
    joints = plan.criteria.robot.dof
    figure = Figure(figsize=(TWO_COLUMNS, 2.7 + 0.22 * joints), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [1.7, 0.3 + 0.22 * joints]})
    largest = max(float(used[np.isfinite(used)].max(initial=0.0)) for used in shares.values())
    above.set_ylim(0.0, max(1.12, 1.05 * largest))
    for name, used in shares.items():
        colour, dashes, _ = STYLES[name]
        above.plot(times, used.max(axis=1), color=colour, linestyle=dashes, label=name)
    above.axhline(1.0, color=LIMIT, linewidth=0.8)
    above.set_ylabel("largest share of a limit")
    draw_binding(below, times, shares, plan.criteria.robot.joints.names)
    bound = np.any([used.max(axis=1) >= BINDING for used in shares.values()], axis=0)
    share_bound = float(np.sum(np.diff(times) * (bound[1:] & bound[:-1])) / trajectory.duration)
    broken = plan.motion.broken_spans
    draw_broken(above, broken)
    what = f"; broken: {', '.join(broken)}" if broken else ""
    above.set_title(f"a limit binds during {share_bound:.0%} of {trajectory.duration:.4g} s{what}")
    ends = {name: float(used[-1].max()) for name, used in shares.items()}
    label_ends(above, [EndLabel(name, end, STYLES[name][0]) for name, end in ends.items()])
    handles = [Patch(label=name, **bar_style(name)) for name in shares]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(shares))
    return figure


def draw_binding(axes: Axes, times: FloatArray, shares: dict[str, FloatArray], names: Sequence[str]) -> None:
    """A bar for each joint wherever it is at a limit, in the colour and the height of the kind of limit."""
    height, joints = 0.8 / len(shares), len(names)
    for row, (name, used) in enumerate(shares.items()):
        bottom, colour = 1.4 - (row + 1) * height, STYLES[name][0]
        bars = [
            rectangle(times[start], times[end], bottom + joint, bottom + joint + height)
            for joint in range(joints)
            for start, end in spans(used[:, joint] >= BINDING)
        ]
        axes.add_collection(PolyCollection(bars, facecolor=colour, edgecolor=colour))
        axes.add_collection(PolyCollection(bars, **bar_style(name) | {"facecolor": "none"}))
    axes.set_yticks(range(1, joints + 1), names)
    axes.set_ylim(joints + 0.6, 0.4)
    axes.set_xlim(times[0], times[-1])
    axes.set_xlabel("time [s]")
    axes.set_ylabel("at a limit")
    axes.grid(visible=False, axis="y")


def draw_broken(axes: Axes, broken: dict[str, list[tuple[float, float]]]) -> None:
    """A band wherever a limit is broken, whichever it is; a line where that is for a moment."""
    for spans_of_one in broken.values():
        for start, end in spans_of_one:
            if end > start:
                axes.axvspan(start, end, color=BROKEN, alpha=BAND, linewidth=0.0)
            else:
                axes.axvline(start, color=BROKEN, linewidth=0.8)


def bar_style(name: str) -> dict[str, Any]:
    """Colour and hatch of the bars of a kind of limit."""
    colour, _, hatch = STYLES[name]
    return {"facecolor": colour, "hatch": hatch, "edgecolor": "white", "linewidth": 0.0}


def spans(mask: np.ndarray) -> list[tuple[int, int]]:
    """First and last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [(int(start), int(end) - 1) for start, end in zip(edges[::2], edges[1::2], strict=True)]


SMALLEST_PANEL = 0.08  # of the height of all panels
STRUCTURE_HEIGHT = 4.6  # inches


def draw_structure(folder: Path, scenario: Scenario, formats: Sequence[str] = DEFAULT) -> list[Path]:
    """Draw ``structure.png`` into a folder, or the same in other formats."""
    return write_figure(folder, "structure", structure_figure(scenario), formats)


@in_print
def structure_figure(scenario: Scenario) -> Figure:
    """The search model on the left, the nonlinear program on the right."""
    problem = scenario.problem()
    models = [("search model", problem.model.constraints, problem.model.x)]
    if problem.has_program:
        program = problem.nlp()
        models.append(("nonlinear program", tuple(program.constraints(SAMPLING_MARGIN)), program.x))
    figure = Figure(figsize=(TWO_COLUMNS, STRUCTURE_HEIGHT), layout="constrained")
    halves = figure.add_gridspec(1, len(models))
    for side, (title, constraints, x) in enumerate(models):
        draw_model(figure.add_subfigure(halves[0, side]), title, constraints, x)
    return figure


def draw_model(figure: SubFigure, title: str, constraints: Sequence[Constraint], x: ca.SX) -> None:
    """One panel per constraint, its height proportional to its rows but large enough to be visible."""
    patterns = [jacobian_pattern(constraint, x) for constraint in constraints]
    rows, nonzeros = (sum(counts) for counts in ([len(p) for p in patterns], [int(p.sum()) for p in patterns]))
    heights = [max(len(pattern), SMALLEST_PANEL * rows) for pattern in patterns]
    panels = figure.subplots(len(patterns), 1, sharex=True, squeeze=False, gridspec_kw={"height_ratios": heights})
    for axes, pattern, constraint in zip(panels[:, 0], patterns, constraints, strict=True):
        axes.add_collection(PolyCollection(runs(pattern), facecolor=BLUE, linewidths=0.0))
        axes.set(xlim=(-0.5, pattern.shape[1] - 0.5), ylim=(len(pattern), 0.0), yticks=[])
        label = f"{constraint.name}\n{len(pattern)} rows"
        axes.set_ylabel(label, rotation=0, ha="right", va="center", fontsize=SMALL)
    panels[-1, 0].set_xlabel("variable")
    panels[-1, 0].xaxis.set_major_locator(MaxNLocator(integer=True))
    figure.suptitle(f"{title}: {rows} rows, {x.shape[0]} variables,\n{nonzeros} structural nonzeros")


def runs(pattern: np.ndarray) -> list[FloatArray]:
    """Rectangles (4, 2) around the nonzeros of a pattern (rows, columns) that follow each other in a column."""
    return [
        rectangle(column - 0.5, column + 0.5, top, bottom + 1)
        for column, mask in enumerate(pattern.T.astype(bool))
        for top, bottom in spans(mask)
    ]


def rectangle(left: float, right: float, bottom: float, top: float) -> FloatArray:
    """The corners of a rectangle, (4, 2)."""
    return np.array([(left, bottom), (right, bottom), (right, top), (left, top)])


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
        """The label for a legend."""
        return f"obstacle {self.number}, moving" if self.number else "nearest standing obstacle"

    @property
    def short_label(self) -> str:
        """The label for the end of a line."""
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
    apart = f"{WorstIs.FOUND.distance(approach.distance)} at {approach.time:.3g} s"
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
    """Drawings of distances over time, by file name; none where no obstacle moves."""
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
