"""Paths traced in least time."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.assembly import objective_named, pace_of, slowness_of
from problems.base import FloatArray, InvalidProblem, Matrix, as_array
from problems.certify import Verdict
from problems.evaluation import Loop, Program, Step
from problems.families.knots import posture_steps
from problems.families.splines import MoveSteps, SplineProblem
from problems.families.traced.encoding import AT_REST, SpaceKnots, TracedKnots, Tracing
from problems.families.traced.motion import TracedSpline
from problems.families.traced.postures import best_starts, clear_postures, wandering_joints
from problems.families.traced.program import TracingNlp, end_to_end
from problems.families.traced.proofs import ToolMotion, TracedTool, prove_tracing
from problems.limits import SAMPLING_MARGIN, Accuracy, AngularAccuracy, Constraint, LimitKind, limits_of, shares_along
from problems.motions import TimedPath, Trajectory
from problems.nlp import NonlinearProgram
from problems.objectives import Objective
from problems.robots import SpatialArm
from problems.tasks import PathKnots, PathTracing, SpaceTracing, ToolTracing, check_at_least, knots_of

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
    knots = knots_of(task.path, task.accuracy, task.robot.reach()[1])
    steps = grid_steps(samples, redundancy_values, knots)
    motion = TracedSpline(task.robot, tuple(knots.u.tolist()), steps, corners=knots.corners)
    points = tuple(tuple(point) for point in knots.points.tolist())
    minimised = objective_named(objective, task.robot)
    return TracingProblem(
        task=task,
        motion=motion,
        encoding=Tracing(task, motion, points, redundancy_values, slowness_of(minimised, task), pace_of(task)),
        objective=minimised,
        limits=limits_of(task.robot, task.obstacles, limits),
        knots=knots,
    )


@dataclass(frozen=True, kw_only=True)
class TracingProblem(TracedProblem):
    """Lead the tool along a path in the plane, from rest to rest."""

    task: PathTracing
    encoding: Tracing

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


class TracingSteps(TracedSteps):
    """With one accuracy, of the tool's position."""

    def __init__(self, problem: TracingProblem) -> None:
        super().__init__(problem)
        self.accuracy = self.arguments.symbolic_copy(problem.accuracy)

    def nearness(self, theta: Matrix, line: Matrix) -> list[Constraint]:
        """The distance from the line."""
        return near_lines(self.accuracy, self.motion.robot.tool(theta), line)


NO_PROGRAM = "a path in space has no nonlinear program; metaheuristics plan it"
POSITIONS = 6  # numbers of a line: start and end


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
    most_turned = np.inf if task.angular_accuracy is None else task.angular_accuracy
    knots = knots_of(task.path, task.accuracy, task.robot.reach()[1], most_turned)
    steps = grid_steps(samples, redundancy_values, knots)
    motion = TracedSpline(task.robot, tuple(knots.u.tolist()), steps, corners=knots.corners)
    minimised = objective_named(objective, task.robot)
    encoding = _encoding(task, motion, knots, redundancy_values)
    return SpaceTracingProblem(
        task=task,
        motion=motion,
        encoding=replace(encoding, slowness=slowness_of(minimised, task), pace=pace_of(task)),
        objective=minimised,
        limits=limits_of(task.robot, task.obstacles, limits),
        knots=knots,
    )


def _encoding(task: SpaceTracing, motion: TracedSpline, knots: PathKnots, values: int) -> SpaceKnots:
    """The search vectors: which postures it may begin with, which joints wander off."""
    targets = knots.points
    if knots.rotations is not None:
        targets = np.column_stack([targets, knots.rotations.reshape(-1, 9)])
    clear = clear_postures(task, knots)
    still = SpaceKnots(task, motion, _tuples(targets), _tuples(clear[:1]), (), values)
    starts = best_starts(task, knots, clear, still.followed)
    return replace(still, starts=_tuples(starts), joints=wandering_joints(task, starts))


def _tuples(rows: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in rows.tolist())


@dataclass(frozen=True, kw_only=True)
class SpaceTracingProblem(TracedProblem):
    """Lead the tool of an arm in space along a path, from rest to rest."""

    has_program: ClassVar[bool] = False

    task: SpaceTracing
    encoding: SpaceKnots

    @cached_property
    def lines(self) -> FloatArray:
        """Of the line on which each grid point lies: start and end, m; with orientations also how it turns, (n, w)."""
        orientations = self.task.path.orientations
        if orientations is None:
            return super().lines
        segments = self.knots.segments[self.motion.intervals]
        turning = orientations.matrices[segments].reshape(-1, 9), orientations.axes[segments]
        return np.column_stack([super().lines, *turning, orientations.angles[segments]])

    @property
    def angular_accuracy(self) -> AngularAccuracy | None:
        """The largest angle to the orientation of the path, as a limit; None where that is free."""
        return None if self.task.angular_accuracy is None else AngularAccuracy(self.task.angular_accuracy)

    def nearness(self, theta: Matrix, lines: Matrix) -> Sequence[Constraint]:
        """The distances from the lines, and the angles to their orientations."""
        return near_in_space(self.task.robot, self.accuracy, self.angular_accuracy, theta, lines)

    def cost_program(self) -> Program:
        """Postures at the knots, spline, scan backward, scan forward, samples, distances from the path, finish."""
        return SpaceTracingSteps(self).program()

    def nlp(self) -> NonlinearProgram:
        """There is none.

        Raises:
            InvalidProblem: always.
        """
        raise InvalidProblem("solver", NO_PROGRAM)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """Path parameters of the knots, and the joint angles there, of one candidate (d,)."""
        theta = as_array(self.encoding.postures(ca.DM(x)))
        angles = {f"theta_{joint}": column for joint, column in enumerate(theta.T, start=1)}
        return {**angles, "u_knots": np.array(self.motion.nodes)}

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        """Every constraint, the distance from the path and the angle to its orientation for all t among them."""
        times, path = self.task.point_times(trajectory), self.task.path
        tool = TracedTool(ToolMotion(self.task.robot, trajectory), path.array, times, path.orientations)
        found = [*super().verify(trajectory), tool.prove_position(self.task.accuracy)]
        most = self.task.angular_accuracy
        return found if most is None else [*found, tool.prove_orientation(most)]


def near_in_space(
    robot: SpatialArm, accuracy: Accuracy, angular: AngularAccuracy | None, theta: Matrix, lines: Matrix
) -> list[Constraint]:
    """That the tool in n postures (n, dof) is near lines (n, w), and turned as they say."""
    tool, rotation = robot.tool_pose(theta)
    near = near_lines(accuracy, tool, lines[:, :POSITIONS])
    if angular is None:
        return near
    shares = shares_along(tool, *ca.horzsplit(lines[:, :POSITIONS], 3))
    return [*near, angular.along(rotation, shares, lines[:, POSITIONS:], SAMPLING_MARGIN)]


class SpaceTracingSteps(TracedSteps):
    """With accuracies of the tool's position and orientation."""

    def __init__(self, problem: SpaceTracingProblem) -> None:
        super().__init__(problem)
        self.robot = self.arguments.symbolic_copy(problem.task.robot)
        self.accuracy = self.arguments.symbolic_copy(problem.accuracy)
        self.angular_accuracy = self.arguments.symbolic_copy(problem.angular_accuracy)

    def nearness(self, theta: Matrix, line: Matrix) -> list[Constraint]:
        """The distance from the line, and the angle to its orientation."""
        return near_in_space(self.robot, self.accuracy, self.angular_accuracy, theta, line)
