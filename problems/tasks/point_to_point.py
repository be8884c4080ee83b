"""The paper's point-to-point task."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, get_args

import numpy as np

from problems.base import FloatArray, Operand, check_fields
from problems.limits import SAMPLING_MARGIN, Constraint, DurationBounds, end_point
from problems.motions import Trajectory
from problems.robots import Robot
from problems.scene import Obstacle, standing
from problems.tasks.checks import check_choice, check_obstacles, check_point, check_range
from problems.tasks.place import Elbow, Place, Position, check_elbow, check_holding_at
from problems.tasks.task import Marker, MarkerKind, Task

SEGMENT_TIME_BOX = (0.1, 4.0)  # s, in which t1 and t2 are searched where the task does not bound them


@dataclass(frozen=True)
class PointToPoint(Task):
    """The paper's task to move the tool from rest at ``start`` to rest at ``goal``.

    Args:
        robot: that moves.
        start: tool position at t = 0, m.
        goal: tool position at t = T, m.
        elbow: the branch of inverse kinematics at both ends; ``free`` adds one decision variable an end, whose
            sign picks it.
        obstacles: to keep clear of.
        segment_time: bounds of t1 and t2 in the finished motion, s. If None nothing is promised: the paper formulation
            then searches in ``SEGMENT_TIME_BOX``, of whose two ends the others keep the lower.

    Raises:
        InvalidProblem: a point is out of reach, too close to the base or inside an obstacle, or a field is not
            one of the above.
    """

    numbers: ClassVar[tuple[str, ...]] = ("start", "goal", "segment_time")
    duration_field: ClassVar[str] = "segment_time"

    robot: Robot
    start: tuple[float, ...]
    goal: tuple[float, ...]
    elbow: Elbow = "free"
    obstacles: tuple[Obstacle, ...] = ()
    segment_time: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        check_choice("elbow", self.elbow, get_args(Elbow))
        if self.segment_time is not None:
            check_range("segment_time", self.segment_time)
        check_elbow(self.robot, self.elbow)
        check_obstacles(self.robot, self.obstacles)
        for field, obstacles in (("start", self.obstacles), ("goal", standing(self.obstacles))):
            check_point(self.robot, obstacles, field, getattr(self, field))
            check_holding_at(self.robot, self.elbow, field, getattr(self, field))

    @property
    def passes_nothing(self) -> bool:
        return self.segment_time is None

    @property
    def duration_bounds(self) -> DurationBounds | None:
        """The bounds of t1 and t2, where they are stated."""
        return None if self.segment_time is None else DurationBounds("segment time", "t{}", *self.segment_time)

    def durations(self, trajectory: Trajectory) -> FloatArray:
        """The durations of the segments, t1 and t2, s."""
        return np.diff(trajectory.breakpoints)

    @property
    def least_segment_time(self) -> Operand:
        """The least of t1 and t2 in any formulation, s; symbolic where the task is."""
        bounds = self.duration_bounds
        return SEGMENT_TIME_BOX[0] if bounds is None else bounds.shortest

    @property
    def time_box(self) -> tuple[float, float]:
        """Bounds of t1 and t2 in a search vector, s."""
        bounds = self.duration_bounds
        return SEGMENT_TIME_BOX if bounds is None else bounds.search_box(SAMPLING_MARGIN)

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        return end_conditions(self.robot, trajectory, self.start, self.goal)

    def end_places(self, theta: FloatArray) -> tuple[Place, ...]:
        return Position(self.start), Position(self.goal)

    def markers(self) -> tuple[Marker, ...]:
        return (
            Marker(label="start", points=np.array([self.start]), kind=MarkerKind.START),
            Marker(label="goal", points=np.array([self.goal]), kind=MarkerKind.GOAL),
        )


def end_conditions(
    robot: Robot, trajectory: Trajectory, start: tuple[float, ...], goal: tuple[float, ...]
) -> list[tuple[Constraint, FloatArray]]:
    """The conditions that the tool starts at ``start`` and ends at ``goal`` (m)."""
    ends = trajectory.breakpoints[[0, -1]]
    tool = trajectory.samples(ends, robot).tool
    return [
        (end_point(name, tool[i, :], point, robot.reach()[1]), ends[i : i + 1])
        for i, (name, point) in enumerate((("start", start), ("goal", goal)))
    ]
