"""Postures along a motion: those drawn, the band swept, points passed, where it comes nearest.

Imported only where a figure is drawn: matplotlib is slow to load.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from problems.base import FloatArray
from problems.limits import CollisionPair
from problems.tasks import Marker
from tpbso_casadi.figures.distances import pairs_of
from tpbso_casadi.figures.palette import CLOSEST, GIVEN, ORANGE, shade_of
from tpbso_casadi.planning import Motion

CORNERS = 48  # of a circle


def draw_band(axes: Axes, marker: Marker) -> None:
    """Shade what is near enough to the points of a marker, (n, 2), or to the lines between them, if it says so."""
    if not marker.tolerance > 0.0:
        return
    pieces = outlines(marker.points, marker.tolerance, joined=marker.joined)
    path = Path.make_compound_path(*(Path(piece, closed=True) for piece in pieces))
    label = f"within {1000.0 * marker.tolerance:.4g} mm of {'the path' if marker.joined else 'a given point'}"
    axes.add_patch(PathPatch(path, facecolor=GIVEN, alpha=0.16, linewidth=0.0, label=label, zorder=1))


def outlines(points: FloatArray, width: float, *, joined: bool) -> Sequence[FloatArray]:
    """Outlines (m, 2), all counter-clockwise, that together are all within a width of points (n, 2), or of lines."""
    turn = np.linspace(0.0, 2.0 * np.pi, CORNERS + 1)
    circle = width * np.column_stack([np.cos(turn), np.sin(turn)])
    found = [point + circle for point in points]
    for start, end in pairwise(points) if joined else ():
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            across = width * np.array([[0.0, -1.0], [1.0, 0.0]]) @ (end - start) / length
            corners = [start - across, end - across, end + across, start + across]
            found.append(np.array([*corners, corners[0]]))
    return found


COUNT = 9
OPACITIES, CLOSE = (0.12, 0.22, 0.35), 0.55  # of obstacles that move: at the start, halfway, at the end; when closest


@dataclass(frozen=True)
class Snapshot:
    """A time at which the arm is shown.

    Attributes:
        label: of it; empty for those between start and goal.
        colour: of the arm.
        time: s.
        opacity: of the obstacles that move; 0 where they are not shown.
    """

    label: str
    colour: Any
    time: float
    opacity: float = 0.0


def fan_of(motion: Motion) -> list[Snapshot]:
    """``COUNT`` postures, equally spaced in time, the first at the start, the last at the end, from light to dark."""
    shares = np.linspace(0.0, 1.0, COUNT)
    labels = {0: "start", COUNT - 1: "end"}
    opacities = dict(zip((0, COUNT // 2, COUNT - 1), OPACITIES, strict=True))
    return [
        Snapshot(labels.get(k, ""), shade_of(share), share * motion.trajectory.duration, opacities.get(k, 0.0))
        for k, share in enumerate(shares.tolist())
    ]


def snapshots(motion: Motion) -> list[Snapshot]:
    """The fan, and the posture of the closest approach to an obstacle, if there is one within reach."""
    closest = motion.closest_approach
    fan = fan_of(motion)
    return fan if closest is None else [*fan, Snapshot("closest", CLOSEST, closest.time, CLOSE)]


def times_of(shown: list[Snapshot]) -> FloatArray:
    """Their times, (n,), s."""
    return np.array([snapshot.time for snapshot in shown])


def legend_of(motion: Motion) -> str:
    """What a legend says of the fan."""
    return f"{COUNT} postures, every {motion.trajectory.duration / (COUNT - 1):.3g} s, light to dark"


OUTLINE_CORNERS = 4096  # of an outline that is curved
STEP = 1e-5  # m: of differences


@dataclass(frozen=True)
class Nearest:
    """The closest approach of a motion to an obstacle.

    Attributes:
        time: s.
        distance: between the surfaces, m; not positive where they touch.
        points: on the arm and on the obstacle, (2, dim), m.
    """

    time: float
    distance: float
    points: FloatArray

    @property
    def label(self) -> str:
        """How close, and when."""
        apart = f"{1000.0 * self.distance:.1f} mm" if self.distance > 0.0 else "touches"
        return f"{apart} at {self.time:.3g} s"


def nearest_of(motion: Motion) -> Nearest | None:
    """The closest approach; None where no obstacle is within reach."""
    approach = motion.closest_approach
    if approach is None:
        return None
    robot, time = motion.criteria.robot, approach.time
    frames = robot.positions(ca.DM(motion.trajectory.at(np.array([time]))))
    named = [pair for pair in pairs_of(robot, motion.criteria.obstacles) if str(pair) == approach.pair]
    pair = min(named, key=lambda pair: pair.distance(frames, ca.DM(time)))  # balls of a link share its name
    middle, point = NEAREST[robot.dim](pair, [np.asarray(ca.DM(frame)).ravel() for frame in frames], time)
    way = point - middle
    share = float(pair.body.radius) / max(float(np.linalg.norm(way)), 1e-12)
    return Nearest(time, approach.distance, np.array([middle + min(share, 1.0) * way, point]))


def in_plane(pair: CollisionPair, frames: list[FloatArray], time: float) -> tuple[FloatArray, FloatArray]:
    """The nearest points of a body's middle line and of an obstacle's outline, each (2,), m."""
    start, end = (frames[number] for number in (pair.body.start, pair.body.end))
    corners = pair.obstacle.at(time).outline(OUTLINE_CORNERS)
    following = np.roll(corners, -1, axis=0)
    on_line = projected(corners, np.tile(start, (len(corners), 1)), np.tile(end, (len(corners), 1)))
    of_line = np.vstack([on_line, np.tile(start, (len(corners), 1)), np.tile(end, (len(corners), 1))])
    of_outline = np.vstack([corners, projected(start, corners, following), projected(end, corners, following)])
    row = int(np.square(of_line - of_outline).sum(axis=1).argmin())
    return of_line[row], of_outline[row]


def projected(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """The nearest points of segments (n, dim) to a point (dim,), or to one point each, (n, dim)."""
    way = end - start
    length = np.maximum(np.square(way).sum(axis=1), 1e-300)
    share = np.clip(((point - start) * way).sum(axis=1) / length, 0.0, 1.0)
    return np.asarray(start + share[:, None] * way)


def in_space(pair: CollisionPair, frames: list[FloatArray], time: float) -> tuple[FloatArray, FloatArray]:
    """The middle of a ball and the obstacle's point nearest to it, each (3,), m: where its distance falls fastest."""
    obstacle, center = pair.obstacle.at(time), frames[pair.body.start]
    around = center + STEP * np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
    distances = np.asarray(ca.DM(obstacle.point_clearance(ca.DM(around)))).ravel()
    return center, center - distances[0] * (distances[1:4] - distances[4:]) / (2.0 * STEP)


NEAREST = {2: in_plane, 3: in_space}  # by the robot's dimensions


DIAMOND: dict[str, Any] = {
    "marker": "D", "linestyle": "none", "color": ORANGE, "markeredgecolor": "0.1", "markeredgewidth": 0.6,
    "markersize": 5.0, "zorder": 6,
}  # fmt: skip


@dataclass(frozen=True)
class Points:
    """Positions (n, dim), m, and what they are called."""

    label: str
    places: FloatArray


def passed_by(motion: Motion) -> list[Points]:
    """Where the tool is at the motion's times of interest, each (1, dim), m."""
    return [
        Points(milestone.label, motion.joint_positions(np.array([milestone.time]))[:, -1])
        for milestone in motion.criteria.milestones(motion.trajectory)
    ]


def draw_passed(axes: Axes, passed: Sequence[Points]) -> None:
    """Draw such places in the plane."""
    for points in passed:
        axes.plot(*points.places.T, **DIAMOND)
