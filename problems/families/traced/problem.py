"""Paths of the tool traced in least time: by a search in the plane and in space, by a nonlinear program in the plane.

In the program the knots are passed at free times, anywhere within the accuracy: corners are rounded off as far as it
allows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import casadi as ca
import numpy as np

from problems.assembly import Criteria, LocalTimeScale, SearchedTimeScale, objective_named
from problems.base import FloatArray, InvalidProblem, Matrix, as_array
from problems.certify import Verdict
from problems.evaluation import Loop, Step
from problems.families.knots import posture_steps
from problems.families.splines import MoveNlp, MoveSteps, PassedMotion, SplineProblem, node_times
from problems.families.traced.direct import TracingPlanner
from problems.families.traced.encoding import AT_REST, SpaceKnots, TracedKnots, TracedSpline, Tracing, as_tuples
from problems.families.traced.proofs import ToolMotion, TracedTool, prove_tracing
from problems.limits import SAMPLING_MARGIN, Accuracy, AngularAccuracy, Constraint, LimitKind, limits_of, shares_along
from problems.motions import Samples, TimedPath, Trajectory
from problems.objectives import Objective
from problems.programs import NonlinearProgram
from problems.robots import Robot, SpatialArm
from problems.tasks import (
    Move,
    PathKnots,
    PathTracing,
    Position,
    SpaceTracing,
    ToolTracing,
    check_at_least,
    knots_of,
    times_at,
)

LEAST_STEPS = 2  # of the grid between two knots


def near_path(
    robot: Robot, accuracy: Accuracy, angular: AngularAccuracy | None, theta: Matrix, lines: Matrix
) -> list[Constraint]:
    """Constraints that the tool in postures (n, dof) is near n lines, and turned as they say where that is asked for.

    Args:
        robot: that moves.
        accuracy: the largest distance.
        angular: the largest angle, of a robot in space; None where the orientation is free.
        theta: the postures.
        lines: start and end one after the other, m; then how the line turns, (n, w).
    """
    starts, ends = ca.horzsplit(lines[:, : 2 * robot.dim], robot.dim)
    if angular is None:
        return [accuracy.along(robot.tool.position(theta), starts, ends, SAMPLING_MARGIN)]
    assert isinstance(robot, SpatialArm)
    tool, rotation = robot.tool.pose(theta)
    turned = angular.along(rotation, shares_along(tool, starts, ends), lines[:, 2 * robot.dim :], SAMPLING_MARGIN)
    return [accuracy.along(tool, starts, ends, SAMPLING_MARGIN), turned]


@dataclass(frozen=True, kw_only=True)
class TracedProblem(SplineProblem):
    """Lead the tool along a path, from rest to rest.

    Attributes:
        knots: of the path.
    """

    motion: TracedSpline
    encoding: TracedKnots
    knots: PathKnots

    @cached_property
    def lines(self) -> FloatArray:
        """The line on which each grid point lies: start and end, m; with orientations also how it turns, (n, w)."""
        segments, path = self.knots.segments[self.motion.intervals], self.encoding.task.path
        lines, orientations = [path.array[segments], path.array[segments + 1]], path.orientations
        if orientations is not None:
            lines += [orientations.matrices[segments].reshape(-1, 9), orientations.axes[segments]]
            lines.append(orientations.angles[segments])
        return np.column_stack(lines)

    @property
    def accuracies(self) -> tuple[Accuracy, AngularAccuracy | None]:
        """The largest distance from the path, and the largest angle to its orientation, as limits."""
        task, angular = self.encoding.task, self.encoding.task.angular_accuracy
        return Accuracy(task.accuracy), None if angular is None else AngularAccuracy(angular)

    def _point_constraints(self, parameters: TimedPath) -> list[Constraint]:
        """The length of steps, with obstacles; the distances from the path at the grid points."""
        theta = self.motion.samples(parameters).theta
        near = near_path(self.motion.robot, *self.accuracies, theta, ca.DM(self.lines))
        return [*super()._point_constraints(parameters), *near]

    def steps(self) -> TracedSteps:
        """Postures at the knots, spline, scan backward, scan forward, samples, distances from the path, finish."""
        return TracedSteps(self)


class TracedSteps(MoveSteps):
    """Postures at the knots one after the other, and the spline through them, in the place of control points."""

    encoding: TracedKnots
    motion: TracedSpline

    def __init__(self, problem: TracedProblem) -> None:
        super().__init__(problem)
        self.lines = problem.lines
        self.accuracies = self.arguments.symbolic_copy(problem.accuracies)

    def path_steps(self, begin: Mapping[str, ca.SX]) -> list[Step]:
        k = self.motion.robot.dof
        theta = ca.SX.sym("theta", k * len(self.encoding.knot_rows))
        points = self.motion.spline.coefficients(ca.reshape(theta[k * self.encoding.lead :], k, -1).T)
        shares = self.speed_share_vector()
        outputs = {**self.path_vectors(points, AT_REST), **shares, **begin, "accuracy": ca.SX(0)}
        inputs = {"p": self.p, "theta": theta, **({"x": self.x} if shares else {})}
        return [*posture_steps(self.encoding, k, self.x, self.p), Step.of("path", inputs, outputs)]

    @property
    def least_orders(self) -> tuple[int, ...]:
        return (0,)

    def further_steps(self, orders: tuple[int, ...]) -> list[Step]:
        """A loop over the grid points that adds up how far the tool is from the path."""
        size, width = self.motion.piece_sizes(orders)
        window, row = ca.SX.sym("window", width), ca.SX.sym("row", self.lines.shape[1])
        theta = self.motion.at(window, row, ca.SX(1), orders).theta
        accuracy = ca.SX.sym("accuracy")
        found: Matrix = accuracy
        for constraint in near_path(self.motion.robot, *self.accuracies, theta, row.T):
            found = found + self.encoding.penalty(constraint)
        inputs = {"p": self.p, "window": window, "row": row, "accuracy": accuracy}
        loop = Loop(rows=self.lines, window="blocks", starts=self.motion.grid.pieces * size)
        return [Step.of("distances", inputs, {"accuracy": found}, loop)]

    @property
    def further_penalties(self) -> tuple[str, ...]:
        return ("accuracy",)


def _stated(
    task: ToolTracing, objective: Objective | str, samples: int, values: int, limits: Sequence[LimitKind]
) -> tuple[dict[str, Any], ...]:
    """The arguments that problems in the plane and in space have in common, of their criteria, and of their encodings.

    Raises:
        InvalidProblem: an unknown name, or too few samples or values.
    """
    most_turned = np.inf if task.angular_accuracy is None else task.angular_accuracy
    knots = knots_of(task.path, task.accuracy, task.robot.reach()[1], most_turned)
    check_at_least("samples", samples, 2)
    check_at_least("redundancy_values", values, 2)
    steps = max(LEAST_STEPS, round(samples / (knots.u.size - 1)))
    minimised = objective_named(objective, task.robot)
    motion = TracedSpline(
        task.robot, tuple(knots.u.tolist()), steps, corners=knots.corners, integrated=minimised.is_integral
    )
    kept = limits_of(task.robot, task.obstacles, limits)
    scales = SearchedTimeScale.where_needed(minimised, task), LocalTimeScale.where_needed(task)
    return (
        {"motion": motion, "knots": knots},
        {"task": task, "objective": minimised, "limits": kept, "free_timing": True},
        dict(zip(("time_scale", "local_time_scale"), scales, strict=True)),
    )


def tracing(
    task: PathTracing,
    objective: Objective | str = "time",
    samples: int = 60,
    redundancy_values: int = 5,
    limits: Sequence[LimitKind] = (),
) -> TracingProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, path, accuracy, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        samples: steps of the path, at whose ends it is timed and checked; at least two between any two knots.
        redundancy_values: how many values of x_phi are decided for each redundant link.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, or too few samples or values.
    """
    stated, judged, scales = _stated(task, objective, samples, redundancy_values, limits)
    points = as_tuples(stated["knots"].points)
    encoding = Tracing(task, stated["motion"], points, redundancy_values, **scales)
    return TracingProblem(criteria=TracingCriteria(**judged), encoding=encoding, **stated)


