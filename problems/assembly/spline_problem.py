"""The common part of problems in which a path is searched for and its least-time timing is computed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import casadi as ca

from problems.assembly.problem import Problem
from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, as_array
from problems.encodings.encoding import CostWeights, Decoded
from problems.encodings.timing.path_timing import PathTiming
from problems.limits.constraint import Constraint
from problems.limits.time_scale import peaks_of
from problems.motions.joint_path import JointPath
from problems.motions.path_spline import PathSpline, TimedPath
from problems.motions.trajectory import Trajectory
from problems.robots.robot import JointLimits
from problems.timing.retime import retime
from problems.timing.speed_profile import SpeedProfile


@dataclass(frozen=True, kw_only=True)
class SplineProblem(Problem[TimedPath]):
    """A path in joint space, run as fast as the limits allow."""

    free_timing: ClassVar[bool] = True

    motion: PathSpline
    encoding: PathTiming

    def decoded(self, x: Matrix) -> Decoded[TimedPath]:
        """The motion of a search vector, in the least time of its path on the grid."""
        decoded, limits = self.encoding.decode(x), self.encoding.slowing(self.limits)
        samples = self.motion.samples(decoded.parameters)
        peaks = [peaks_of(limit, samples) for limit in limits]
        return replace(decoded, parameters=self.encoding.timed(decoded.parameters, limits, peaks, x))

    def objective_bound(self) -> float:
        """An upper bound of what the objective counts as: what is above it costs no more."""
        return self.objective.upper_bound(self.encoding.motion_bounds(self.limits))

    @cached_property
    def weights(self) -> CostWeights:
        """The weights in the cost, which need no motion: feasibility is graded."""
        return self.encoding.weights(self.objective_bound(), ())

    def point_constraints(self, parameters: TimedPath) -> list[Constraint]:
        """The length of steps, with obstacles."""
        if not self.encoding.step_limits:
            return []
        steps = self.motion.samples(parameters).steps
        return [constraint for limit in self.encoding.step_limits for constraint in limit.between(*steps)]

    @cached_property
    def _path(self) -> ca.Function:
        x = ca.SX.sym("x", len(self.variables))
        points, (start, goal) = self.encoding.path(x)
        return ca.Function("path", [x], [points, ca.sqrt(start), ca.DM(0.0) if goal is None else ca.sqrt(goal)])

    def path(self, x: FloatArray) -> JointPath:
        """The path of one candidate (d,), with a parameter u in [0, 1]."""
        return self.motion.path(as_array(self._path(x)[0]))

    def trajectory(self, x: FloatArray) -> Trajectory:
        """The least time along the path of one candidate (d,), or one near it, in which its limits hold for all t.

        Where an obstacle moves, the timing of the search instead, slower only as far as its limits ask between samples.

        Where there is none, as the path stands still or its ends cannot be passed at the given velocities, the motion
        of the search's own timing.
        """
        return self._timed(x, self.robot.limits, refined=not self.is_polished)

    def quick_trajectory(self, x: FloatArray) -> Trajectory:
        """The least time without a jerk limit, found much sooner: where a descent may begin."""
        return self._timed(x, replace(self.robot.limits, jerk=None))

    def _timed(self, x: FloatArray, limits: JointLimits, refined: bool = True) -> Trajectory:
        """In the least time; in the search's own duration where that is a variable, at its times where they matter."""
        points, *rates = (as_array(part) for part in self._path(x))
        start, goal = (float(rate[0, 0]) for rate in rates)
        try:
            path, chain = self.motion.path(points), self.robot.rigid_chain
            least = retime(path, limits, (start, goal), refined, chain, self._ceiling(x))
        except InvalidProblem:
            return super().trajectory(x)
        if self.encoding.slowness is None:
            return least
        return least.time_scaled(max(1.0, float(self.parameters_of(x).duration) / least.duration))

    def _ceiling(self, x: FloatArray) -> SpeedProfile | None:
        """The timing of the search, where an obstacle moves: a faster motion would come too early."""
        if self.encoding.pace is None:
            return None
        return SpeedProfile(self.motion.parameters_u, as_array(self.parameters_of(x).squared).ravel())

    def exact_time_scale(self, trajectory: Trajectory) -> float:
        """How much slower, or faster, a trajectory has to be run; 1 where an end moves, whose velocity is given."""
        return super().exact_time_scale(trajectory) if self.encoding.at_rest else 1.0

    def safe_time_scale(self, trajectory: Trajectory) -> float:
        """The same and a little more, so that rounding breaks no limit."""
        return super().safe_time_scale(trajectory) if self.encoding.at_rest else 1.0
