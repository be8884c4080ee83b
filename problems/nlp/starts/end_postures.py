"""End postures between which the joints turn least.

Without obstacles only its end postures couple the joints of a point-to-point motion. What remains is
a small program: postures at start and goal, with the tip on its points, that minimise the time of the slowest joint
or the sum of all displacements. Its solutions are not unique but few, and random postures lead to them quickly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, as_array, repeated, total
from problems.nlp.program import MAX_ANGLE_CHANGE
from problems.nlp.starts.displacement import Displacement
from problems.nlp.starts.postures import Postures
from problems.nlp.starts.profiles import Profile
from problems.robots.robot import Robot
from problems.tasks.elbow import Elbow, narrow_elbow

OPTIONS: dict[str, Any] = {
    "print_time": False,
    "calc_lam_p": False,
    "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-7, "max_iter": 100},
}
SAME_VALUE_TOLERANCE = 1e-3  # relative: solutions that are closer than that in value count as one


@dataclass(frozen=True)
class Ends:
    """End postures.

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
    def postures(self) -> Postures:
        """The postures at start and goal."""
        return Postures(self.robot, [self.start, self.goal])

    @cached_property
    def _solve(self) -> ca.Function:
        """Over theta_s, theta_f, and T (s) or the ways (k) of the joints; rows in the order of ``_row_bounds``."""
        k = self.robot.dof
        theta_s, theta_f, size = ca.SX.sym("s", k), ca.SX.sym("f", k), ca.SX.sym("z", self._sizes)
        tips = [self.robot.tool(theta.T).T / self.robot.length_unit for theta in (theta_s, theta_f)]
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
        theta_s, theta_f = self.postures.at_shares(rng.random((2, self.robot.redundancy)), elbow)
        theta_f = as_array(self.robot.wrap_near(ca.DM(theta_f).T, ca.DM(theta_s).T)).ravel()
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
            narrow_elbow(self.elbow, x, first + 1, lower, upper, self.robot.stretched)
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
