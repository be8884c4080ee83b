"""Where exactly an arm is closest to an obstacle: the two points between which the distance is."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.limits.distances.clearance import CollisionPair
from tpbso_casadi.figures.distances import pairs_of
from tpbso_casadi.planning.motion import Motion

CORNERS = 4096  # of an outline that is curved
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
    corners = pair.obstacle.at(time).outline(CORNERS)
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
