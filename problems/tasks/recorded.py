"""The task of running a motion exactly as it is stated."""

from __future__ import annotations

from dataclasses import dataclass

from problems.base import TIMES, FloatArray, InvalidProblem, check_fields, check_within
from problems.limits import Constraint
from problems.motions import Trajectory
from problems.robots import Robot
from problems.scene import Obstacle
from problems.tasks.checks import check_obstacles
from problems.tasks.move import rate_conditions
from problems.tasks.task import Marker, Task, end_markers


@dataclass(frozen=True)
class RecordedMotion(Task):
    """The task to run a motion stated in time: nothing of it is planned, all of it is judged.

    Args:
        robot: that moves.
        motion: of its joints; it has to begin and to end at rest.
        obstacles: to keep clear of; their clock is that of the motion.
        joined: how it was made of what was stated, in words.
        remarks: what is known of the statement that no verdict speaks of, a line each.
        stay: how long after its end the robot, which stands then, has to stay clear of obstacles that move, s.
        without: names of limits by which it is not judged.
        notes: on how the statement was read, a line each.

    Raises:
        InvalidProblem: the motion is of another number of joints, or has a number that is none.
    """

    robot: Robot
    motion: Trajectory
    obstacles: tuple[Obstacle, ...] = ()
    joined: str = "polynomial pieces"
    remarks: tuple[str, ...] = ()
    stay: float = 0.0
    without: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        joints = self.motion.coefficients.shape[2]
        if joints != self.robot.dof:
            raise InvalidProblem("joints", f"a motion of {joints} joints for a robot of {self.robot.dof}")
        if not self.motion.is_finite:
            raise InvalidProblem("motion", "a number of it, or of its derivatives, is too large to compute with")
        check_within("stay", (self.stay,), (0.0, TIMES[1]), "s")
        check_obstacles(self.robot, self.obstacles)

    @property
    def given_postures(self) -> FloatArray:
        return self.motion.at(self.motion.breakpoints)

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        return rate_conditions(self, trajectory, 1)

    def markers(self) -> tuple[Marker, ...]:
        return end_markers(self.robot, self.motion.at(self.motion.breakpoints[[0, -1]]))
