"""Tracing a path: redundancy along it is searched for, its points are passed at free times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from problems.assembly.paths.traced import TracedProblem, TracedSteps, grid_steps, near_lines
from problems.assembly.point_to_point import objective_named
from problems.base.matrix import FloatArray, Matrix
from problems.certify.tracing import prove_tracing
from problems.certify.verdict import Verdict
from problems.encodings.timing.pace import pace_of
from problems.encodings.timing.slowness import slowness_of
from problems.encodings.tracing import Tracing
from problems.evaluation import Program
from problems.limits import LimitKind, limits_of
from problems.limits.constraint import Constraint
from problems.motions.traced_spline import TracedSpline
from problems.motions.trajectory import Trajectory
from problems.nlp.tracing import TracingNlp, end_to_end
from problems.objectives import Objective
from problems.tasks.paths.path_knots import knots_of
from problems.tasks.paths.path_tracing import PathTracing


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
        self.accuracy = self.arguments.twin(problem.accuracy)

    def nearness(self, theta: Matrix, line: Matrix) -> list[Constraint]:
        """The distance from the line."""
        return near_lines(self.accuracy, self.motion.robot.tool(theta), line)
