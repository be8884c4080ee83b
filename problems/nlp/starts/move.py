"""Starts of a move: straight lines from posture to posture, and detours.

Each start is a motion within the limits of speed, acceleration and jerk, through all places. By turns: between the
postures at the places between which the joints turn least; and between random ones, by way of a random posture.
Around obstacles a random one is the clearest of many; where they move, of many that are run more or less slowly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, as_array, constant
from problems.limits.limit import Limit
from problems.motions.trajectory import Trajectory
from problems.nlp.starts.displacement import displacement_of
from problems.nlp.starts.waypoint_postures import WaypointPostures, excess
from problems.objectives import Objective
from problems.tasks.move import Move
from problems.timing.free_space.moving_ends import least_time_move
from problems.timing.rest_to_rest import least_durations

DRAWS = 64  # random postures at the places, of which the best become starts
DESCENTS = 8  # of them that are improved first
BEST_POSTURES = 2  # different ones that become starts
DETOURS = {
    False: 1,
    True: 2,
}  # random postures of a random start between two places, in free space and around obstacles
NEAREST_DETOUR = 0.3  # rad, of such a posture
FARTHEST_DETOUR = {False: 0.3, True: 2.0}  # rad
CANDIDATES = {False: 8, True: 512}  # for a random start; the clearest counts, of several clear ones the shortest
RANDOM_STARTS = {False: 1, True: 4}  # between those of least displacement
PATH_STEPS = 16  # from each posture to the next, where a path is looked at
SLOWEST = 4.0  # times longer than as fast as possible, a random start among obstacles that move
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
        if not self._around:
            yield from self.direct(rng)
        while True:
            for _ in range(RANDOM_STARTS[self._around]):
                yield self.random(rng)
            if self._around or not self.postures.given:
                yield from self.direct(rng)

    def direct(self, rng: np.random.Generator) -> Iterator[PassedMotion]:
        """Between postures of least displacement."""
        for theta in self.postures.best(rng, DRAWS, DESCENTS, BEST_POSTURES):
            yield self.along(theta)

    def random(self, rng: np.random.Generator) -> PassedMotion:
        """Between random postures, in each segment by way of random ones."""
        candidates = [self._detour(theta, rng) for theta in self.postures.draw(rng, CANDIDATES[self._around])]
        slower = self._slowdowns(rng, len(candidates))
        times = np.zeros((self._shares.size, len(candidates)))
        if self.task.is_timed:
            times = slower * np.stack([self._times(theta) for theta in candidates], axis=1)
        broken = as_array(self._excess.map(len(candidates))(np.hstack(candidates), times)).ravel()
        best = min(range(len(candidates)), key=lambda i: (broken[i], slower[i] * self.postures.value(candidates[i])))
        motion = self.along(candidates[best])
        times = slower[best] * motion.times[:: self._ways]
        return PassedMotion(motion.trajectory.time_scaled(slower[best]), times)

    def _slowdowns(self, rng: np.random.Generator, count: int) -> FloatArray:
        """How many times longer than as fast as possible so many random starts take, (count,)."""
        if not (self.task.is_timed and self.task.at_rest):
            return np.ones(count)
        return np.asarray(np.exp(rng.uniform(0.0, np.log(SLOWEST), count)))

    def _times(self, theta: FloatArray) -> FloatArray:
        """About when a motion through postures (m, k) is where its path is looked at, (n,), s."""
        durations = least_durations(np.abs(np.diff(theta, axis=0)), self.task.robot.limits).max(axis=1)
        passed = np.concatenate([[0.0], np.cumsum(durations)])
        return np.asarray(np.interp(self._shares, np.arange(passed.size), passed))

    @cached_property
    def _shares(self) -> FloatArray:
        """Where the path of a random start is looked at, from 0 to the number of its ways, (n,)."""
        ways = self._ways * (len(self.task.vias) + 1)
        return np.linspace(0.0, ways, ways * PATH_STEPS + 1)

    @property
    def _around(self) -> bool:
        """Whether there is something to go around."""
        return any(limit.order is None for limit in self.limits)

    @property
    def _ways(self) -> int:
        """From one place to the next, by way of random postures."""
        return DETOURS[self._around] + 1

    def _detour(self, theta: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Postures (m, k) at the places, and random ones between each and the next, (ways (m - 1) + 1, k), rad."""
        spread = np.exp(rng.uniform(*np.log([NEAREST_DETOUR, FARTHEST_DETOUR[self._around]])))
        shares = (np.arange(self._ways) / self._ways)[:, None]
        mixed = theta[:-1, None] + shares * (theta[1:] - theta[:-1])[:, None]
        mixed[:, 1:] += rng.normal(0.0, spread, mixed[:, 1:].shape)
        ranges = self.task.robot.limits.position
        if ranges is not None:
            mixed[:, 1:] = np.clip(mixed[:, 1:], *np.array(ranges).T)
        return np.concatenate([mixed.reshape(-1, theta.shape[1]), theta[-1:]])

    @cached_property
    def _excess(self) -> ca.Function:
        """By how much the straight lines between the postures of a random start break limits."""
        count = self._ways * (len(self.task.vias) + 1) + 1
        theta, times = ca.SX.sym("theta", count, self.task.robot.dof), ca.SX.sym("times", self._shares.size)
        path = ca.mtimes(constant(np.maximum(0.0, 1.0 - np.abs(self._shares[:, None] - np.arange(count)))), theta)
        return ca.Function("excess", [theta, times], [excess(self.task.robot, self.limits, path, times)])

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
