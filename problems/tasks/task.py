"""The interface of tasks: the statement, and the conditions on a finished motion."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Self

import numpy as np

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray
from problems.limits.constraint import Constraint
from problems.limits.duration import DurationBounds
from problems.motions.trajectory import Trajectory
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle
from problems.tasks.drawing import Marker
from problems.tasks.place import Place


class Task(Statement, ABC):
    """A statement: a robot, what it has to do, and what it has to keep clear of. A subclass is a frozen dataclass.

    Attributes:
        equations: where the paper states a constraint of this task, by its name, if elsewhere than for other tasks.
    """

    equations: ClassVar[Mapping[str, str]] = MappingProxyType({})

    robot: Robot
    obstacles: tuple[Obstacle, ...]

    @property
    def end_velocities(self) -> FloatArray:
        """Joint velocities at both ends of the motion, (2, dof), rad/s; at rest by default."""
        return np.zeros((2, self.robot.dof))

    @property
    def stay(self) -> float:
        """How long after its arrival the robot has to stay clear of what moves, s; not by default."""
        return 0.0

    @property
    def end_accelerations(self) -> FloatArray:
        """Joint accelerations before the start and after the end, (2, dof), rad/s^2; zero by default."""
        return np.zeros((2, self.robot.dof))

    @property
    def crowded(self) -> bool:
        """Whether there is anything to keep clear of: an obstacle, or the robot itself."""
        return bool(self.obstacles) or self.robot.self_collision

    @property
    def is_timed(self) -> bool:
        """Whether an obstacle moves, so that it matters when the robot is where."""
        return any(obstacle.moves for obstacle in self.obstacles)

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

    @property
    def passes_nothing(self) -> bool:
        """Whether a motion is bound by its two ends alone, and by nothing on the way; not by default."""
        return False

    @property
    def start_posture(self) -> FloatArray | None:
        """The joint angles at the start, (dof,), rad, where they are given; None where they are not."""
        return None

    @property
    def last_places(self) -> tuple[Place, ...]:
        """The places of which one is the end, where the motion rests at one and nothing else is asked; else none."""
        return ()

    @property
    def given_postures(self) -> FloatArray:
        """Postures that the statement gives, between which joints have to turn, (n, dof), rad; none by default."""
        return np.empty((0, self.robot.dof))

    def at_free_times(self) -> Self:
        """The same task for a motion that is timed anew along its path: nothing is asked at given times any more."""
        return self

    def markers(self) -> tuple[Marker, ...]:
        """Positions that the tool has to reach, for drawing; none by default."""
        return ()
