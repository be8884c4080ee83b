"""Tracing a path: the tool stays near the given points and the lines between them, and passes them at free times."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from problems.base.matrix import FloatArray, as_array
from problems.limits.constraint import Constraint
from problems.limits.duration import DurationBounds
from problems.motions.order import increasing_choice
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle
from problems.tasks.drawing import Marker, MarkerKind
from problems.tasks.elbow import Elbow
from problems.tasks.paths.path import Path
from problems.tasks.paths.path_following import check_path
from problems.tasks.point_to_point import end_conditions
from problems.tasks.task import Task

TIMES_PER_POINT = 40  # among which the time is chosen at which a point is passed
LEAST_TIMES = 2001


class ToolTracing(Task):
    """The common part of tracing in the plane and in space. A subclass is a frozen dataclass.

    Attributes:
        robot: that moves.
        path: the points P*.
        accuracy: the largest distance from the path, m.
        obstacles: to keep clear of.
        total_time: bounds of T in s; None where nothing is promised.
    """

    robot: Robot
    path: Path
    accuracy: float
    obstacles: tuple[Obstacle, ...]
    total_time: tuple[float, float] | None

    @property
    def duration_bounds(self) -> DurationBounds | None:
        """The bounds of T, where they are stated."""
        return None if self.total_time is None else DurationBounds("total time", "T", *self.total_time)

    @abstractmethod
    def point_times(self, trajectory: Trajectory) -> FloatArray:
        """When the points of the path are passed, increasing, (n,), s."""

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        """Start and goal; that the tool stays near the path has a proof of its own."""
        return end_conditions(self.robot, trajectory, self.path.points[0], self.path.points[-1])

    def markers(self) -> tuple[Marker, ...]:
        """The given points."""
        label, points, kind = "given points", self.path.array, MarkerKind.POINTS
        return (Marker(label=label, points=points, kind=kind, tolerance=self.accuracy, joined=True),)


@dataclass(frozen=True)
class PathTracing(ToolTracing):
    """Lead the tool along a path, from rest to rest, as fast as the limits allow.

    The points are passed in their order, each within ``accuracy``, whenever it suits; between two of them the tool
    stays within ``accuracy`` of the straight line that joins them. The path is left at neither end: the first point is
    the start, the last the goal.

    Args:
        robot: that moves.
        path: the points P*.
        accuracy: the largest distance from the path, m.
        elbow: the branch of inverse kinematics, the same all along; ``free`` adds a decision variable.
        obstacles: to keep clear of.
        total_time: bounds of T in s; None where nothing is promised.

    Raises:
        InvalidProblem: a point is out of reach, too close to the base or inside an obstacle, or a field is out of
            its range.
    """

    numbers: ClassVar[tuple[str, ...]] = ("accuracy", "total_time")

    robot: Robot
    path: Path
    accuracy: float
    elbow: Elbow = "free"
    obstacles: tuple[Obstacle, ...] = ()
    total_time: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_path(self.robot, self.path, self.accuracy, self.elbow, self.obstacles, self.total_time)

    def point_times(self, trajectory: Trajectory) -> FloatArray:
        """When the points of the path are passed, increasing, (n,), s.

        Of all choices in order among many times that with the smallest sum of squared distances.
        """
        return times_at(self.robot, trajectory, self.path.array)


def times_at(robot: Robot, trajectory: Trajectory, points: FloatArray) -> FloatArray:
    """When the tool passes points (n, dim) in their order, the first at the start, the last at the end; (n,), s."""
    times = trajectory.times(max(LEAST_TIMES, TIMES_PER_POINT * len(points)))
    tool = as_array(trajectory.samples(times, robot).tool)
    away = np.array([np.square(tool - point).sum(axis=1) for point in points])
    chosen = times[increasing_choice(away)]
    chosen[[0, -1]] = 0.0, trajectory.duration
    return chosen