@dataclass(frozen=True, kw_only=True)
class TracingCriteria(Criteria):
    """The criteria of a path in the plane: the distance from it among them."""

    task: PathTracing

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        times = self.task.point_times(trajectory)
        near = prove_tracing(self.robot, self.task.path.array, self.task.accuracy, trajectory, times)
        return [*super().verify(trajectory), near]


@dataclass(frozen=True, kw_only=True)
class TracingProblem(TracedProblem):
    """Lead the tool along a path in the plane, from rest to rest."""

    encoding: Tracing

    def nlp(self) -> TracingNlp:
        task = self.encoding.task
        return TracingNlp(
            task=end_to_end(task),
            objective=self.criteria.objective,
            limits=self.criteria.limits,
            pieces=self.knots.u.size - 1,
            decode=self.quick_trajectory,
            knots=self.knots,
            path=task.path.array,
            accuracy=task.accuracy,
            box=self.bounds,
        )

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """Path parameters of the knots, and the redundant values there, of one candidate (d,)."""
        knots = self.encoding.knots
        phi = self.encoding.task.robot.closed_form.redundant_values(self.path(x).at(knots))
        return {**{f"phi_{j}": column for j, column in enumerate(phi.T, start=3)}, "u_knots": knots}


NO_PROGRAM = "a path in space has no nonlinear program; metaheuristics plan it"


