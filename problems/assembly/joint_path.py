"""A given path in joint space: its least time, and what the motion is judged by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from problems.assembly.criteria import Criteria
from problems.limits import LimitKind, limits_of
from problems.motions.joint_path import JointPath
from problems.motions.trajectory import Trajectory
from problems.objectives import OBJECTIVES
from problems.tasks.paths.joint_path import JointFollowing
from problems.timing.retime import retime


def joint_following(task: JointFollowing, limits: Sequence[LimitKind] = ()) -> JointFollowingCriteria:
    """What a task states; time is the objective.

    Args:
        task: the statement: robot, path, obstacles.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.
    """
    return JointFollowingCriteria(
        task=task, objective=OBJECTIVES["time"], limits=limits_of(task.robot, task.obstacles, limits)
    )


@dataclass(frozen=True, kw_only=True)
class JointFollowingCriteria(Criteria):
    """Run a given path."""

    free_timing: ClassVar[bool] = True

    task: JointFollowing

    def path_of(self, trajectory: Trajectory) -> JointPath:
        """The given path, of a lower degree than any motion along it."""
        return self.task.path

    def given_motion(self) -> Trajectory:
        """The path in the least time; slower where other limits or a total time need it and both ends are at rest.

        Raises:
            InvalidProblem: the path stands still or jumps, or no motion has its velocities at the ends.
        """
        trajectory = retime(self.task.path, self.robot.limits, self.task.rates, chain=self.robot.rigid_chain)
        scale = 1.0 if self.task.end_velocities.any() else self.safe_time_scale(trajectory)
        return trajectory if scale <= 1.0 else trajectory.time_scaled(scale)
