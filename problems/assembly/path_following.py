"""Following a given path, Section III-A, second case: (7), (19)-(25), for k >= 3 links.

The tip passes the path's points at equal intervals of time. What is decided is how the redundancy is spent on the
way, a few normalised values x_phi that are interpolated along the path, and how long the motion takes, t_T. At some
of the points, the knots, (7) and inverse kinematics give the joint angles; a C2 spline at rest at both ends joins
them, so that the other points are met only nearly: the trajectory accuracy (24).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, get_args

import casadi as ca
import numpy as np
from scipy.interpolate import CubicSpline

from problems.assembly.problem import SAMPLING_MARGIN, Model, Problem, Variable
from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, as_array, columns, constant, largest, repeated, split
from problems.certify.verification import end_verdicts
from problems.encodings.penalty import graded_cost, limit_weight, penalised
from problems.evaluation import PopulationFunction
from problems.limits.constraint import Constraint, PenaltyKind, Verdict, verdict
from problems.limits.motion_limits import minimum_time_scale, motion_constraints
from problems.motions.rest_spline import RestSpline
from problems.motions.samples import Samples
from problems.motions.trajectory import Trajectory
from problems.objectives.objective import OBJECTIVES, Objective
from problems.robots.planar import PlanarArm, wrap_to
from problems.robots.redundancy import angular_range, restore
from problems.scene.ellipse import Ellipse
from problems.tasks.checks import (
    Elbow,
    Formulation,
    KnotRedundancy,
    check_choices,
    check_elbow,
    check_obstacles,
    check_point,
    check_range,
    elbow_signs,
)
from problems.tasks.path import Path

if TYPE_CHECKING:
    from problems.nlp.path_following import PathNlp

ON_THE_POINT = 1e-30  # m^2, keeps the gradient of a distance finite where it is 0
ROWS_A_SAMPLE = 8  # of a tabulated trajectory
USUAL_TIMES = (0.1, 10.0)  # s


@dataclass(frozen=True)
class PathFollowing(Problem):
    """Lead the tip along a path, from rest to rest.

    Args:
        arm: the arm, at least 3 links.
        path: the points P*.
        accuracy: the largest distance between planned and given point at the same path parameter, m (24).
        objective: ``time`` (19), ``rotation`` (20) or ``length`` (10).
        elbow: the branch of inverse kinematics, the same all along; ``free`` adds a decision variable.
        formulation: ``paper``, the cost (25) over the paper's solution vector x_phi and t_T; or ``reduced``, where
            t_T is a closed form of the shape and the accuracy (with obstacles and joint limits) the only penalty.
        samples: time steps a half of the motion at which it is sampled, made to fit the points of the path.
        redundancy_values: how many values of x_phi are decided for each link beyond the second; 5 in the paper.
        knots: how many of the points are knots at the least, spread evenly; corners are knots too. Half of the
            points if None.
        obstacles: to keep clear of.
        total_time: bounds of t_T, s. The upper one is the paper formulation's search box only. If None, from 0.1 s to
            10 s, or to twice the time that the motion in the middle of its redundancy takes if that is more.
        knot_redundancy: of the nonlinear program alone: ``free`` at every knot, or the search vector's ``values``.

    Raises:
        InvalidProblem: a point is out of reach, too close to the base or inside an obstacle, or a field is out of
            its range.
    """

    arm: PlanarArm
    path: Path
    accuracy: float
    objective: str = "time"
    elbow: Elbow = "free"
    formulation: Formulation = "paper"
    samples: int = 50
    redundancy_values: int = 5
    knots: int | None = None
    obstacles: tuple[Ellipse, ...] = ()
    total_time: tuple[float, float] | None = None
    knot_redundancy: KnotRedundancy = "free"

    def __post_init__(self) -> None:
        check_choices(self, objective=OBJECTIVES, elbow=get_args(Elbow), formulation=get_args(Formulation))
        check_choices(self, knot_redundancy=get_args(KnotRedundancy))
        if self.arm.links < 3:
            raise InvalidProblem("link_lengths", f"following a path takes at least 3 links, not {self.arm.links}")
        if not (np.isfinite(self.accuracy) and self.accuracy > 0.0):
            raise InvalidProblem("accuracy", f"{self.accuracy} m is not positive")
        for field, least in (("samples", 2), ("redundancy_values", 2), ("knots", 2)):
            value = getattr(self, field)
            if value is not None and value < least:
                raise InvalidProblem(field, f"{value} is fewer than {least}")
        if self.total_time is not None:
            check_range("total_time", self.total_time)
        check_elbow(self.arm, self.elbow)
        check_obstacles(self.obstacles)
        for index, point in enumerate(self.path.points):
            check_point(self.arm, self.obstacles, "points", point, name=f"points[{index}] = ")

    @property
    def measured_by(self) -> Objective:
        """The objective (19), (20) or (10)."""
        return OBJECTIVES[self.objective]

    @property
    def extra(self) -> int:
        """How many links are redundant, k - 2."""
        return self.arm.links - 2

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """The paper's solution vector: x_phi of link 3, ..., of link k, [elbow,] t_T (not in the reduced form)."""
        links, values = range(3, self.arm.links + 1), range(1, self.redundancy_values + 1)
        listed = [Variable(f"x_phi_{link}[{i}]", 0.0, 1.0, "1") for link in links for i in values]
        if self.elbow == "free":
            listed.append(Variable("elbow", -1.0, 1.0, "1"))
        if self.formulation == "paper":
            listed.append(Variable("t_T", *self.time_box, "s"))
        return tuple(listed)

    @cached_property
    def time_box(self) -> tuple[float, float]:
        """Bounds of t_T, s."""
        if self.total_time is not None:
            return self.total_time
        if self.formulation == "reduced":
            return USUAL_TIMES
        fixed: Elbow = "up" if self.elbow == "free" else self.elbow
        middle = replace(self, formulation="reduced", elbow=fixed)
        _, _, time = middle.decode(ca.DM([0.5] * len(middle.variables)))
        return USUAL_TIMES[0], max(USUAL_TIMES[1], 2.0 * float(time))

    @cached_property
    def parameters(self) -> FloatArray:
        """Path parameter u of each point, (n,)."""
        return np.linspace(0.0, 1.0, len(self.path.points))

    @cached_property
    def knot_indices(self) -> tuple[int, ...]:
        """Which points are knots: both ends, the corners and the points next to them, others evenly in between.

        At rest and at a corner the tip is far from moving evenly, and a knot missing there costs the most accuracy.
        """
        last = len(self.path.points) - 1
        wanted = self.knots if self.knots is not None else (last + 3) // 2
        even = np.rint(np.linspace(0, last, min(wanted, last + 1))).astype(int).tolist()
        around = [index + shift for index in (0, *self.path.corners, last) for shift in (-1, 0, 1)]
        return tuple(sorted({*even, *(index for index in around if 0 <= index <= last)}))

    @cached_property
    def spline(self) -> RestSpline:
        """Through the knots, each at its own path parameter."""
        return RestSpline(self.parameters[list(self.knot_indices)])

    @property
    def steps(self) -> int:
        """Time steps between two points of the path; an even number, so that the spline's nodes are samples.

        The acceleration peaks at the nodes, two of which lie half-way between points: a grid that misses them lets
        the paper formulation exceed the limit by up to 50 %.
        """
        return 2 * max(1, round(self.samples / (len(self.path.points) - 1)))

    @cached_property
    def grid(self) -> FloatArray:
        """Path parameters of the samples; every ``steps``-th is a point of the path."""
        return np.linspace(0.0, 1.0, self.steps * (len(self.path.points) - 1) + 1)

    def redundancy(self, x_phi: Matrix) -> Matrix:
        """Normalised redundancy at the knots, (M, k - 2): interpolated, then cut off at 0 and 1."""
        return ca.fmin(1.0, ca.fmax(0.0, self.interpolated_redundancy(x_phi)))

    def interpolated_redundancy(self, x_phi: Matrix) -> Matrix:
        """The same before it is cut off: a cubic spline through the decided values."""
        decided = np.linspace(0.0, 1.0, self.redundancy_values)
        interpolation = constant(CubicSpline(decided, np.eye(self.redundancy_values))(self.spline.knots))
        return ca.mtimes(interpolation, ca.reshape(x_phi, self.redundancy_values, self.extra))

    def decode(self, x: Matrix) -> tuple[Matrix, Matrix, Matrix]:
        """From a search vector (d, 1) to the shape and the total time.

        Returns:
            phi at the knots (M, k - 2) in rad by (7); spline coefficients of the joint angles (M + 4, k) in rad;
            t_T in s.
        """
        free, timed = int(self.elbow == "free"), int(self.formulation == "paper")
        x_phi, branch, time = split(x, [self.extra * self.redundancy_values, free, timed])
        elbow = elbow_signs(self.elbow, branch, ends=1)[0]
        normalised = self.redundancy(x_phi)
        phi: list[Matrix] = []
        theta: list[Matrix] = []
        for row, index in enumerate(self.knot_indices):
            point = ca.DM(self.path.points[index])
            phi.append(restore(self.arm, point, normalised[row, :].T))
            angles, _ = self.arm.inverse(point, phi[-1], elbow)
            theta.append(wrap_to(angles, theta[-1]) if theta else self.arm.wrap(angles))
        shape = self.spline.coefficients(ca.vertcat(*theta))
        return ca.horzcat(*phi).T, shape, time if timed else self._least_duration(shape)

    def _least_duration(self, shape: Matrix) -> Matrix:
        """The closed form of t_T: the speed and acceleration limits then hold for all t, exactly."""
        speed, acceleration = self.spline.extreme_speeds(shape), self.spline.accelerations(shape)
        return ca.fmax(self.time_box[0], minimum_time_scale(self.arm, speed, acceleration))

    def sampled(self, shape: Matrix, time: Matrix) -> Samples:
        """The motion on the grid."""
        blocks = [ca.mtimes(self.spline.sampling_matrix(self.grid, n), shape / time**n) for n in range(3)]
        return Samples(blocks[0], blocks[1], blocks[2], time)

    def accuracy_limit(self, tip: Matrix, indices: Sequence[int] | None = None) -> Constraint:
        """(24): |P*(i) - P(i)| <= accuracy.

        Args:
            tip: planned positions (n, 2) at the points' path parameters, m.
            indices: of these points; all if None.
        """
        given = self.path.array if indices is None else self.path.array[list(indices)]
        dx, dy = columns(tip - ca.DM(given))
        bound, endless = np.array([self.accuracy]), np.array([np.inf])
        return Constraint(
            "accuracy",
            "(24)",
            "m",
            ca.sqrt(dx * dx + dy * dy + ON_THE_POINT),
            -endless,
            bound,
            ("tip",),
            bound,
            weight=PenaltyKind.MAGNITUDE,
            transform=lambda distance: (distance / self.accuracy) ** 2,
            formula="|P*_i - tip(theta(u_i))| <= accuracy, at every given point i",
        )

    @cached_property
    def model(self) -> Model:
        """Cost (25), or its reduced form, over the search vector."""
        x = ca.SX.sym("x", len(self.variables))
        _, shape, time = self.decode(x)
        samples = self.sampled(shape, time)
        objective = self.measured_by.of(self.arm, samples)
        at_points = samples.theta[:: self.steps, :]
        limits = motion_constraints(self.arm, self.obstacles, samples, SAMPLING_MARGIN)
        limits.append(self.accuracy_limit(self.arm.tip(at_points)))
        if self.formulation == "paper":
            cost = penalised(objective, limits, limit_weight(limits, self.objective_upper_bound))
        else:
            kept = [limit for limit in limits if limit.name not in ("speed", "acceleration")]
            cost = graded_cost(objective, kept, self.objective_upper_bound)
        return Model(x, objective, tuple(limits), cost)

    @property
    def lambda_1(self) -> float:
        """The weight of the penalties in the paper formulation; (25) prints none."""
        return limit_weight(self.constraints, self.objective_upper_bound)

    @cached_property
    def objective_upper_bound(self) -> float:
        """What the objective cannot exceed in the search box, in its unit: angles turn by at most pi a knot."""
        rotation = self.arm.links * self._largest(np.diff(self.spline.operator(self.grid), axis=0)).sum()
        if self.objective == "rotation":
            return float(rotation)
        if self.objective == "length":
            return float(self.arm.reach()[1] * rotation)
        if self.formulation == "paper":
            return self.time_box[1]
        acceleration = self._largest(self.spline.operator(self.spline.nodes, 2)).max()
        speed = self._largest(self.spline.operator(self.spline.nodes, 1)).max() + acceleration
        bounds = (repeated([value] * self.arm.links, 1) for value in (speed, acceleration))
        return max(self.time_box[0], float(minimum_time_scale(self.arm, *bounds)))

    @staticmethod
    def _largest(operator: FloatArray) -> FloatArray:
        """Bounds of an operator (n, M) on knot angles that do not change by more than pi from knot to knot, (n,)."""
        steps = operator @ np.tril(np.ones((operator.shape[1],) * 2))[:, 1:]
        return np.asarray(np.pi * np.abs(steps).sum(axis=1))

    @cached_property
    def _decoder(self) -> ca.Function:
        return ca.Function("decode", [self.model.x], list(self.decode(self.model.x)))

    @cached_property
    def _accuracy(self) -> PopulationFunction:
        limit = next(constraint for constraint in self.constraints if constraint.name == "accuracy")
        return PopulationFunction(ca.Function("accuracy", [self.model.x], [largest(limit.expression)]))

    def accuracy_of(self, candidates: FloatArray) -> FloatArray:
        """Trajectory accuracy of candidates (m, d): the largest distance from a given point, (m,), m."""
        return self._accuracy(candidates)

    def accuracy_at(self, trajectory: Trajectory) -> float:
        """Trajectory accuracy: the largest distance from a given point, m."""
        limit = self.accuracy_limit(self.arm.tip(trajectory.samples(self.point_times(trajectory)).theta))
        return float(largest(limit.expression))

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """Redundancy angles phi at the knots and t_T of one candidate (d,)."""
        phi, _, time = self._decoder(x)
        return self.named_quantities(as_array(phi), float(time))

    def named_quantities(self, phi: FloatArray, time: float) -> dict[str, FloatArray]:
        """By name: redundancy angles at the knots (M, k - 2), t_T, and the knots themselves."""
        named = {f"phi_{j}": column for j, column in enumerate(phi.T, start=3)}
        return {"t_T": np.array([time]), **named, "u_knots": self.spline.knots}

    def trajectory(self, x: FloatArray) -> Trajectory:
        """The spline of one candidate (d,), exactly."""
        _, shape, time = self._decoder(x)
        return self.spline_trajectory(shape, float(time))

    def spline_trajectory(self, shape: Matrix, time: float) -> Trajectory:
        """The motion of numeric spline coefficients (M + 4, k) in rad that takes ``time`` s."""
        return Trajectory.from_pieces(np.diff(self.spline.nodes) * time, self.spline.pieces(as_array(shape)))

    def nlp(self) -> PathNlp:
        """The same problem for solvers that follow gradients."""
        from problems.nlp.path_following import PathNlp  # noqa: PLC0415 (it builds on this module)

        return PathNlp(self)

    def point_times(self, trajectory: Trajectory) -> FloatArray:
        """When the points of the path are passed, (n,), s."""
        return self.parameters * trajectory.duration

    def redundancy_ranges(self, trajectory: Trajectory) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Redundancy angles of a trajectory and their bounds (23) when the given points are passed.

        Returns:
            phi, lower and upper, each (n, k - 2), rad, for links 3..k. A link beyond the third has its bounds given
            where the links after it stand; of two intervals the one that phi is in, or nearest to, is returned.
        """
        theta = as_array(trajectory.samples(self.point_times(trajectory)).theta)
        phi = np.cumsum(theta, axis=1)[:, 2:]
        lower, upper = np.empty_like(phi), np.empty_like(phi)
        for row, point in enumerate(self.path.array):
            target = ca.DM(point)
            for link in range(self.arm.links, 2, -1):
                angle = float(phi[row, link - 3])
                ends = (float(value) for value in angular_range(self.arm, link, target))
                lower[row, link - 3], upper[row, link - 3] = _interval_around(angle, *ends)
                target = target - self.arm.link_lengths[link - 1] * ca.DM([np.cos(angle), np.sin(angle)])
        return phi, lower, upper

    def task_verdicts(self, trajectory: Trajectory) -> list[Verdict]:
        """Accuracy at every point; start and goal."""
        times = self.point_times(trajectory)
        limit = self.accuracy_limit(self.arm.tip(trajectory.samples(times).theta))
        ends = end_verdicts(self.arm, trajectory, self.path.points[0], self.path.points[-1])
        return [verdict(limit, times), *ends]

    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Equal steps, the points of the path and the search's samples among them; many, as pieces are short."""
        intervals = self.grid.size - 1
        steps = intervals * max(ROWS_A_SAMPLE, int(np.ceil((at_least - 1) / intervals)))
        return np.linspace(0.0, trajectory.duration, steps + 1)


def _interval_around(angle: float, alpha: float, beta_in: float, beta_out: float) -> tuple[float, float]:
    """The interval of alpha ± [beta_in, beta_out], in the turn nearest ``angle``, on the angle's side of alpha."""
    alpha = float(wrap_to(ca.DM(alpha), ca.DM(angle)))
    if beta_in == 0.0:
        return alpha - beta_out, alpha + beta_out
    return (alpha + beta_in, alpha + beta_out) if angle >= alpha else (alpha - beta_out, alpha - beta_in)
