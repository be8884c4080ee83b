"""The nonlinear program over the interval times."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, as_array
from problems.certify import safe_time_scale
from problems.families.via_times.motion import NodeStates, StatePieces
from problems.limits import SAMPLING_MARGIN, Constraint, Limit, StepLimit
from problems.motions import Samples, Trajectory
from problems.objectives import Objective
from problems.programs import MotionProgram, composed_hessian, replace_with_symbols, slack_constraints
from problems.tasks import Move


@dataclass(frozen=True)
class IntervalTimesNlp(MotionProgram):
    """Minimise an objective over the interval times of a motion, whose samples keep all limits.

    Args:
        task: the statement.
        motion: that is sought.
        objective: what is minimised.
        limits: what holds.
        time_boxes: bounds of the interval times, s.
        states: the motion of interval times (n, 1), s.
        decode: the same of a search vector (d,), as fast as it is meant.
    """

    task: Move
    motion: StatePieces
    objective: Objective
    limits: tuple[Limit, ...]
    time_boxes: tuple[tuple[float, float], ...]
    states: Callable[[Matrix], NodeStates]
    decode: Callable[[FloatArray], NodeStates]

    @cached_property
    def _symbols(self) -> tuple[ca.SX, Samples, ca.SX]:
        """Interval times, the samples of their motion, slacks of the objective."""
        h = ca.SX.sym("h", self.motion.count)
        samples = self.motion.samples(self.states(h))
        rows = self.objective.slack_count(self.motion.robot, samples.count - 1) // self.motion.robot.dof
        return h, samples, ca.SX.sym("slack", rows, self.motion.robot.dof)

    @property
    def x(self) -> ca.SX:
        """The interval times, then slacks of the objective."""
        h, _, slack = self._symbols
        return ca.vertcat(h, ca.vec(slack))

    @property
    def names(self) -> tuple[str, ...]:
        h, _, slack = self._symbols
        times = (f"h_{i}" for i in range(1, h.shape[0] + 1))
        return (*times, *(f"slack[{i}]" for i in range(1, slack.numel() + 1)))

    @cached_property
    def f(self) -> Matrix:
        _, samples, slack = self._symbols
        return self.objective.smooth(samples, slack) / self.objective_size

    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        return self._constraints(self._symbols[1], margin)

    def _constraints(self, samples: Samples, margin: float) -> tuple[Constraint, ...]:
        """Constraints on samples of the motion, or on symbols in their place."""
        rows = [row for limit in self.sampled_limits for row in limit.constraints(samples, margin)]
        step = StepLimit.for_robot(self.motion.robot, self.task.obstacles)
        rows += [] if step is None else step.constraints(samples)
        return (*rows, *slack_constraints(self.objective, samples, self._symbols[2]))

    @cached_property
    def hessian(self) -> ca.Function:
        """The Hessian in two steps, over the samples, all of which depend on all interval times."""
        _, motion, slack = self._symbols
        y, inner, samples = replace_with_symbols(motion)
        g = ca.vertcat(*(row.row_values() for row in self._constraints(samples, SAMPLING_MARGIN)))
        return composed_hessian(self.x, y, inner, self.objective.smooth(samples, slack) / self.objective_size, g)

    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The bounds of the interval times; slacks are not negative."""
        lower, upper = np.zeros(x.size), np.full(x.size, np.inf)
        lower[: self.motion.count], upper[: self.motion.count] = np.array(self.time_boxes).T
        return lower, upper

    def from_search(self, x: FloatArray) -> FloatArray:
        return self._variables(as_array(self.decode(x).durations).ravel())

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """The durations of its pieces; of another form as many times of equal shares of the boxes."""
        times = np.diff(trajectory.breakpoints)
        if times.size != self.motion.count:
            middles = np.mean(self.time_boxes, axis=1)
            times = middles * trajectory.duration / middles.sum()
        return self._variables(times)

    def _variables(self, times: FloatArray) -> FloatArray:
        return np.append(times, self.objective.slack_values(as_array(self._angles(times))))

    @cached_property
    def _angles(self) -> ca.Function:
        h, samples, _ = self._symbols
        return ca.Function("angles", [h], [samples.theta])

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        """Interval times of equal shares of their boxes, then random ones, run as fast as limits allow."""
        lower, upper = np.array(self.time_boxes).T
        yield self._variables(self._scaled_times((lower + upper) / 2.0))
        while True:
            yield self._variables(self._scaled_times(rng.uniform(lower, upper)))

    def _scaled_times(self, times: FloatArray) -> FloatArray:
        scale = safe_time_scale(self.limits, self.motion.trajectory(self.states(ca.DM(times))))
        return np.clip(times * scale, *np.array(self.time_boxes).T) if scale > 0.0 else times

    def trajectory(self, x: FloatArray) -> Trajectory:
        """The motion of a solution, as fast as the limits allow for all t where sooner is better."""
        found = self.motion.trajectory(self.states(ca.DM(x[: self.motion.count])))
        least = safe_time_scale(self.limits, found)
        sooner = self.objective.sooner_is_better and not self.depends_on_speed
        return found.time_scaled(least if sooner and least > 0.0 else max(1.0, least))

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The interval times of a solution, s."""
        return {"h": np.diff(self.trajectory(x).breakpoints)}
