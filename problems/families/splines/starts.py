"""Structured starts of the program: postures on the way and how they are passed.

Each start is a motion within the limits of speed, acceleration and jerk, through all places. By turns: between the
postures at the places between which the joints turn least; and between random ones, by way of a random posture.
Around obstacles a random one is the clearest of many; where they move, of many that are run more or less slowly.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, as_array, constant, repeated, total
from problems.families.splines.encoding import postures, variables
from problems.families.two_segments import OPTIONS, SAME_VALUE_TOLERANCE
from problems.limits import SAMPLING_MARGIN, Limit
from problems.motions import Samples, Trajectory
from problems.objectives import Objective
from problems.programs import MAX_ANGLE_CHANGE, Displacement, displacement_of
from problems.robots import Robot
from problems.tasks import ANGLE_TOLERANCE, Move, Place, narrow_elbow
from problems.timing import least_durations, least_time_move

OVERSAMPLING = 4  # random postures, of which one breaks limits least


@dataclass(frozen=True)
class WaypointPostures:
    """The program of the postures at start, vias and one of the goals.

    Args:
        task: whose places.
        displacement: how the joints' turns count.
        limits: of which those on postures, whenever they are taken, count too where postures are drawn.
    """

    task: Move
    displacement: Displacement
    limits: tuple[Limit, ...]
    _programs: dict[Place, ca.Function] = field(default_factory=dict, init=False)

    @property
    def given(self) -> bool:
        """Whether nothing is to be chosen."""
        return not variables(self.task)

    def value(self, theta: FloatArray) -> float:
        """The cost of passing postures (m, k): s, at rest at each of them; or rad."""
        return float(self._sizes(theta).sum())

    def _sizes(self, theta: FloatArray) -> FloatArray:
        """The cost of each way, (m - 1, 1), or of each joint's, (m - 1, k)."""
        ways = np.abs(np.diff(theta, axis=0))
        if not self.displacement.longest:
            return np.asarray(ways)
        return np.asarray(least_durations(ways, self.task.robot.limits).max(axis=1, keepdims=True))

    @cached_property
    def _postures(self) -> ca.Function:
        """The postures as a function of the variables that a search has for them."""
        x = ca.SX.sym("x", len(variables(self.task)))
        return ca.Function("postures", [x], [ca.vertcat(*postures(self.task, x))])

    @cached_property
    def _excess(self) -> ca.Function:
        theta = ca.SX.sym("theta", len(self.task.vias) + 2, self.task.robot.dof)
        always = [kept for limit in self.limits if (kept := limit.time_independent_part) is not None]
        return ca.Function("excess", [theta], [excess(self.task.robot, always, theta)])

    def draw(self, rng: np.random.Generator, count: int) -> list[FloatArray]:
        """Random postures, ``count`` times (m, k) in rad, each in the turn nearest to the one before.

        More are drawn: those that break limits least count.
        """
        if self.given:
            return [as_array(self._postures(ca.DM(0, 1)))] * count
        lower, upper = ([getattr(v, bound) for v in variables(self.task)] for bound in ("lower", "upper"))
        drawn = rng.uniform(lower, upper, (OVERSAMPLING * count, len(lower)))
        theta = self._postures.map(len(drawn))(drawn.T)
        order = np.argsort(as_array(self._excess.map(len(drawn))(theta)).ravel(), kind="stable")
        each = as_array(theta).reshape(theta.shape[0], len(drawn), -1)
        return [each[:, i] for i in order[:count]]

    def best(self, rng: np.random.Generator, draws: int, descents: int, count: int) -> list[FloatArray]:
        """The best ``count`` different ones, the best first; maybe none.

        Args:
            rng: of the draws.
            draws: how many random postures are looked at.
            descents: how many of them, the best, are improved.
            count: how many at the most.
        """
        if self.given:
            return self.draw(rng, 1)
        drawn = sorted(self.draw(rng, draws), key=self.value)
        solved = [theta for theta in map(self.descend, drawn[:descents]) if theta is not None]
        distinct: list[FloatArray] = []
        for theta in sorted(solved, key=self.value):
            value = self.value(theta)
            if all(abs(value - self.value(other)) > SAME_VALUE_TOLERANCE * value for other in distinct):
                distinct.append(theta)
        return distinct[:count]

    def descend(self, theta: FloatArray) -> FloatArray | None:
        """The nearest postures (m, k) that cost least, with the goal that they miss least; None where there are none.

        The program is over the postures and what each way costs; its rows are misses, which are zero, and what is left
        of ways, which is not negative.
        """
        task, sizes = self.task, self._sizes(theta)
        places = [task.start, *task.vias, task.reached_goal(theta[-1])]
        x = np.concatenate([theta.ravel(order="F"), sizes.ravel(order="F")])
        lower, upper = x - MAX_ANGLE_CHANGE, x + MAX_ANGLE_CHANGE
        lower[theta.size :], upper[theta.size :] = 0.0, np.inf
        if task.robot.limits.position is not None:
            ranges = np.repeat(np.array(task.robot.limits.position), len(places), axis=0)
            lower[: theta.size], upper[: theta.size] = ranges.T
        for row, place in enumerate(places):
            if place.chosen_by_inverse_kinematics:
                narrow_elbow(task.robot, task.elbow, x, len(places) + row, lower, upper)
        solve = self._program(places)
        ways = 2 * theta[1:].size * len(self._allowed(ca.SX(sizes)))
        upper_rows = np.repeat([0.0, np.inf], [solve.size1_in("lbg") - ways, ways])
        solution = solve(x0=x, lbx=lower, ubx=upper, lbg=0.0, ubg=upper_rows)
        if not solve.stats()["success"]:
            return None
        return as_array(solution["x"]).ravel()[: theta.size].reshape(theta.shape, order="F")

    def _program(self, places: list[Place]) -> ca.Function:
        """The program for a goal, made once."""
        if places[-1] not in self._programs:
            theta = ca.SX.sym("theta", len(places), self.task.robot.dof)
            sizes = ca.SX.sym("size", *self._sizes(np.zeros(theta.shape)).shape)
            misses = [
                ca.vec(place.miss(self.task.robot, theta[row, :])) * ANGLE_TOLERANCE / place.tolerance(self.task.robot)
                for row, place in enumerate(places)
            ]
            way = theta[1:, :] - theta[:-1, :]
            left = [ca.vec(allowed - sign * way) for allowed in self._allowed(sizes) for sign in (1.0, -1.0)]
            nlp = {"x": ca.veccat(theta, sizes), "f": total(sizes), "g": ca.vertcat(*misses, *left)}
            self._programs[places[-1]] = ca.nlpsol("waypoints", "ipopt", nlp, OPTIONS)
        return self._programs[places[-1]]

    def _allowed(self, sizes: ca.SX) -> list[ca.SX]:
        """Bounds of each joint's ways: at full speed, acceleration or jerk in the time that a way takes; or sizes."""
        if not self.displacement.longest:
            return [sizes]
        limits, time = self.task.robot.limits, ca.repmat(sizes, 1, self.task.robot.dof)
        rows = sizes.shape[0]
        ways = [repeated(limits.speed, rows) * time, repeated(limits.acceleration, rows) * time**2 / 4.0]
        return ways if limits.jerk is None else [*ways, repeated(limits.jerk, rows) * time**3 / 32.0]


