"""Starts of a move: straight lines from posture to posture, and detours.

Each start is a motion within the limits of speed, acceleration and jerk, through all places. By turns: between the
postures at the places between which the joints turn least; and between random ones, by way of a random posture.
Around obstacles a random one is the clearest of many.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, constant
from problems.limits.limit import Limit
from problems.motions.trajectory import Trajectory
from problems.nlp.starts.displacement import displacement_of
from problems.nlp.starts.waypoint_postures import WaypointPostures, excess
from problems.objectives import Objective
from problems.tasks.move import Move
from problems.timing.moving_ends import least_time_move

DRAWS = 64  # random postures at the places, of which the best become starts
DESCENTS = 8  # of them that are improved first
BEST_POSTURES = 2  # different ones that become starts
DETOUR = 0.3  # rad, of a random start's posture between two places
FARTHEST_DETOUR = 1.5  # rad, of one around obstacles
CANDIDATES = {
    False: 8,
    True: 64,
}  # of a random start, in free space and around obstacles; the clearest, shortest counts
RANDOM_STARTS = {False: 1, True: 4}  # between those of least displacement
PATH_STEPS = 24  # from each posture to the next, where a path is looked at
PASSING_SPEED = 0.5  # of what speed and acceleration allow on the shorter way, where a joint passes a posture


@dataclass(frozen=True)
class PassedMotion:
    """A motion, and when it passes its waypoints.

    Attributes:
        trajectory: the motion.
        times: of start, vias and goal, s.
    """

    trajectory: Trajectory
    times: FloatArray


@dataclass(frozen=True)
class MoveStarts:
    """Motions through the places of a move.

    Args:
        task: the statement.
        objective: what is minimised.
        limits: what holds.
    """

    task: Move
    objective: Objective
    limits: tuple[Limit, ...]

    @cached_property
    def postures(self) -> WaypointPostures:
        """The program of the postures at the places."""
        return WaypointPostures(self.task, displacement_of(self.objective), self.limits)

    def sequence(self, rng: np.random.Generator) -> Iterator[PassedMotion]:
        """An endless sequence of starts; the most promising come first."""
        around = bool(self.task.obstacles)
        if not around:
            yield from self.direct(rng)
        while True:
            for _ in range(RANDOM_STARTS[around]):
                yield self.random(rng)
            if around or not self.postures.given:
                yield from self.direct(rng)

    def direct(self, rng: np.random.Generator) -> Iterator[PassedMotion]:
        """Between postures of least displacement."""
        for theta in self.postures.best(rng, DRAWS, DESCENTS, BEST_POSTURES):
            yield self.along(theta)

    def random(self, rng: np.random.Generator) -> PassedMotion:
        """Between random postures, in each segment by way of a random one."""
        candidates = [self._detour(rng) for _ in range(CANDIDATES[bool(self.task.obstacles)])]
        theta = min(candidates, key=lambda theta: (float(self._excess(theta)), self.postures.value(theta)))
        motion = self.along(theta)
        return PassedMotion(motion.trajectory, motion.times[::2])

    def _detour(self, rng: np.random.Generator) -> FloatArray:
        """Random postures at the places and between them, (2 m - 1, k), rad."""
        theta = self.postures.draw(rng)
        farthest = np.log(FARTHEST_DETOUR if self.task.obstacles else DETOUR)
        middle = (theta[1:] + theta[:-1]) / 2.0
        middle += rng.normal(0.0, np.exp(rng.uniform(np.log(DETOUR), farthest)), middle.shape)
        ranges = self.task.robot.limits.position
        if ranges is not None:
            middle = np.clip(middle, *np.array(ranges).T)
        return np.concatenate([np.stack([theta[:-1], middle], axis=1).reshape(-1, theta.shape[1]), theta[-1:]])

    @cached_property
    def _excess(self) -> ca.Function:
        """By how much the straight lines between the postures of a random start break limits."""
        count, k = 2 * len(self.task.vias) + 3, self.task.robot.dof
        theta, shares = ca.SX.sym("theta", count, k), np.linspace(0.0, count - 1.0, (count - 1) * PATH_STEPS + 1)
        hats = np.maximum(0.0, 1.0 - np.abs(shares[:, None] - np.arange(count)))
        path = ca.mtimes(constant(hats), theta)
        return ca.Function("excess", [theta], [excess(self.task.robot, self.limits, path)])

    def along(self, theta: FloatArray) -> PassedMotion:
        """Through postures (m, k), as fast as possible from each to the next, none of them at rest that need not be."""
        velocities = self._velocities(theta)
        states = list(zip(theta, velocities, strict=True))
        parts = [
            least_time_move(first, last, before, after, self.task.robot.limits)
            for (first, before), (last, after) in pairwise(states)
        ]
        times = np.cumsum([0.0, *(part.duration for part in parts)])
        breakpoints = [part.breakpoints[1:] + begun for part, begun in zip(parts, times[:-1], strict=True)]
        coefficients = np.concatenate([part.coefficients for part in parts], axis=1)
        return PassedMotion(Trajectory(np.concatenate([[0.0], *breakpoints]), coefficients), times)

    def _velocities(self, theta: FloatArray) -> FloatArray:
        """At postures (m, k): in between those of a joint that does not turn back, rad/s."""
        ways, limits = np.diff(theta, axis=0), self.task.robot.limits
        shorter = np.minimum(np.abs(ways[1:]), np.abs(ways[:-1]))
        fastest = np.minimum(np.array(limits.speed), np.sqrt(shorter * np.array(limits.acceleration)))
        passed = np.where(ways[1:] * ways[:-1] > 0.0, PASSING_SPEED * np.sign(ways[1:]) * fastest, 0.0)
        start, goal = self.task.end_velocities
        return np.vstack([start, passed, goal])
