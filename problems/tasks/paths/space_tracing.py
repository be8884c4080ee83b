"""Tracing a path in space: the tool stays near points or poses and what lies between them, and passes them freely."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.base.ranges import shown
from problems.motions.order import increasing_choice
from problems.motions.trajectory import Trajectory
from problems.robots.spatial.spatial_arm import SpatialArm
from problems.scene.obstacle import Obstacle
from problems.tasks.paths.path import Path
from problems.tasks.paths.path_following import check_traced
from problems.tasks.paths.path_tracing import LEAST_TIMES, TIMES_PER_POINT, ToolTracing

LARGEST_ANGULAR_ACCURACY = 1.0  # rad; nobody means more by an accuracy
LEAST_ANGULAR_ACCURACY = 1e-9  # rad; less is rounding
HALVINGS = 45  # of the interval in which a point is passed: to rounding


@dataclass(frozen=True)
class SpaceTracing(ToolTracing):
    """Lead the tool of an arm in space along a path, from rest to rest, as fast as the limits allow.

    The points are passed in their order, each within ``accuracy``, whenever it suits; between two of them the tool
    stays within ``accuracy`` of the straight line that joins them. Where the path gives orientations, the tool is
    turned as it says at the nearest point of that line, within ``angular_accuracy``. The path is left at neither end.

    Args:
        robot: that moves.
        path: the points P*, with orientations or without.
        accuracy: the largest distance from the path, m.
        angular_accuracy: by how much the tool may be turned otherwise, rad; None where its orientation is free.
        obstacles: to keep clear of.
        total_time: bounds of T in s; None where nothing is promised.

    Raises:
        InvalidProblem: a point is out of reach or inside an obstacle, a field is out of its range, or poses come
            without an angular accuracy, or the other way round.
    """

    numbers: ClassVar[tuple[str, ...]] = ("accuracy", "angular_accuracy", "total_time")

    robot: SpatialArm
    path: Path
    accuracy: float
    angular_accuracy: float | None = None
    obstacles: tuple[Obstacle, ...] = ()
    total_time: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_traced(self.robot, self.path, self.accuracy, self.obstacles, self.total_time)
        poses, most = self.path.orientations is not None, self.angular_accuracy
        if poses and most is None:
            raise InvalidProblem("angular_accuracy", "missing: the path gives poses, with the tool's orientation")
        if most is not None and not poses:
            raise InvalidProblem("angular_accuracy", "the path gives no orientations, points of 3 coordinates alone")
        if most is not None and not LEAST_ANGULAR_ACCURACY <= most <= LARGEST_ANGULAR_ACCURACY:
            span = f"{LEAST_ANGULAR_ACCURACY:g} and {LARGEST_ANGULAR_ACCURACY:g} rad"
            raise InvalidProblem("angular_accuracy", f"{shown(most)} is not within {span}")

    def point_times(self, trajectory: Trajectory) -> FloatArray:
        """When the tool is nearest to each point of the path, increasing, (n,), s.

        Chosen among many times as in the plane, and then between the two beside it.
        """
        points = self.path.array
        times = trajectory.times(max(LEAST_TIMES, TIMES_PER_POINT * len(points)))
        tool = self.robot.tool_at(trajectory.at(times))[0]
        away = np.array([np.square(tool - point).sum(axis=1) for point in points])
        chosen = np.array(increasing_choice(away))
        low, high = times[np.maximum(chosen - 1, 0)], times[np.minimum(chosen + 1, times.size - 1)]
        found = np.maximum.accumulate(self._nearest(trajectory, low, high))
        found[[0, -1]] = 0.0, trajectory.duration
        return found

    def _nearest(self, trajectory: Trajectory, low: FloatArray, high: FloatArray) -> FloatArray:
        """When the tool is nearest to each point within intervals of time (n,), by golden sections, (n,), s."""
        golden = (np.sqrt(5.0) - 1.0) / 2.0
        for _ in range(HALVINGS):
            inner = high - golden * (high - low), low + golden * (high - low)
            first, second = (
                np.square(self.robot.tool_at(trajectory.at(times))[0] - self.path.array).sum(axis=1) for times in inner
            )
            low, high = np.where(first <= second, low, inner[0]), np.where(first <= second, inner[1], high)
        return (low + high) / 2.0
