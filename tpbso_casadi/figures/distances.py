"""How far an arm is from obstacles over the time of a motion, and when it is closest to one that moves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import groupby

import casadi as ca
import numpy as np

from problems import Robot, Trajectory
from problems.base.matrix import FloatArray, as_array
from problems.limits.distances.clearance import CollisionPair, reachable_pairs
from problems.limits.distances.proximity import clearances
from problems.scene.obstacle import Obstacle

TIMES = 1001  # at least, equally many in each piece
REFINED = 101  # between two of them


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


@dataclass(frozen=True)
class Approach:
    """When an arm is closest to an obstacle that moves.

    Attributes:
        number: of the obstacle, 1, 2, ...
        time: s.
        distance: exact where the two do not meet, m; else negative.
    """

    number: int
    time: float
    distance: float

    def __str__(self) -> str:
        return f"closest: {1000.0 * self.distance:.1f} mm at {self.time:.3g} s"


def distance_curves(
    robot: Robot, obstacles: tuple[Obstacle, ...], trajectory: Trajectory, times: FloatArray
) -> list[DistanceCurve]:
    """How far a robot is from obstacles at times (n,) in s: from each that moves, from the nearest that stands."""
    frames, clock = robot.positions(ca.DM(trajectory.at(times))), ca.DM(times)

    def curve(number: int, pairs: list[CollisionPair]) -> DistanceCurve:
        growth = np.broadcast_to(as_array(ca.DM(pairs[0].growth(clock))).ravel(), times.shape)
        nearest = as_array(clearances(pairs, frames, clock)).min(axis=1)
        return DistanceCurve(number, times, nearest + growth, robot.margin + growth)

    return [curve(number, list(group)) for number, group in groupby(_pairs(robot, obstacles), _number)]


def _pairs(robot: Robot, obstacles: tuple[Obstacle, ...]) -> list[CollisionPair]:
    """Measured pairs, those of obstacles that stand before those of each that moves."""
    pairs = (replace(pair, measured=True) for pair in reachable_pairs(robot, obstacles, spare=np.inf))
    return sorted(pairs, key=_number)


def _number(pair: CollisionPair) -> int:
    return pair.number if pair.timed else 0


def closest_approach(robot: Robot, obstacles: tuple[Obstacle, ...], trajectory: Trajectory) -> Approach | None:
    """When a robot is closest to an obstacle that moves; None where nothing can touch one."""
    times = trajectory.times(TIMES)
    best = min(_approaches(robot, obstacles, trajectory, times), key=_distance, default=None)
    if best is None:
        return None
    place = int(np.searchsorted(times, best.time))
    between = np.linspace(times[max(place - 1, 0)], times[min(place + 1, len(times) - 1)], REFINED)
    best = min(best, *_approaches(robot, obstacles, trajectory, between), key=_distance)
    pairs = (pair for pair in _pairs(robot, obstacles) if pair.number == best.number)
    clock, frames = ca.DM(best.time), robot.positions(ca.DM(trajectory.at(np.array([best.time]))))
    exact = min(pair.distance(frames, clock) + float(pair.growth(clock)) for pair in pairs)
    return replace(best, distance=exact)


def _approaches(
    robot: Robot, obstacles: tuple[Obstacle, ...], trajectory: Trajectory, times: FloatArray
) -> Iterator[Approach]:
    """Of each obstacle that moves, the closest of times (n,)."""
    moving = tuple(obstacle for obstacle in obstacles if obstacle.moves)
    numbers = [number for number, obstacle in enumerate(obstacles, start=1) if obstacle.moves]
    for curve in distance_curves(robot, moving, trajectory, times):
        row = int(curve.distances.argmin())
        yield Approach(numbers[curve.number - 1], float(times[row]), float(curve.distances[row]))


def _distance(approach: Approach) -> float:
    return approach.distance
