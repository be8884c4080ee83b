"""The common part of problems in which a path is searched for and its least-time timing is computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import casadi as ca

from problems.assembly.problem import Problem
from problems.base.matrix import FloatArray, Matrix, as_array
from problems.encodings.encoding import Decoded
from problems.encodings.path_timing import PathTiming
from problems.limits.time_scale import peaks_of
from problems.motions.joint_path import JointPath
from problems.motions.path_spline import PathSpline, TimedPath
from problems.motions.trajectory import Trajectory
from problems.timing.retime import retime


@dataclass(frozen=True, kw_only=True)
class SplineProblem(Problem[TimedPath]):
    """A path in joint space, run as fast as the limits allow."""

    free_timing: ClassVar[bool] = True

    motion: PathSpline
    encoding: PathTiming

    def decoded(self, x: Matrix) -> Decoded[TimedPath]:
        """The motion of a search vector, in the least time of its path on the grid."""
        shape = self.encoding.decode(x).parameters
        limits = self.encoding.slowing(self.limits)
        samples = self.motion.samples(shape)
        return Decoded(parameters=self.encoding.timed(shape, limits, [peaks_of(limit, samples) for limit in limits]))

    def objective_bound(self) -> float:
        """An upper bound of what the objective counts as: what is above it costs no more."""
        return self.objective.upper_bound(self.encoding.motion_bounds(self.limits))

    @cached_property
    def _control_points(self) -> ca.Function:
        x = ca.SX.sym("x", len(self.variables))
        return ca.Function("path", [x], [self.encoding.path(x)[0]])

    def path(self, x: FloatArray) -> JointPath:
        """The path of one candidate (d,)."""
        return self.motion.path(as_array(self._control_points(x)))

    def trajectory(self, x: FloatArray) -> Trajectory:
        """The exact least-time motion along the path of one candidate (d,), under jerk limits too."""
        return retime(self.path(x), self.robot.limits)

    def exact_time_scale(self, trajectory: Trajectory) -> float:
        """How much slower, or faster, a trajectory has to be run; 1 where an end moves, whose velocity is given."""
        return super().exact_time_scale(trajectory) if self.encoding.at_rest else 1.0

    def safe_time_scale(self, trajectory: Trajectory) -> float:
        """The same and a little more, so that rounding breaks no limit."""
        return super().safe_time_scale(trajectory) if self.encoding.at_rest else 1.0
