"""Search vectors of a motion along a path: the redundancy along it, and the duration.

What is decided are a few normalised values x_phi for each redundant link, interpolated along the path, [the elbow,]
and, in the paper's form, t_T. In the reduced form t_T is a closed form of the shape: the speed and acceleration limits
then hold for all t, exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.encodings.encoding import CostWeights, Decoded, Variable
from problems.encodings.knot_postures import largest_values
from problems.encodings.path_encoding import PathEncoding
from problems.encodings.penalty import FeasibilityFirst, limit_weight, paper_cost
from problems.encodings.timing.slowness import Slowness, variables_of
from problems.limits.constraint import Constraint
from problems.limits.limit import Limit
from problems.limits.time_scale import longest_time_scale, minimum_time_scale, scaling
from problems.motions.knot_spline import KnotSpline
from problems.motions.splines.in_time import SplineShape
from problems.objectives.objective import MotionBounds
from problems.robots.robot import Robot
from problems.tasks.elbow import Elbow
from problems.tasks.paths.path_following import PathFollowing

EXACT_ORDERS = (1, 2, 3)  # of the derivatives whose extremes over all t a cubic spline gives in closed form
DEFAULT_TIME_BOUNDS = (0.1, 10.0)  # s, bounds of t_T


@dataclass(frozen=True)
class KnotsEncoding(PathEncoding[SplineShape]):
    """The common part of both formulations: postures at the knots by inverse kinematics.

    Args:
        task: whose path and elbow.
        motion: that is decoded.
        redundancy_values: how many values of x_phi are decided for each redundant link; 5 in the paper.
        time_box: bounds of t_T, s.
        slowness: the last variable, where time is scaled and the duration is one.
    """

    numbers: ClassVar[tuple[str, ...]] = ("time_box",)
    time_variables: ClassVar[int]

    task: PathFollowing
    motion: KnotSpline
    redundancy_values: int = 5
    time_box: tuple[float, float] = DEFAULT_TIME_BOUNDS
    slowness: Slowness | None = None

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @property
    def elbow(self) -> Elbow:
        """The branch of inverse kinematics."""
        return self.task.elbow

    @property
    def knots(self) -> FloatArray:
        """Path parameters of the knots, (M,)."""
        return self.motion.spline.knots

    @cached_property
    def knot_points(self) -> FloatArray:
        """The points at the knots, (M, dim), m."""
        return self.task.path.array[list(self.task.knot_indices)]

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The paper's solution vector: x_phi of link 3, ..., of link k, [elbow,] t_T; reduced: [slowness] instead."""
        times = [Variable("t_T", *self.time_box, "s")] * self.time_variables
        return (*self.posture_variables, *times, *variables_of(self.slowness))

    def decode(self, x: Matrix) -> Decoded[SplineShape]:
        """The spline through the knots; it takes 1 s where time is scaled afterwards."""
        _, theta = self.at_knots(x)
        return Decoded(parameters=self.shape(theta, self.parts(x)[2]))

    def shape(self, theta: Matrix, time: Matrix) -> SplineShape:
        """The spline through joint angles (M, dof) at the knots."""
        duration = ca.DM(1.0) if self.scales_time else time
        return SplineShape(self.motion.spline.coefficients(theta), duration)

    def exact_limits(self, limits: Sequence[Limit]) -> list[Limit]:
        """Speed, acceleration and jerk, whose extremes over all t are known in closed form."""
        return [limit for limit in scaling(limits) if limit.order in EXACT_ORDERS]

    def sampled_limits(self, limits: Sequence[Limit]) -> list[Limit]:
        """The others that running more slowly makes hold: at the samples."""
        return [limit for limit in scaling(limits) if limit.order not in EXACT_ORDERS]

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds that no candidate of the search box exceeds: angles turn by at most pi per knot."""
        increments = np.diff(self.motion.spline.operator(self.motion.parameters_u), axis=0)
        return MotionBounds(
            duration=self._longest(limits),
            rotation=float(self.task.robot.dof * largest_values(increments).sum()),
            radius=self.task.robot.reach()[1],
        )

    def _longest(self, limits: Sequence[Limit]) -> float:
        return self.time_box[1]


@dataclass(frozen=True)
class PaperKnots(KnotsEncoding):
    """The paper's solution vector with its cost (25)."""

    name: ClassVar[str] = "paper"
    scales_time: ClassVar[bool] = False
    time_variables: ClassVar[int] = 1

    def penalty(self, constraint: Constraint) -> Matrix:
        """The penalty h_i(x) g_i(x) of (25)."""
        return constraint.paper_penalty()

    def cost(
        self, objective: Matrix, penalties: Sequence[Matrix], reach: Matrix | None, weights: CostWeights
    ) -> Matrix:
        """The cost (25)."""
        return paper_cost(objective, penalties, None, weights)

    def weights(self, objective_upper_bound: float, constraints: Sequence[Constraint]) -> CostWeights:
        """The weight of the penalties; (25) prints them without one."""
        limit = limit_weight(constraints, objective_upper_bound)
        return CostWeights(objective_upper_bound=objective_upper_bound, limit=limit, reach=0.0)


@dataclass(frozen=True)
class ReducedKnots(FeasibilityFirst, KnotsEncoding):
    """Feasible by construction, except for the accuracy, obstacles and joint ranges."""

    name: ClassVar[str] = "reduced"
    scales_time: ClassVar[bool] = True
    time_variables: ClassVar[int] = 0

    def restored(self, limits: Sequence[Limit]) -> list[Limit]:
        """The limits whose extremes over all t have a closed form, and then those that are sampled."""
        return [*self.exact_limits(limits), *self.sampled_limits(limits)]

    def timed(self, shape: SplineShape, limits: Sequence[Limit], peaks: Sequence[Matrix], x: Matrix) -> SplineShape:
        """The closed form of t_T, given the limits' peaks over u in [0, 1], or over samples of it; or more slowly."""
        shortest = self.time_box[0]
        time = ca.fmax(shortest, minimum_time_scale(limits, peaks)) if limits else ca.vertcat(shortest)
        if self.slowness is not None:
            time = time * self.slowness.factor(x, time)
        return SplineShape(shape.coefficients, time)

    def _longest(self, limits: Sequence[Limit]) -> float:
        spline = self.motion.spline
        acceleration = largest_values(spline.operator(spline.nodes, 2)).max()
        speed = largest_values(spline.operator(spline.nodes, 1)).max() + acceleration
        dof = self.task.robot.dof
        jerk = largest_values(np.diff(spline.operator(spline.nodes, 2), axis=0) / np.diff(spline.nodes)[:, None]).max()
        bounds = enumerate((speed, acceleration, jerk), start=1)
        peaks = {order: ca.repmat(ca.DM(bound), 1, dof) for order, bound in bounds}
        least = max(self.time_box[0], longest_time_scale(self.restored(limits), peaks))
        return least if self.slowness is None else self.slowness.longest_of(least)
