"""The interface of tasks: the statement, and the conditions on a finished motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray
from problems.limits.constraint import Constraint
from problems.limits.duration import DurationBounds
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle
from problems.tasks.drawing import Marker


class Task(Statement, ABC):
    """A statement: a robot, what it has to do, and what it has to keep clear of. A subclass is a frozen dataclass.

    Attributes:
        equations: where the paper states a constraint of this task, by its name, if elsewhere than for other tasks.
    """

    equations: ClassVar[Mapping[str, str]] = MappingProxyType({})

    robot: Robot
    obstacles: tuple[Obstacle, ...]

    @property
    def crowded(self) -> bool:
        """Whether there is anything to keep clear of: an obstacle, or the robot itself."""
        return bool(self.obstacles) or self.robot.self_collision

    @abstractmethod
    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        """The task's own conditions on a finished motion: numeric constraints, and the times of their rows in s."""

    @property
    def duration_bounds(self) -> DurationBounds | None:
        """The bounds of the durations of the finished motion; None where nothing is promised."""
        return None

    def durations(self, trajectory: Trajectory) -> FloatArray:
        """The durations of a finished motion to which these bounds apply, (n,), s; that of the whole by default."""
        return np.array([trajectory.duration])

    def markers(self) -> tuple[Marker, ...]:
        """Positions that the tool has to reach, for drawing; none by default."""
        return ()
