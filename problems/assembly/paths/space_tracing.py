"""Tracing a path in space: a start and wandering joints are searched for, its points are passed at free times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.assembly.paths.starting_postures import best_starts, clear_postures, wandering_joints
from problems.assembly.paths.traced import TracedProblem, TracedSteps, grid_steps, near_lines
from problems.assembly.point_to_point import objective_named
from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, as_array
from problems.certify.space_tracing import ToolMotion, TracedTool
from problems.certify.verdict import Verdict
from problems.encodings.space_tracing import SpaceKnots
from problems.encodings.timing.pace import pace_of
from problems.encodings.timing.slowness import slowness_of
from problems.evaluation import Program
from problems.limits import LimitKind, limits_of
from problems.limits.accuracy import Accuracy, shares_along
from problems.limits.angular_accuracy import AngularAccuracy
from problems.limits.constraint import Constraint
from problems.limits.limit import SAMPLING_MARGIN
from problems.motions.traced_spline import TracedSpline
from problems.motions.trajectory import Trajectory
from problems.nlp.program import NonlinearProgram
from problems.objectives import Objective
from problems.robots.spatial.spatial_arm import SpatialArm
from problems.tasks.paths.path_knots import PathKnots, knots_of
from problems.tasks.paths.space_tracing import SpaceTracing

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
        self.robot = self.arguments.twin(problem.task.robot)
        self.accuracy = self.arguments.twin(problem.accuracy)
        self.angular_accuracy = self.arguments.twin(problem.angular_accuracy)

    def nearness(self, theta: Matrix, line: Matrix) -> list[Constraint]:
        """The distance from the line, and the angle to its orientation."""
        return near_in_space(self.robot, self.accuracy, self.angular_accuracy, theta, line)