def space_tracing(
    task: SpaceTracing,
    objective: Objective | str = "time",
    samples: int = 60,
    redundancy_values: int = 5,
    limits: Sequence[LimitKind] = (),
) -> SpaceTracingProblem:
    """The problem that a task states.

    Args:
        task: the statement: robot, path, accuracies, obstacles.
        objective: what is minimised: an objective, or a key of ``OBJECTIVES``.
        samples: steps of the path, at whose ends it is timed and checked; at least two between any two knots.
        redundancy_values: how many offsets are decided for each joint that can wander off while the tool stays.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.

    Raises:
        InvalidProblem: an unknown name, too few samples or values, or no posture to begin with.
    """
    stated, judged, scales = _stated(task, objective, samples, redundancy_values, limits)
    encoding = SpaceKnots.of_task(task, stated["motion"], stated["knots"], redundancy_values)
    criteria = SpaceTracingCriteria(**judged)
    return SpaceTracingProblem(criteria=criteria, encoding=replace(encoding, **scales), **stated)


@dataclass(frozen=True, kw_only=True)
class SpaceTracingCriteria(Criteria):
    """The criteria of a path in space: the distance from it and the angle to its orientation among them."""

    task: SpaceTracing

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        times, path = self.task.point_times(trajectory), self.task.path
        tool = TracedTool(ToolMotion(self.task.robot, trajectory), path.array, times, path.orientations)
        found = [*super().verify(trajectory), tool.prove_position(self.task.accuracy)]
        most = self.task.angular_accuracy
        return found if most is None else [*found, tool.prove_orientation(most)]


@dataclass(frozen=True, kw_only=True)
class SpaceTracingProblem(TracedProblem):
    """Lead the tool of an arm in space along a path, from rest to rest."""

    has_program: ClassVar[bool] = False

    encoding: SpaceKnots

    def nlp(self) -> NonlinearProgram:
        """Refuse: there is no nonlinear program.

        Raises:
            InvalidProblem: always.
        """
        raise InvalidProblem("solver", NO_PROGRAM)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """Path parameters of the knots, and the joint angles there, of one candidate (d,)."""
        theta = as_array(self.encoding.postures(ca.DM(x)))
        angles = {f"theta_{joint}": column for joint, column in enumerate(theta.T, start=1)}
        return {**angles, "u_knots": np.array(self.motion.nodes)}

    @cached_property
    def direct(self) -> TracingPlanner:
        return TracingPlanner(self.criteria, self.encoding.task, len(self.motion.corners) + 1)

    def trajectory(self, x: FloatArray) -> Trajectory:
        """The motion in the search's own timing where programs change it: from the least time they find less."""
        return self._timed(x, self.motion.robot.limits, refined=self.direct.integrals is None)


PROGRAM_STEPS = 4  # of time in each piece: so many that the tool hardly leaves the accuracy between them
MARGINS_OF_ACCURACY = 25.0  # a tool leaves lines between samples by more of the accuracy than obstacles of the reach


@dataclass(frozen=True, kw_only=True)
class TracingNlp(MoveNlp):
    """Lead the tool along a path.

    Args:
        knots: of the path; between any two of them is one piece.
        path: the given points, (n, dim), m.
        accuracy: the largest distance from the path, m.
        box: of the search vectors, lower and upper corner, both (d,).
    """

    knots: PathKnots
    path: FloatArray
    accuracy: float
    box: tuple[FloatArray, FloatArray]

    @property
    def steps(self) -> int:
        return PROGRAM_STEPS

    def _constraints(self, samples: Samples, margin: float) -> tuple[Constraint, ...]:
        """Constraints of a move, of nearness to the given points when passed, and to the lines in between."""
        near, lines = (
            Accuracy(self.accuracy),
            np.append(self.knots.segments.repeat(self.steps), self.knots.segments[-1]),
        )
        starts, ends = ca.DM(self.path[lines]), ca.DM(self.path[lines + 1])
        at_points = (self.steps * self.knots.vertices[1:-1]).tolist()
        margin_of_accuracy = MARGINS_OF_ACCURACY * margin
        rows = [near.along(samples.tool, starts, ends, margin_of_accuracy)]
        if at_points:
            rows.append(near.at(samples.tool[at_points, :], ca.DM(self.path[1:-1]), margin_of_accuracy))
        return (*super()._constraints(samples, margin), *rows)

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        """Nodes where the knots are passed; a motion of this program has them at its breakpoints."""
        own = trajectory.breakpoints.size == self.knots.u.size
        times = trajectory.breakpoints if own else times_at(self.robot, trajectory, self.knots.points)
        return self._variables(PassedMotion(trajectory, times))

    def node_times(self, motion: PassedMotion) -> FloatArray:
        return node_times(motion.trajectory, motion.times, 1, self.robot.limits)

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        while True:
            yield self.from_search(rng.uniform(*self.box))


def end_to_end(task: PathTracing) -> Move:
    """The move from the first point of a path to its last one."""
    first, last = (Position(task.path.points[i]) for i in (0, -1))
    return Move(task.robot, first, (last,), (), task.elbow, task.obstacles, total_time=task.total_time)
