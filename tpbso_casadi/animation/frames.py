"""The postures of a motion at equal steps of time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems import Trajectory
from problems.assembly.criteria import Criteria
from problems.base.matrix import FloatArray
from tpbso_casadi.figures.space.scene import Scene
from tpbso_casadi.planning.motion import Motion

FRAME_COUNT = 121
PADDING = 0.06  # around everything drawn, of its larger side


@dataclass(frozen=True)
class Frames:
    """The postures of a motion and its surroundings, for any animation.

    Attributes:
        problem: whose arm, obstacles and task are drawn.
        trajectory: of the joints.
        times: (n,), s.
        joints: where base, joints and tip are, (n, frames, dim), m.
    """

    problem: Criteria
    trajectory: Trajectory
    times: FloatArray
    joints: FloatArray

    @property
    def duration(self) -> float:
        """Of the motion, s."""
        return float(self.times[-1])

    @property
    def task_points(self) -> FloatArray:
        """The points that the tip has to reach, (p, dim), m; none where the task has none."""
        return np.vstack([np.empty((0, self.problem.robot.dim)), *(marker.points for marker in self.problem.markers())])

    @cached_property
    def theta(self) -> FloatArray:
        """Joint angles, (n, dof), rad."""
        return self.trajectory.at(self.times)

    @cached_property
    def scene(self) -> Scene:
        """Robot and surroundings in space."""
        return Scene(self.problem.robot, self.problem.obstacles, self.problem.markers())

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of everything drawn in the plane, with some padding, m."""
        boxes = [obstacle.bounding_box() for obstacle in self.problem.obstacles]
        thickest = max((float(body.radius) for body in self.problem.robot.bodies), default=0.0)
        joints = self.joints.reshape(-1, 2)
        points = np.vstack([joints - thickest, joints + thickest, self.task_points, *boxes])
        lower, upper = points.min(axis=0), points.max(axis=0)
        padding = PADDING * float((upper - lower).max())
        return lower[0] - padding, upper[0] + padding, lower[1] - padding, upper[1] + padding


def frames_of(motion: Motion, count: int = FRAME_COUNT) -> Frames:
    """The postures of a motion at ``count`` equally spaced times."""
    times = np.linspace(0.0, motion.trajectory.duration, count)
    return Frames(motion.criteria, motion.trajectory, times, motion.joint_positions(times))
