"""Postures at the waypoints of a move between which the joints turn least."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, as_array, repeated, total
from problems.encodings.waypoints import postures, variables
from problems.limits.limit import SAMPLING_MARGIN, Limit
from problems.motions.samples import Samples
from problems.nlp.program import MAX_ANGLE_CHANGE
from problems.nlp.starts.displacement import Displacement
from problems.nlp.starts.end_postures import OPTIONS, SAME_VALUE_TOLERANCE
from problems.robots.robot import Robot
from problems.tasks.elbow import narrow_elbow
from problems.tasks.move import Move
from problems.tasks.place import ANGLE_TOLERANCE, Place
from problems.timing.rest_to_rest import least_durations

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
        """What postures (m, k) cost: s, at rest at each of them; or rad."""
        return float(self._sizes(theta).sum())

    def _sizes(self, theta: FloatArray) -> FloatArray:
        """What each way costs, (m - 1, 1), or each joint's, (m - 1, k)."""
        ways = np.abs(np.diff(theta, axis=0))
        if not self.displacement.longest:
            return np.asarray(ways)
        return np.asarray(least_durations(ways, self.task.robot.limits).max(axis=1, keepdims=True))

    @cached_property
    def _postures(self) -> ca.Function:
        """Of the variables that a search has for them."""
        x = ca.SX.sym("x", len(variables(self.task)))
        return ca.Function("postures", [x], [ca.vertcat(*postures(self.task, x))])

    @cached_property
    def _excess(self) -> ca.Function:
        theta = ca.SX.sym("theta", len(self.task.vias) + 2, self.task.robot.dof)
        always = [kept for limit in self.limits if (kept := limit.untimed) is not None]
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
                narrow_elbow(task.elbow, x, len(places) + row, lower, upper, task.robot.stretched)
        solve = self._program(places)
        ways = 2 * theta[1:].size * len(self._allowed(ca.SX(sizes)))
        upper_rows = np.repeat([0.0, np.inf], [solve.size1_in("lbg") - ways, ways])
        solution = solve(x0=x, lbx=lower, ubx=upper, lbg=0.0, ubg=upper_rows)
        if not solve.stats()["success"]:
            return None
        return as_array(solution["x"]).ravel()[: theta.size].reshape(theta.shape, order="F")

    def _program(self, places: list[Place]) -> ca.Function:
        """For a goal, made once."""
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
    """By how much postures (m, k) in rad break limits, without regard to how they move; of many units, 0 if not.

    Args:
        robot: that takes them.
        limits: to keep.
        theta: the postures.
        times: when, (m, 1), s; None where that is not known: what moves by itself is then left out.
    """
    given = limits if times is not None else (limit.untimed for limit in limits)
    of_postures = [limit for limit in given if limit is not None]
    rest = ca.DM.zeros(*theta.shape)
    at_rest = Samples(robot=robot, derivatives=(theta, rest, rest, rest), duration=ca.DM(1.0), times=times)
    return ca.sum1(
        ca.vertcat(0.0, *(total(row.excess()) for limit in of_postures for row in limit.at(at_rest, SAMPLING_MARGIN)))
    )