def excess(robot: Robot, limits: Iterable[Limit], theta: Matrix, times: Matrix | None = None) -> Matrix:
    """The excess of postures (m, k) in rad over limits, without regard to how they move; of many units, 0 if none.

    Args:
        robot: that takes them.
        limits: to keep.
        theta: the postures.
        times: when, (m, 1), s; None where that is not known: what moves by itself is then left out.
    """
    given = limits if times is not None else (limit.time_independent_part for limit in limits)
    of_postures = [limit for limit in given if limit is not None]
    rest = ca.DM.zeros(*theta.shape)
    at_rest = Samples(robot=robot, derivatives=(theta, rest, rest, rest), duration=ca.DM(1.0), times=times)
    return ca.sum1(
        ca.vertcat(
            0.0,
            *(total(row.excess()) for limit in of_postures for row in limit.constraints_at(at_rest, SAMPLING_MARGIN)),
        )
    )


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
        """Sample parameters on the path of a random start, from 0 to the number of its ways, (n,)."""
        ways = self._ways * (len(self.task.vias) + 1)
        return np.linspace(0.0, ways, ways * PATH_STEPS + 1)

    @property
    def _around(self) -> bool:
        """Whether there is something to go around."""
        return any(limit.order is None for limit in self.limits)

    @property
    def _ways(self) -> int:
        """The number of ways from one place to the next, by random postures."""
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
        """The excess over limits of the straight lines between the postures of a random start."""
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
        """Velocities at postures (m, k), rad/s: not zero in between where a joint does not turn back."""
        ways, limits = np.diff(theta, axis=0), self.task.robot.limits
        shorter = np.minimum(np.abs(ways[1:]), np.abs(ways[:-1]))
        fastest = np.minimum(np.array(limits.speed), np.sqrt(shorter * np.array(limits.acceleration)))
        passed = np.where(ways[1:] * ways[:-1] > 0.0, PASSING_SPEED * np.sign(ways[1:]) * fastest, 0.0)
        start, goal = self.task.end_velocities
        return np.vstack([start, passed, goal])
