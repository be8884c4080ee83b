"""Structured starts of the program: postures at both ends, and profiles between them.

A profile is a point-to-point motion of one joint through 1 rad in 1 s. Limits scale: a way D takes
max(peak speed x D / v, sqrt(peak acceleration x D / a)). For a given share t1 / T least peaks are a linear program;
these are its solutions at the shares where descents, from one share or another, ended best.

Without obstacles only its end postures couple the joints of a point-to-point motion. What remains is
a small program: postures at start and goal, with the tip on its points, that minimise the time of the slowest joint
or the sum of all displacements. Its solutions are not unique but few, and random postures lead to them quickly.

By turns: a few motions between the end postures of least displacement, along the profiles that get there soonest; and
motions between random postures through a random one. Without obstacles the first are all but the solution. Around
obstacles a random one is the clearest of many.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from problems.base import FloatArray, as_array, repeated, total
from problems.families.two_segments.motion import QUARTIC, QUINTIC, Quantities
from problems.objectives import Objective
from problems.programs import MAX_ANGLE_CHANGE, Displacement, PointPostures, displacement_of
from problems.robots import Robot
from problems.tasks import Elbow, PointToPoint, narrow_elbow


@dataclass(frozen=True)
class Profile:
    """A motion through 1 rad in 1 s.

    Attributes:
        middle: theta_m - theta_s, rad.
        speed: dtheta_m, rad/s.
        share: t1 / T.
    """

    middle: float
    speed: float
    share: float

    @cached_property
    def peaks(self) -> tuple[float, float]:
        """Largest speed in rad/s and acceleration in rad/s^2, over all t."""
        t1, t2 = self.share, 1.0 - self.share
        bend = (6.0 * self.speed * t1 - 12.0 * self.middle) / t1**2  # ddtheta_m of (5)
        data = (
            np.array([0.0, self.middle, self.speed * t1]),
            np.array([self.middle, 1.0 - self.middle, self.speed * t2, bend * t2**2]),
        )
        pieces = [matrix @ part for matrix, part in zip((QUARTIC, QUINTIC), data, strict=True)]
        speed, acceleration = (
            max(_peak(piece, n) / t**n for piece, t in zip(pieces, (t1, t2), strict=True)) for n in (1, 2)
        )
        return speed, acceleration

    def duration(self, way: FloatArray, speed: FloatArray, acceleration: FloatArray, shortest: float) -> float:
        """The least T in s in which every joint keeps its limits.

        Args:
            way: displacements (k,), rad.
            speed: limits (k,), rad/s.
            acceleration: limits (k,), rad/s^2.
            shortest: of t1 and t2, s.
        """
        fastest, sharpest = self.peaks
        least = np.maximum(fastest * np.abs(way) / speed, np.sqrt(sharpest * np.abs(way) / acceleration))
        return max(float(least.max()), shortest / min(self.share, 1.0 - self.share))


def _peak(coefficients: FloatArray, derivative: int) -> float:
    """The largest absolute value in [0, 1] of a derivative of a polynomial, lowest power first."""
    curve = np.polynomial.Polynomial(coefficients).deriv(derivative)
    turns = curve.deriv().roots()
    inside = turns[(np.abs(turns.imag) < 1e-9) & (turns.real > 0.0) & (turns.real < 1.0)].real
    return float(np.abs(curve(np.concatenate([[0.0, 1.0], inside]))).max())


SKEWED = Profile(0.7208, 1.6776, 0.635)  # least acceleration
SYMMETRIC = Profile(0.5, 1.5, 0.5)
EARLY = Profile(0.3484, 1.5377, 0.4053)  # where speed and acceleration bind
EARLIEST = Profile(0.2274, 1.4639, 0.2732)  # where speed binds
PROFILES = (SKEWED, SYMMETRIC, EARLY, EARLIEST)


OPTIONS: dict[str, Any] = {
    "print_time": False,
    "calc_lam_p": False,
    "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-7, "max_iter": 100},
}
SAME_VALUE_TOLERANCE = 1e-3  # relative: solutions that are closer than that in value count as one


@dataclass(frozen=True)
class Ends:
    """The postures at both ends.

    Attributes:
        theta_s: at the start, (k,), rad.
        theta_f: at the goal, (k,), rad.
        value: s or rad: the time of the slowest joint, or the sum of all ways.
    """

    theta_s: FloatArray
    theta_f: FloatArray
    value: float


@dataclass(frozen=True)
class EndPostures:
    """The program of the end postures.

    Args:
        robot: whose.
        start: of the tip, m.
        goal: of the tip, m.
        elbow: at both ends.
        displacement: what counts.
        profile: by which a joint's way takes time.
    """

    robot: Robot
    start: tuple[float, ...]
    goal: tuple[float, ...]
    elbow: Elbow
    displacement: Displacement
    profile: Profile

    @cached_property
    def postures(self) -> PointPostures:
        """The postures at start and goal."""
        return PointPostures(self.robot, [self.start, self.goal])

    @cached_property
    def _solve(self) -> ca.Function:
        """Over theta_s, theta_f, and T (s) or the ways (k) of the joints; rows in the order of ``_row_bounds``."""
        k = self.robot.dof
        theta_s, theta_f, size = ca.SX.sym("s", k), ca.SX.sym("f", k), ca.SX.sym("z", self._sizes)
        tips = [self.robot.tool.position(theta.T).T / self.robot.length_unit for theta in (theta_s, theta_f)]
        way = theta_f - theta_s
        ways = [allowed - sign * way for allowed in self._allowed(size) for sign in (1.0, -1.0)]
        nlp = {"x": ca.vertcat(theta_s, theta_f, size), "f": total(size), "g": ca.vertcat(*tips, *ways)}
        return ca.nlpsol("ends", "ipopt", nlp, OPTIONS)

    @property
    def _sizes(self) -> int:
        return 1 if self.displacement.longest else self.robot.dof

    def _allowed(self, size: ca.SX) -> list[ca.SX]:
        """Bounds of displacements: what a time ``size`` allows at full speed and acceleration, or ``size`` itself."""
        if not self.displacement.longest:
            return [size]
        speed, acceleration = (
            repeated(limit, 1).T for limit in (self.robot.limits.speed, self.robot.limits.acceleration)
        )
        fastest, sharpest = self.profile.peaks
        return [speed * size / fastest, acceleration * size**2 / sharpest]

    def value(self, way: FloatArray) -> float:
        """The value of displacements (k,) in rad: s or rad."""
        if not self.displacement.longest:
            return float(np.abs(way).sum())
        return self.profile.duration(
            way, np.array(self.robot.limits.speed), np.array(self.robot.limits.acceleration), 0.0
        )

    def draw(self, rng: np.random.Generator) -> Ends:
        """Random postures that the elbow allows, the goal's in the turn nearest to the start's."""
        fixed = {"up": 1.0, "down": -1.0}.get(self.elbow)
        elbow = rng.choice([-1.0, 1.0], 2) if fixed is None else np.full(2, fixed)
        theta_s, theta_f = self.postures.at_shares(rng.random((2, self.robot.closed_form.redundancy)), elbow)
        theta_f = as_array(self.robot.closed_form.wrap_near(ca.DM(theta_f).T, ca.DM(theta_s).T)).ravel()
        return Ends(theta_s, theta_f, self.value(theta_f - theta_s))

    def descend(self, ends: Ends) -> Ends | None:
        """The nearest solution of the program; None where IPOPT finds none."""
        k = self.robot.dof
        x = np.concatenate([ends.theta_s, ends.theta_f, self._first_sizes(ends)])
        lower, upper = x - MAX_ANGLE_CHANGE, x + MAX_ANGLE_CHANGE
        lower[2 * k :], upper[2 * k :] = 0.0, np.inf
        for first in (0, k):
            if self.robot.limits.position is not None:
                lower[first : first + k], upper[first : first + k] = np.array(self.robot.limits.position).T
            narrow_elbow(self.robot, self.elbow, x, first + 1, lower, upper)
        on_points = np.array([*self.start, *self.goal]) / self.robot.length_unit
        rows = self._solve.size1_in("lbg") - on_points.size
        solution = self._solve(
            x0=x,
            lbx=lower,
            ubx=upper,
            lbg=np.append(on_points, np.zeros(rows)),
            ubg=np.append(on_points, np.full(rows, np.inf)),
        )
        if not self._solve.stats()["success"]:
            return None
        theta_s, theta_f = np.split(as_array(solution["x"]).ravel()[: 2 * k], 2)
        return Ends(theta_s, theta_f, self.value(theta_f - theta_s))

    def _first_sizes(self, ends: Ends) -> FloatArray:
        return np.array([ends.value]) if self.displacement.longest else np.abs(ends.theta_f - ends.theta_s)

    def best(self, rng: np.random.Generator, draws: int, count: int) -> list[Ends]:
        """The best ``count`` different solutions from so many random postures, the best first; maybe none."""
        solved = [ends for ends in (self.descend(self.draw(rng)) for _ in range(draws)) if ends is not None]
        distinct: list[Ends] = []
        for ends in sorted(solved, key=lambda each: each.value):
            if all(abs(ends.value - other.value) > SAME_VALUE_TOLERANCE * other.value for other in distinct):
                distinct.append(ends)
        return distinct[:count]


END_POSTURE_DRAWS = 8  # random end postures from which the program of least displacement descends
BEST_END_POSTURES = 2  # of its solutions that become starts
TIMED_PROFILES = 2  # profiles tried between the same ends, where time counts
GOAL_DRAWS = 8  # a random start takes the goal posture nearest to its start posture among so many
MIDDLE_SPREAD = 0.3  # rad, of theta_m around the middle of a random start's ends
MOTIONS_PER_CLEAR_START = 24  # around obstacles: random motions, of which the clearest is a start
CLEAR_STARTS = 4  # consecutive starts of this kind
CLEAR_MIDDLE_SPREAD = 0.8  # rad, the same for these motions


@dataclass(frozen=True)
class PointToPointStarts:
    """Motions that meet start and goal.

    Args:
        task: the statement: robot, start, goal, obstacles.
        objective: what is minimised.
    """

    task: PointToPoint
    objective: Objective

    @property
    def displacement(self) -> Displacement:
        """How the joints' displacements count."""
        return displacement_of(self.objective)

    @cached_property
    def ends(self) -> EndPostures:
        """The program of the end postures."""
        task = self.task
        return EndPostures(task.robot, task.start, task.goal, task.elbow, self.displacement, SKEWED)

    def sequence(self, rng: np.random.Generator, violation: Callable[[Quantities], float]) -> Iterator[Quantities]:
        """An endless sequence of starts; the most promising come first.

        Args:
            rng: source of the random starts.
            violation: by how much a motion breaks the limits.
        """
        while True:
            if not self.task.crowded:
                yield from self.direct(rng)
                yield self.random(rng, MIDDLE_SPREAD)
                continue
            for _ in range(CLEAR_STARTS):
                many = [self.random(rng, CLEAR_MIDDLE_SPREAD) for _ in range(MOTIONS_PER_CLEAR_START)]
                yield min(many, key=violation)
            yield from self.direct(rng)

    def direct(self, rng: np.random.Generator) -> Iterator[Quantities]:
        """Starts between end postures of least displacement."""
        for ends in self.ends.best(rng, END_POSTURE_DRAWS, BEST_END_POSTURES):
            yield from (self.along(ends, profile) for profile in self.profiles(ends))

    def profiles(self, ends: Ends) -> list[Profile]:
        """The profiles that join the ends soonest; a symmetric one where time does not count."""
        if not self.displacement.longest:
            return [SYMMETRIC]
        return sorted(PROFILES, key=lambda profile: self._rank(ends, profile))[:TIMED_PROFILES]

    def _rank(self, ends: Ends, profile: Profile) -> tuple[float, float]:
        """The rank of a profile: by how much its longer segment takes too long, and the duration, s."""
        duration, bounds = self._duration(ends, profile), self.task.duration_bounds
        longest = np.inf if bounds is None else bounds.longest
        return max(0.0, max(profile.share, 1.0 - profile.share) * duration - longest), duration

    def _duration(self, ends: Ends, profile: Profile) -> float:
        limits, shortest = self.task.robot.limits, self.task.time_box[0]
        return profile.duration(
            ends.theta_f - ends.theta_s, np.array(limits.speed), np.array(limits.acceleration), shortest
        )

    def along(self, ends: Ends, profile: Profile) -> Quantities:
        """All joints along the same profile, as fast as they can."""
        way, duration = ends.theta_f - ends.theta_s, self._duration(ends, profile)
        middle, speed = ends.theta_s + profile.middle * way, profile.speed * way / duration
        t1 = profile.share * duration
        return quantities(ends.theta_s, middle, speed, ends.theta_f, t1, duration - t1)

    def random(self, rng: np.random.Generator, spread: float) -> Quantities:
        """Postures by inverse kinematics at both ends, theta_m within ``spread`` rad of their middle.

        t1 = t2 = 1 s, or as near to that as the task allows.
        """
        draws = [self.ends.draw(rng) for _ in range(GOAL_DRAWS)]
        ends = min(draws, key=lambda each: float(np.linalg.norm(each.theta_f - each.theta_s)))
        middle = (ends.theta_s + ends.theta_f) / 2.0 + rng.normal(0.0, spread, ends.theta_s.size)
        time = float(np.clip(1.0, *self.task.time_box))
        speed = 0.75 * (ends.theta_f - ends.theta_s) / time
        return quantities(ends.theta_s, middle, speed, ends.theta_f, time, time)


def quantities(
    theta_s: FloatArray, theta_m: FloatArray, dtheta_m: FloatArray, theta_f: FloatArray, t1: float, t2: float
) -> Quantities:
    """The quantities of numbers: angles and speeds (k,), rad and rad/s; times, s."""
    first, middle, speed, last = (ca.DM(angles).T for angles in (theta_s, theta_m, dtheta_m, theta_f))
    return Quantities(first, middle, speed, last, ca.DM(t1), ca.DM(t2))
