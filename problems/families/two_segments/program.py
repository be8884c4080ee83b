"""The nonlinear program.

Variables: theta_s, theta_m, dtheta_m, theta_f, and t1 and t2 where time matters. The end postures are tied to start
and goal by forward kinematics, smooth where inverse kinematics has edges. Rotation and length do not depend on how
long a motion takes: its duration is then 1, t1 the only time, no speed or acceleration is bounded, and the exact time
scaling of a solution restores the limits. ``elbow`` up or down bounds theta_2 at both ends.

A search vector's box does not apply here: theta_m and dtheta_m may leave it, and so may t1 and t2 at their long end
unless the task bounds them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, as_array, split
from problems.certify import safe_time_scale
from problems.families.two_segments.motion import TIME_SHARES, Quantities, TwoSegments
from problems.families.two_segments.starts import PointToPointStarts
from problems.limits import SAMPLING_MARGIN, Constraint, Limit, StepLimit
from problems.motions import Samples, Trajectory
from problems.objectives import Objective
from problems.programs import (
    MAX_ANGLE_CHANGE,
    MotionProgram,
    composed_hessian,
    equality,
    replace_with_symbols,
    slack_constraints,
)
from problems.robots import Robot
from problems.tasks import PointToPoint, narrow_elbow

TIMED_ROWS = 132  # time steps a segment times joints, about, where limits scale with time: with exact scaling enough
TIMED_STEPS = 25  # but no fewer time steps
CLEARANCE_STEPS = 12  # time steps a segment at the least where there is anything to keep clear of
AXES = ("x", "y", "z")


@dataclass(frozen=True)
class PointToPointNlp(MotionProgram):
    """Move the tip from rest at the start to rest at the goal.

    Args:
        task: the statement: robot, start, goal, obstacles.
        motion: that is sought.
        objective: what is minimised.
        limits: what holds.
        decode: the quantities of a search vector (d,).
    """

    task: PointToPoint
    motion: TwoSegments
    objective: Objective
    limits: tuple[Limit, ...]
    decode: Callable[[FloatArray], Quantities]

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @property
    def samples(self) -> int:
        """The number of time steps per segment."""
        timed = min(self.motion.steps, max(TIMED_STEPS, TIMED_ROWS // self.robot.dof))
        steps = (
            timed if self.has_free_durations or self.objective.program_steps is None else self.objective.program_steps
        )
        return max(steps, CLEARANCE_STEPS) if self.task.crowded else steps

    @cached_property
    def sampled_motion(self) -> TwoSegments:
        """The motion, sampled as coarsely as the program needs it."""
        return replace(self.motion, steps=self.samples)

    @cached_property
    def _symbols(self) -> tuple[ca.SX, Quantities, Samples, ca.SX]:
        """Variables of the motion, the same as quantities, its samples, slacks of the rotation."""
        x = ca.SX.sym("x", 4 * self.robot.dof + (2 if self.has_free_durations else 1))
        quantities = self._quantities(x)
        steps = 2 * self.samples
        rows = self.objective.slack_count(self.robot, steps) // self.robot.dof
        return x, quantities, self.sampled_motion.samples(quantities), ca.SX.sym("slack", rows, self.robot.dof)

    @property
    def x(self) -> ca.SX:
        """theta_s, theta_m, dtheta_m, theta_f, then t1 and t2 or t1 alone, then slacks of the rotation."""
        motion, _, _, slack = self._symbols
        return ca.vertcat(motion, ca.vec(slack))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables, as in the paper; ``t1/T`` where the duration is 1."""
        joints = range(1, self.robot.dof + 1)
        own = [f"{symbol}[{i}]" for symbol in ("theta_s", "theta_m", "dtheta_m", "theta_f") for i in joints]
        slacks = self.x.shape[0] - self._symbols[0].shape[0]
        return (
            *own,
            *(("t1", "t2") if self.has_free_durations else ("t1/T",)),
            *(f"slack[{i}]" for i in range(1, slacks + 1)),
        )

    @cached_property
    def f(self) -> Matrix:
        return self.objective.smooth(self._symbols[2], self._symbols[3]) / self.objective_size

    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        return self._constraints(self._symbols[2], margin)

    def _constraints(self, samples: Samples, margin: float) -> tuple[Constraint, ...]:
        """Constraints on samples of the motion, or on symbols in their place."""
        _, quantities, _, slack = self._symbols
        ends = [
            ("start", "theta_s", quantities.theta_s, self.task.start),
            ("goal", "theta_f", quantities.theta_f, self.task.goal),
        ]
        rows = [
            equality(
                f"tip at the {name}",
                self.robot.tool.position(theta) - ca.horzcat(*point),
                "m",
                AXES[: self.robot.dim],
                f"tip({symbol}) = {name}",
                self.robot.length_unit,
            )
            for name, symbol, theta, point in ends
        ]
        for limit in self.sampled_limits:
            rows += limit.constraints(samples, margin)
        rows += self.duration_rows(ca.horzcat(quantities.t1, quantities.t2), margin)
        step = StepLimit.for_robot(self.robot, self.task.obstacles)
        rows += [] if step is None else step.constraints(samples)
        return (*rows, *slack_constraints(self.objective, samples, slack))

    @cached_property
    def hessian(self) -> ca.Function | None:
        """The Hessian in two steps, over the samples, where there is anything to keep clear of; else None."""
        if not self.task.crowded:
            return None
        motion, slack = self._symbols[2:]
        y, inner, samples = replace_with_symbols(motion)
        g = ca.vertcat(*(row.row_values() for row in self._constraints(samples, SAMPLING_MARGIN)))
        return composed_hessian(self.x, y, inner, self.objective.smooth(samples, slack) / self.objective_size, g)

    def _quantities(self, x: Matrix) -> Quantities:
        k = self.robot.dof
        theta_s, theta_m, dtheta_m, theta_f, times = split(x, [k, k, k, k, 2 if self.has_free_durations else 1])
        t1, t2 = (times[0], times[1]) if self.has_free_durations else (times[0], 1.0 - times[0])
        return Quantities(theta_s.T, theta_m.T, dtheta_m.T, theta_f.T, t1, t2)

    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Elbow and joint limits on the angles, the least times; the rest is free.

        Without joint limits an angle stays within ``MAX_ANGLE_CHANGE`` of where it starts.
        """
        k, size, ranges = self.robot.dof, self.x.shape[0], self.robot.limits.position
        lower, upper = np.full(size, -np.inf), np.full(size, np.inf)
        for name, first in {"theta_s": 0, "theta_m": k, "theta_f": 3 * k}.items():
            block = slice(first, first + k)
            lower[block], upper[block] = (
                (x[block] - MAX_ANGLE_CHANGE, x[block] + MAX_ANGLE_CHANGE) if ranges is None else np.array(ranges).T
            )
            if name != "theta_m":
                narrow_elbow(self.robot, self.task.elbow, x, first + 1, lower, upper)
        times = slice(4 * k, 4 * k + (2 if self.has_free_durations else 1))
        lower[times], upper[times] = (self.task.time_box[0], np.inf) if self.has_free_durations else TIME_SHARES
        lower[times.stop :] = 0.0
        return lower, upper

    def from_search(self, x: FloatArray) -> FloatArray:
        return self._variables(self.decode(x))

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """Postures at the breakpoints, the speed in the middle, t1 and t2; of another form half of the time is over."""
        two = len(trajectory.breakpoints) == 3
        times = trajectory.breakpoints if two else trajectory.duration * np.array([0.0, 0.5, 1.0])
        at = trajectory.samples(times)
        t1, t2 = (ca.DM(float(t)) for t in np.diff(times))
        return self._variables(Quantities(at.theta[0, :], at.theta[1, :], at.speed[1, :], at.theta[2, :], t1, t2))

    def _variables(self, quantities: Quantities) -> FloatArray:
        if not self.has_free_durations:
            quantities = quantities.time_scaled(1.0 / (quantities.t1 + quantities.t2))
        parts = [getattr(quantities, field.name) for field in fields(Quantities)]
        x = np.concatenate([as_array(part).ravel() for part in (parts if self.has_free_durations else parts[:-1])])
        return np.append(x, self.objective.slack_values(as_array(self._angles(x))))

    @cached_property
    def _angles(self) -> ca.Function:
        """The angles at the samples, of the variables of the motion."""
        x, _, samples, _ = self._symbols
        return ca.Function("angles", [x], [samples.theta])

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        for quantities in self._starts.sequence(rng, self._violation):
            yield self._variables(quantities)

    def _violation(self, quantities: Quantities) -> float:
        """The largest violation of a row, dimensionless."""
        lower, upper = self.row_bounds()
        g = as_array(self._row_values(self._variables(quantities))).ravel()
        return float(np.maximum(lower - g, g - upper).max())

    @cached_property
    def _row_values(self) -> ca.Function:
        return ca.Function("g", [self.x], [self.g])

    @cached_property
    def _starts(self) -> PointToPointStarts:
        return PointToPointStarts(self.task, self.objective)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """theta_s, theta_m, dtheta_m, theta_f, t1, t2 of a solution, after time scaling."""
        return self._scaled(x).arrays()

    def trajectory(self, x: FloatArray) -> Trajectory:
        """Quartic and quintic of a solution, as fast as the limits allow for all t."""
        return self._scaled(x).trajectory()

    def _scaled(self, x: FloatArray) -> Quantities:
        """Quantities of a solution with the ends exactly at their points and the limits kept exactly."""
        quantities = self._exact_ends(self._quantities(ca.DM(x[: self._symbols[0].shape[0]])))
        shortest = self.task.time_box[0] / float(ca.fmin(quantities.t1, quantities.t2))
        return quantities.time_scaled(max(shortest, self._time_scale(quantities.trajectory())))

    def _time_scale(self, trajectory: Trajectory) -> float:
        """The time scale of a solution: as fast as limits allow or, where that may be worse, no faster than it is."""
        scale = safe_time_scale(self.limits, trajectory)
        return scale if self.objective.sooner_is_better and not self.depends_on_speed else max(1.0, scale)

    def _exact_ends(self, quantities: Quantities) -> Quantities:
        ends = [as_array(theta).ravel() for theta in (quantities.theta_s, quantities.theta_f)]
        theta_s, theta_f = (ca.DM(theta).T for theta in self._starts.ends.postures.nearest(np.array(ends)))
        return replace(quantities, theta_s=theta_s, theta_f=theta_f)
