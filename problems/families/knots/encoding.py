"""Normalised redundancy at knots (7) and the duration, as printed and reduced.

What is decided are a few normalised values x_phi for each redundant link, interpolated along the path, [the elbow,]
and, in the paper's form, t_T. In the reduced form t_T is a closed form of the shape: the speed and acceleration limits
then hold for all t, exactly.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, TypeVar

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.assembly import Decoded, Encoding, FeasibilityFirst, PaperCost, SearchedTimeScale, Variable
from problems.base import FloatArray, Matrix, Operand, constant, split
from problems.families.knots.motion import KnotSpline
from problems.limits import Limit, longest_time_scale, minimum_time_scale, scaling
from problems.motions import SplineShape
from problems.objectives import MotionBounds
from problems.robots import Robot, wrap_to
from problems.tasks import Elbow, PathFollowing, PathTracing, elbow_signs

P = TypeVar("P")


class KnotPostures(Encoding[P]):
    """Search vectors that decide about postures along a path."""

    @property
    @abstractmethod
    def knot_rows(self) -> FloatArray:
        """Rows for the knots: how each depends on the search vector, and where the tool is there; (lead + M, w)."""

    @property
    def lead(self) -> int:
        """How many rows only lead to the posture at the first knot; none by default."""
        return 0

    @abstractmethod
    def posture_before(self, x: Matrix) -> Matrix:
        """The posture from which the first one is found, (1, dof), rad."""

    @abstractmethod
    def posture_at(self, x: Matrix, row: Matrix, before: Matrix) -> Matrix:
        """The posture at a knot, (1, dof), rad.

        Args:
            x: search vector, (d, 1).
            row: of :attr:`knot_rows`, (w, 1).
            before: the posture at the knot before, (1, dof), rad.
        """

    @abstractmethod
    def postures(self, x: Matrix) -> Matrix:
        """Joint angles at all knots, (M, dof), rad."""


def largest_values(operator: FloatArray, most: float = np.pi) -> FloatArray:
    """Bounds of an operator (n, M) on knot angles that do not change by more than ``most`` from knot to knot, (n,)."""
    steps = operator @ np.tril(np.ones((operator.shape[1],) * 2))[:, 1:]
    return np.asarray(most * np.abs(steps).sum(axis=1))


class PathEncoding(KnotPostures[P]):
    """Search vectors of x_phi for each redundant link, [the elbow,] and whatever a subclass adds at their end.

    Attributes:
        task: whose path and elbow.
        redundancy_values: how many values of x_phi are decided for each redundant link; 5 in the paper.
    """

    task: PathFollowing | PathTracing
    redundancy_values: int

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @property
    def elbow(self) -> Elbow:
        """The branch of inverse kinematics."""
        return self.task.elbow

    @property
    @abstractmethod
    def knots(self) -> FloatArray:
        """Path parameters of the knots, (M,), from 0 to 1."""

    @property
    @abstractmethod
    def knot_points(self) -> FloatArray:
        """The points at the knots, (M, dim), m."""

    @property
    def posture_variables(self) -> list[Variable]:
        """x_phi of link 3, ..., of link k, [elbow]."""
        extra, values = self.robot.closed_form.redundancy, range(1, self.redundancy_values + 1)
        listed = [Variable(f"x_phi_{link}[{i}]", 0.0, 1.0, "1") for link in range(3, 3 + extra) for i in values]
        if self.elbow == "free":
            listed.append(Variable("elbow", -1.0, 1.0, "1"))
        return listed

    @cached_property
    def interpolation(self) -> FloatArray:
        """Matrix (M, n) from the decision variables of one link to its values at the knots: a cubic spline."""
        decided = np.linspace(0.0, 1.0, self.redundancy_values)
        return np.asarray(scipy.interpolate.CubicSpline(decided, np.eye(self.redundancy_values))(self.knots))

    def parts(self, x: Matrix) -> tuple[Matrix, Operand, Matrix]:
        """The parts of a search vector: redundancy values (n, redundancy), the elbow's sign, and the rest."""
        extra, free = self.robot.closed_form.redundancy, int(self.elbow == "free")
        own = extra * self.redundancy_values
        x_phi, branch, rest = split(x, [own, free, len(self.variables) - own - free])
        values = ca.reshape(x_phi, self.redundancy_values, extra)
        return values, elbow_signs(self.elbow, branch, ends=1)[0], rest

    def redundancy_at(self, weights: Matrix, point: Matrix, values: Matrix) -> Matrix:
        """Redundant values (redundancy, 1) at a knot: interpolated by weights (1, n), cut off at 0 and 1, then (7)."""
        normalised = ca.fmin(1.0, ca.fmax(0.0, ca.mtimes(weights, values)))
        return self.robot.closed_form.restore_redundancy(point, normalised.T)

    def posture(self, point: Matrix, redundancy: Matrix, elbow: Operand, before: Matrix) -> Matrix:
        """Joint angles (1, dof) at a knot, each in the turn nearest those at the knot before."""
        angles, _ = self.robot.closed_form.inverse(point, redundancy, elbow)
        return wrap_to(angles, before)

    @property
    def knot_rows(self) -> FloatArray:
        """Shares of the decided values, and the point; (M, values + dim)."""
        return np.column_stack([self.interpolation, self.knot_points])

    def posture_before(self, x: Matrix) -> Matrix:
        """The angles near which those of the first knot are wrapped, (1, dof), rad: the middle of their first turn."""
        return self.robot.closed_form.middle

    def posture_at(self, x: Matrix, row: Matrix, before: Matrix) -> Matrix:
        share, point = row[: self.redundancy_values].T, row[self.redundancy_values :]
        values, elbow, _ = self.parts(x)
        return self.posture(point, self.redundancy_at(share, point, values), elbow, before)

    def at_knots(self, x: Matrix) -> tuple[Matrix, Matrix]:
        """Redundant values (M, redundancy) and joint angles (M, dof) at the knots, rad."""
        values, elbow, _ = self.parts(x)
        redundancy: list[Matrix] = []
        theta: list[Matrix] = [self.posture_before(x)]
        for weights, point in zip(self.interpolation, self.knot_points, strict=True):
            target = ca.DM(point)
            redundancy.append(self.redundancy_at(constant(weights[None]), target, values))
            theta.append(self.posture(target, redundancy[-1], elbow, theta[-1]))
        return ca.horzcat(*redundancy).T, ca.vertcat(*theta[1:])

    def postures(self, x: Matrix) -> Matrix:
        return self.at_knots(x)[1]


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
        time_scale: the last variable, where time is scaled and the duration is one.
    """

    numbers: ClassVar[tuple[str, ...]] = ("time_box",)
    time_variables: ClassVar[int]

    task: PathFollowing
    motion: KnotSpline
    redundancy_values: int = 5
    time_box: tuple[float, float] = DEFAULT_TIME_BOUNDS
    time_scale: SearchedTimeScale | None = None

    @property
    def knots(self) -> FloatArray:
        return self.motion.spline.knots

    @cached_property
    def knot_points(self) -> FloatArray:
        return self.task.path.array[list(self.task.knot_indices)]

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The paper's solution vector: x_phi of link 3, ..., of link k, [elbow,] t_T; reduced: [time_scale] instead."""
        times = [Variable("t_T", *self.time_box, "s")] * self.time_variables
        return (*self.posture_variables, *times, *self.time_scale_variables)

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
class PaperKnots(PaperCost, KnotsEncoding):
    """The paper's solution vector with its cost (25)."""

    time_variables: ClassVar[int] = 1


@dataclass(frozen=True)
class ReducedKnots(FeasibilityFirst, KnotsEncoding):
    """Feasible by construction, except for the accuracy, obstacles and joint ranges."""

    time_variables: ClassVar[int] = 0

    def restored(self, limits: Sequence[Limit]) -> list[Limit]:
        """The limits whose extremes over all t have a closed form, and then those that are sampled."""
        return [*self.exact_limits(limits), *self.sampled_limits(limits)]

    def timed(self, shape: SplineShape, limits: Sequence[Limit], peaks: Sequence[Matrix], x: Matrix) -> SplineShape:
        """The closed form of t_T, given the limits' peaks over u in [0, 1], or over samples of it; or more slowly."""
        shortest = self.time_box[0]
        time = ca.fmax(shortest, minimum_time_scale(limits, peaks)) if limits else ca.vertcat(shortest)
        if self.time_scale is not None:
            time = time * self.time_scale.factor(x, time)
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
        return self.longest_with_time_scale(least)


KNOT_ENCODINGS: dict[str, type[KnotsEncoding]] = {kind.name: kind for kind in (PaperKnots, ReducedKnots)}
