"""How far an arm is from obstacles over the time of a motion, and when it is closest to one that moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import casadi as ca
import numpy as np

from problems import Robot, Trajectory
from problems.base.matrix import FloatArray, as_array
from problems.certify.closest_approach import ClosestApproach, closest_approach
from problems.limits.distances.clearance import Clearance, CollisionPair, reachable_pairs
from problems.limits.distances.proximity import clearances
from problems.scene.obstacle import Obstacle

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
    return pair.number if pair.timed else 0


def closest_to_moving(robot: Robot, obstacles: Sequence[Obstacle], trajectory: Trajectory) -> ClosestApproach | None:
    """When a robot is closest to an obstacle that moves; None where nothing can touch one."""
    if not any(obstacle.moves for obstacle in obstacles):
        return None
    pairs = tuple(pair for pair in pairs_of(robot, obstacles) if pair.timed)
    return closest_approach(Clearance(robot, pairs), trajectory)


def description(approach: ClosestApproach) -> str:
    """How close to an obstacle that moves, and when, in two lines."""
    apart = f"{1000.0 * approach.distance:.1f} mm at {approach.time:.3g} s"
    return f"closest to a moving obstacle:\n{apart} ({approach.pair})"
