"""The nonlinear program of a point-to-point motion.

Variables: theta_s, theta_m, dtheta_m, theta_f, and t1 and t2 where time matters. The end postures are tied to start
and goal by forward kinematics, smooth where inverse kinematics has edges. Rotation and length do not depend on how
long a motion takes: its duration is then 1, t1 the only time, no speed or acceleration is bounded, and the exact time
scaling of a solution restores the limits. ``elbow`` up or down bounds theta_2 at both ends.

A search vector's box does not apply here: theta_m and dtheta_m may leave it, and so may t1 and t2 at their long end.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property

import casadi as ca
import numpy as np

from problems.assembly.point_to_point import SHARE, PointToPoint, Quantities
from problems.base.matrix import FloatArray, Matrix, as_array, split, total
from problems.limits.constraint import Constraint
from problems.limits.motion_limits import motion_constraints, step_limit
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.nlp.program import NonlinearProgram, equality, rotation_rows, smooth_length
from problems.robots.redundancy import restore
from problems.tasks.checks import narrow_elbow

ROTATION_SAMPLES = 12  # time steps a segment: the sum of increments is exact up to a turn between two samples
LENGTH_SAMPLES = 16
GOAL_DRAWS = 8  # a start takes the goal posture nearest to its start posture among so many
SPREAD = 0.3  # rad, of theta_m around the middle of a start's ends
TIMELESS = ("speed", "acceleration")


@dataclass(frozen=True)
class PointToPointNlp(NonlinearProgram):
    """Move the tip from rest at the start to rest at the goal.

    Args:
        problem: whose task, limits and obstacles hold.
    """

    problem: PointToPoint

    @property
    def timed(self) -> bool:
        """Whether t1 and t2 are variables."""
        return self.problem.objective == "time"

    @property
    def samples(self) -> int:
        """Time steps a segment."""
        steps = {"time": self.problem.samples, "rotation": ROTATION_SAMPLES, "length": LENGTH_SAMPLES}
        least = LENGTH_SAMPLES if self.problem.obstacles else 0
        return max(steps[self.problem.objective], least)

    @cached_property
    def _symbols(self) -> tuple[ca.SX, Quantities, Samples, ca.SX]:
        """Variables of the motion, the same as quantities, its samples, slacks of the rotation."""
        x = ca.SX.sym("x", 4 * self.problem.arm.links + (2 if self.timed else 1))
        quantities = self._quantities(x)
        rows = 2 * self.samples if self.problem.objective == "rotation" else 0
        return x, quantities, quantities.sampled(self.samples), ca.SX.sym("slack", rows, self.problem.arm.links)

    @property
    def x(self) -> ca.SX:
        """theta_s, theta_m, dtheta_m, theta_f, then t1 and t2 or t1 alone, then slacks of the rotation."""
        motion, _, _, slack = self._symbols
        return ca.vertcat(motion, ca.vec(slack))

    @property
    def names(self) -> tuple[str, ...]:
        """As in the paper; ``t1/T`` where the duration is 1."""
        joints = range(1, self.problem.arm.links + 1)
        own = [f"{symbol}[{i}]" for symbol in ("theta_s", "theta_m", "dtheta_m", "theta_f") for i in joints]
        slacks = self.x.shape[0] - self._symbols[0].shape[0]
        return (*own, *(("t1", "t2") if self.timed else ("t1/T",)), *(f"slack[{i}]" for i in range(1, slacks + 1)))

    @cached_property
    def f(self) -> Matrix:
        """The objective: time, the sum of the slacks, or the smoothed length."""
        _, _, samples, slack = self._symbols
        if self.problem.objective == "length":
            return smooth_length(self.problem.arm, samples)
        return samples.duration if self.timed else total(slack)

    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        """Both ends, the limits that time scaling does not restore, obstacles, slacks."""
        _, quantities, samples, slack = self._symbols
        arm, task = self.problem.arm, self.problem
        ends = [
            ("start", "theta_s", quantities.theta_s, task.start),
            ("goal", "theta_f", quantities.theta_f, task.goal),
        ]
        rows = [
            equality(
                f"tip at the {name}", arm.tip(theta) - ca.DM(list(point)).T, "m", ("x", "y"), f"tip({symbol}) = {name}"
            )
            for name, symbol, theta, point in ends
        ]
        limits = motion_constraints(arm, task.obstacles, samples, margin)
        rows += [limit for limit in limits if self.timed or limit.name not in TIMELESS]
        if task.obstacles:
            rows.append(step_limit(arm, task.obstacles, samples))
        if self.problem.objective == "rotation":
            rows += rotation_rows(arm, samples, slack)
        return tuple(rows)

    def _quantities(self, x: Matrix) -> Quantities:
        k = self.problem.arm.links
        theta_s, theta_m, dtheta_m, theta_f, times = split(x, [k, k, k, k, 2 if self.timed else 1])
        t1, t2 = (times[0], times[1]) if self.timed else (times[0], 1.0 - times[0])
        return Quantities(theta_s.T, theta_m.T, dtheta_m.T, theta_f.T, t1, t2)

    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elbow and joint limits on the angles, the least times; the rest is free."""
        k, size = self.problem.arm.links, self.x.shape[0]
        lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
        blocks = {"theta_s": 0, "theta_m": k, "theta_f": 3 * k}
        for name, first in blocks.items():
            if self.problem.arm.joint_limits is not None:
                lower[first : first + k], upper[first : first + k] = np.array(self.problem.arm.joint_limits).T
            if name != "theta_m":
                narrow_elbow(self.problem.elbow, x, first + 1, lower, upper)
        times = slice(4 * k, 4 * k + (2 if self.timed else 1))
        lower[times], upper[times] = (self.problem.segment_time[0], np.inf) if self.timed else SHARE
        lower[times.stop :] = 0.0
        return lower, upper

    def from_search(self, x: FloatArray) -> FloatArray:
        """The arm's own quantities of a search vector."""
        return self._variables(self.problem.quantities_of(x))

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """Postures at the breakpoints, the speed in the middle, t1 and t2."""
        at = trajectory.samples(trajectory.breakpoints)
        t1, t2 = (ca.DM(float(t)) for t in np.diff(trajectory.breakpoints))
        return self._variables(Quantities(at.theta[0, :], at.theta[1, :], at.speed[1, :], at.theta[2, :], t1, t2))

    def _variables(self, quantities: Quantities) -> FloatArray:
        if not self.timed:
            quantities = quantities.time_scaled(1.0 / (quantities.t1 + quantities.t2))
        parts = [getattr(quantities, field.name) for field in fields(Quantities)]
        x = np.concatenate([as_array(part).ravel() for part in (parts if self.timed else parts[:-1])])
        if self.problem.objective != "rotation":
            return x
        theta = as_array(quantities.sampled(self.samples).theta)
        return np.append(x, np.abs(np.diff(theta, axis=0)).ravel(order="F"))

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        """Postures by inverse kinematics at both ends, theta_m near their middle, t1 = t2 = 1 s."""
        fixed = {"up": 1.0, "down": -1.0}.get(self.problem.elbow)
        while True:
            elbow = fixed if fixed is not None else float(rng.choice([-1.0, 1.0]))
            theta_s = self.problem.arm.wrap(self._posture(rng, self.problem.start, elbow))
            drawn = [self._posture(rng, self.problem.goal, elbow) for _ in range(GOAL_DRAWS)]
            goals = [self.problem.arm.wrap_near(theta, theta_s) for theta in drawn]
            theta_f = min(goals, key=lambda goal: float(ca.norm_2(goal - theta_s)))
            theta_m = (theta_s + theta_f) / 2.0 + ca.DM(rng.normal(0.0, SPREAD, theta_s.shape))
            yield self._variables(Quantities(theta_s, theta_m, 0.75 * (theta_f - theta_s), theta_f, ca.DM(1), ca.DM(1)))

    def _posture(self, rng: np.random.Generator, point: tuple[float, float], elbow: float) -> Matrix:
        arm, target = self.problem.arm, ca.DM(list(point))
        return arm.inverse(target, restore(arm, target, ca.DM(rng.random(arm.links - 2))), elbow)[0]

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """theta_s, theta_m, dtheta_m, theta_f, t1, t2 of a solution, after time scaling."""
        return self._scaled(x).arrays()

    def trajectory(self, x: FloatArray) -> Trajectory:
        """Quartic and quintic of a solution, as fast as the limits allow for all t."""
        return self._scaled(x).trajectory()

    def _scaled(self, x: FloatArray) -> Quantities:
        """With the ends exactly at their points and the limits kept exactly."""
        quantities = self._exact_ends(self._quantities(ca.DM(x[: self._symbols[0].shape[0]])))
        shortest = self.problem.segment_time[0] / float(ca.fmin(quantities.t1, quantities.t2))
        return quantities.time_scaled(max(shortest, quantities.trajectory().safe_time_scale(self.problem.arm)))

    def _exact_ends(self, quantities: Quantities) -> Quantities:
        arm, task = self.problem.arm, self.problem
        theta_s = arm.project_to_point(quantities.theta_s, ca.DM(list(task.start)))
        theta_f = arm.project_to_point(quantities.theta_f, ca.DM(list(task.goal)))
        return replace(quantities, theta_s=theta_s, theta_f=theta_f)
