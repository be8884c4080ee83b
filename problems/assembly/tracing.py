"""Tracing a path: redundancy along it is searched for, its points are passed at free times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.assembly.move_steps import MoveSteps
from problems.assembly.point_to_point import objective_named
from problems.assembly.posture_steps import posture_steps
from problems.assembly.spline_problem import SplineProblem
from problems.base.matrix import FloatArray
from problems.certify.tracing import prove_tracing
from problems.certify.verdict import Verdict
from problems.encodings.tracing import AT_REST, Tracing
from problems.evaluation import Loop, Program, Step
from problems.limits import limits_of
from problems.limits.accuracy import Accuracy
from problems.limits.constraint import Constraint
from problems.limits.limit import SAMPLING_MARGIN, Limit
from problems.motions.path_spline import TimedPath
from problems.motions.traced_spline import TracedSpline
from problems.motions.trajectory import Trajectory
from problems.nlp.tracing import TracingNlp, end_to_end
from problems.objectives import Objective
from problems.tasks.checks import check_at_least
from problems.tasks.paths.path_knots import PathKnots, knots_of
from problems.tasks.paths.path_tracing import PathTracing

LEAST_STEPS = 2  # of the grid between two knots


def tracing(
    task: PathTracing,
    objective: Objective | str = "time",
    samples: int = 60,
    redundancy_values: int = 5,
    limits: Sequence[type[Limit]] = (),
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
    check_at_least("samples", samples, 2)
    check_at_least("redundancy_values", redundancy_values, 2)
    knots = knots_of(task.path, task.accuracy, task.robot.reach()[1])
    steps = max(LEAST_STEPS, round(samples / (knots.u.size - 1)))
    motion = TracedSpline(task.robot, tuple(knots.u.tolist()), steps, corners=knots.corners)
    points = tuple(tuple(point) for point in knots.points.tolist())
    return TracingProblem(
        task=task,
        motion=motion,
        encoding=Tracing(task, motion, points, redundancy_values),
        objective=objective_named(objective),
        limits=limits_of(task.robot, task.obstacles, limits),
        knots=knots,
    )


@dataclass(frozen=True, kw_only=True)
class TracingProblem(SplineProblem):
    """Lead the tool along a path, from rest to rest.

    Attributes:
        knots: of the path.
    """

    task: PathTracing
    motion: TracedSpline
    encoding: Tracing
    knots: PathKnots

    @cached_property
    def lines(self) -> FloatArray:
        """Start and end of the line on which each grid point lies, (n, 2 dim), m."""
        segments, path = self.knots.segments[self.motion.intervals], self.task.path.array
        return np.column_stack([path[segments], path[segments + 1]])

    @property
    def accuracy(self) -> Accuracy:
        """The largest distance from the path, as a limit."""
        return Accuracy(self.task.accuracy)

    def point_constraints(self, parameters: TimedPath) -> list[Constraint]:
        """The length of steps, with obstacles; the distances from the path at the grid points."""
        starts, ends = np.split(self.lines, 2, axis=1)
        tool = self.motion.samples(parameters).tool
        near = self.accuracy.along(tool, ca.DM(starts), ca.DM(ends), SAMPLING_MARGIN)
        return [*super().point_constraints(parameters), near]

    def cost_program(self) -> Program:
        """Postures at the knots, spline, scan backward, scan forward, samples, distances from the path, finish."""
        return TracingSteps(self).program()

    def nlp(self) -> TracingNlp:
        """The same problem for solvers that follow gradients."""
        return TracingNlp(
            task=end_to_end(self.task),
            objective=self.objective,
            limits=self.limits,
            pieces=self.knots.u.size - 1,
            decode=self.quick_trajectory,
            knots=self.knots,
            path=self.task.path.array,
            accuracy=self.task.accuracy,
            box=self.bounds,
        )

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """Path parameters of the knots, and the redundant values there, of one candidate (d,)."""
        knots = self.encoding.knots
        phi = self.robot.redundant_values(self.path(x).at(knots))
        return {**{f"phi_{j}": column for j, column in enumerate(phi.T, start=3)}, "u_knots": knots}

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        """Every constraint, the distance from the path for all t among them."""
        times = self.task.point_times(trajectory)
        near = prove_tracing(self.robot, self.task.path.array, self.task.accuracy, trajectory, times)
        return [*super().verify(trajectory), near]


class TracingSteps(MoveSteps):
    """Postures at the knots one after the other, and the spline through them, in the place of control points."""

    encoding: Tracing
    motion: TracedSpline

    def __init__(self, problem: TracingProblem) -> None:
        super().__init__(problem)
        self.accuracy, self.lines = self.arguments.twin(problem.accuracy), problem.lines

    def path_steps(self, begin: Mapping[str, ca.SX]) -> list[Step]:
        """Inverse kinematics in a loop over the knots, then the spline."""
        k = self.motion.robot.dof
        theta = ca.SX.sym("theta", k * len(self.encoding.points))
        points = self.motion.spline.coefficients(ca.reshape(theta, k, -1).T)
        outputs = {**self.path_vectors(points, AT_REST), **begin, "accuracy": ca.SX(0)}
        return [*posture_steps(self.encoding, self.x, self.p), Step.of("path", {"p": self.p, "theta": theta}, outputs)]

    @property
    def least_orders(self) -> tuple[int, ...]:
        """The angles, which the distance from the path needs even if no limit does."""
        return (0,)

    def further_steps(self, orders: tuple[int, ...]) -> list[Step]:
        """A loop over the grid points that adds up how far the tool is from the path."""
        size, width = self.motion.piece_sizes(orders)
        window, row = ca.SX.sym("window", width), ca.SX.sym("row", self.lines.shape[1])
        theta = self.motion.at(window, row, ca.SX(1), orders).theta
        start, end = ca.vertsplit(row, self.lines.shape[1] // 2)
        constraint = self.accuracy.along(self.motion.robot.tool(theta), start.T, end.T, SAMPLING_MARGIN)
        accuracy = ca.SX.sym("accuracy")
        inputs = {"p": self.p, "window": window, "row": row, "accuracy": accuracy}
        outputs = {"accuracy": accuracy + self.encoding.penalty(constraint)}
        loop = Loop(rows=self.lines, window="blocks", starts=self.motion.grid.pieces * size)
        return [Step.of("distances", inputs, outputs, loop)]

    @property
    def further_penalties(self) -> tuple[str, ...]:
        """The penalty of the accuracy."""
        return ("accuracy",)
