"""Point to point, Section III-A, first case: the tool from rest at one point to rest at another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, get_args

import numpy as np

from problems.base.matrix import FloatArray
from problems.limits.constraint import Constraint
from problems.limits.point_constraints import end_point
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle
from problems.tasks.checks import check_choice, check_obstacles, check_point, check_range
from problems.tasks.drawing import Marker, MarkerKind
from problems.tasks.elbow import Elbow, check_elbow
from problems.tasks.task import Task


@dataclass(frozen=True)
class PointToPoint(Task):
    """Move the tool from rest at ``start`` to rest at ``goal``.

    Args:
        robot: that moves.
        start: tool position at t = 0, m.
        goal: tool position at t = T, m.
        elbow: the branch of inverse kinematics at both ends; ``free`` adds one decision variable an end, whose
            sign picks it.
        obstacles: to keep clear of.
        segment_time: bounds of t1 and t2, s. The upper one is the paper formulation's search box only.

    Raises:
        InvalidProblem: a point is out of reach, too close to the base or inside an obstacle, or a field is not
            one of the above.
    """

    numbers: ClassVar[tuple[str, ...]] = ("start", "goal", "segment_time")

    robot: Robot
    start: tuple[float, ...]
    goal: tuple[float, ...]
    elbow: Elbow = "free"
    obstacles: tuple[Obstacle, ...] = ()
    segment_time: tuple[float, float] = (0.1, 4.0)

    def __post_init__(self) -> None:
        check_choice("elbow", self.elbow, get_args(Elbow))
        check_range("segment_time", self.segment_time)
        check_elbow(self.robot, self.elbow)
        check_obstacles(self.robot, self.obstacles)
        for field in ("start", "goal"):
            check_point(self.robot, self.obstacles, field, getattr(self, field))

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        """Start and goal."""
        return end_conditions(self.robot, trajectory, self.start, self.goal)

    def markers(self) -> tuple[Marker, ...]:
        """Start and goal."""
        return (
            Marker(label="start", points=np.array([self.start]), kind=MarkerKind.START),
            Marker(label="goal", points=np.array([self.goal]), kind=MarkerKind.GOAL),
        )


def end_conditions(
    robot: Robot, trajectory: Trajectory, start: tuple[float, ...], goal: tuple[float, ...]
) -> list[tuple[Constraint, FloatArray]]:
    """That the tool starts at ``start`` and ends at ``goal`` (m)."""
    ends = trajectory.breakpoints[[0, -1]]
    tool = trajectory.samples(ends, robot).tool
    return [
        (end_point(name, tool[i, :], point), ends[i : i + 1])
        for i, (name, point) in enumerate((("start", start), ("goal", goal)))
    ]
