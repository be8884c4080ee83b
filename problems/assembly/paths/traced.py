"""The common part of tracing in the plane and in space: what follows from knots, and the cost in steps."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from problems.assembly.move_steps import MoveSteps
from problems.assembly.posture_steps import posture_steps
from problems.assembly.spline_problem import SplineProblem
from problems.base.matrix import FloatArray, Matrix
from problems.encodings.traced_knots import AT_REST, TracedKnots
from problems.evaluation import Loop, Step
from problems.limits.accuracy import Accuracy
from problems.limits.constraint import Constraint
from problems.limits.limit import SAMPLING_MARGIN
from problems.motions.path_spline import TimedPath
from problems.motions.traced_spline import TracedSpline
from problems.tasks.checks import check_at_least
from problems.tasks.paths.path_knots import PathKnots
from problems.tasks.paths.path_tracing import ToolTracing

LEAST_STEPS = 2  # of the grid between two knots


def grid_steps(samples: int, values: int, knots: PathKnots) -> int:
    """Steps of the grid between two knots.

    Raises:
        InvalidProblem: too few samples, or values that are decided.
    """
    check_at_least("samples", samples, 2)
    check_at_least("redundancy_values", values, 2)
    return max(LEAST_STEPS, round(samples / (knots.u.size - 1)))


@dataclass(frozen=True, kw_only=True)
class TracedProblem(SplineProblem):
    """Lead the tool along a path, from rest to rest.

    Attributes:
        knots: of the path.
    """

    task: ToolTracing
    motion: TracedSpline
    encoding: TracedKnots
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
        theta = self.motion.samples(parameters).theta
        return [*super().point_constraints(parameters), *self.nearness(theta, ca.DM(self.lines))]

    def nearness(self, theta: Matrix, lines: Matrix) -> Sequence[Constraint]:
        """That the tool is near lines in n postures (n, dof)."""
        return near_lines(self.accuracy, self.robot.tool(theta), lines)


def near_lines(accuracy: Accuracy, tool: Matrix, lines: Matrix) -> list[Constraint]:
    """That the tool at n positions is near n lines, given by start and end one after the other, (n, 2 dim), m."""
    starts, ends = ca.horzsplit(lines, tool.shape[1])
    return [accuracy.along(tool, starts, ends, SAMPLING_MARGIN)]


class TracedSteps(MoveSteps):
    """Postures at the knots one after the other, and the spline through them, in the place of control points."""

    encoding: TracedKnots
    motion: TracedSpline

    def __init__(self, problem: TracedProblem) -> None:
        super().__init__(problem)
        self.lines = problem.lines

    @abstractmethod
    def nearness(self, theta: Matrix, line: Matrix) -> Sequence[Constraint]:
        """That the tool is near a line in a posture (1, dof); symbolic in the numbers of the statement too."""

    def path_steps(self, begin: Mapping[str, ca.SX]) -> list[Step]:
        """Inverse kinematics in a loop over the knots, then the spline."""
        k = self.motion.robot.dof
        theta = ca.SX.sym("theta", k * len(self.encoding.knot_rows))
        at_knots = ca.reshape(theta[k * self.encoding.lead :], k, -1).T
        points = self.motion.spline.coefficients(at_knots)
        pace = self.pace_vector()
        outputs = {**self.path_vectors(points, AT_REST), **pace, **begin, "accuracy": ca.SX(0)}
        inputs = {"p": self.p, "theta": theta, **({"x": self.x} if pace else {})}
        return [
            *posture_steps(self.encoding, k, self.x, self.p),
            Step.of("path", inputs, outputs),
        ]

    @property
    def least_orders(self) -> tuple[int, ...]:
        """The angles, which the distance from the path needs even if no limit does."""
        return (0,)

    def further_steps(self, orders: tuple[int, ...]) -> list[Step]:
        """A loop over the grid points that adds up how far the tool is from the path."""
        size, width = self.motion.piece_sizes(orders)
        window, row = ca.SX.sym("window", width), ca.SX.sym("row", self.lines.shape[1])
        theta = self.motion.at(window, row, ca.SX(1), orders).theta
        accuracy = ca.SX.sym("accuracy")
        found: Matrix = accuracy
        for constraint in self.nearness(theta, row.T):
            found = found + self.encoding.penalty(constraint)
        inputs = {"p": self.p, "window": window, "row": row, "accuracy": accuracy}
        loop = Loop(rows=self.lines, window="blocks", starts=self.motion.grid.pieces * size)
        return [Step.of("distances", inputs, {"accuracy": found}, loop)]

    @property
    def further_penalties(self) -> tuple[str, ...]:
        """The penalty of the accuracy."""
        return ("accuracy",)
