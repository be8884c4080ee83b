"""The postures of a motion at equal steps of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems import PathFollowing, PointToPoint, Problem
from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.planning.motion import Motion

FRAMES = 121


@dataclass(frozen=True)
class Frames:
    """What every moving picture shows.

    Attributes:
        problem: whose arm, obstacles and task are drawn.
        times: (n,), s.
        joints: where base, joints and tip are, (n, k + 1, 2), m.
    """

    problem: Problem
    times: FloatArray
    joints: FloatArray

    @property
    def duration(self) -> float:
        """Of the motion, s."""
        return float(self.times[-1])

    @property
    def task_points(self) -> FloatArray:
        """The points that the tip has to reach, (p, 2), m."""
        problem = self.problem
        if isinstance(problem, PathFollowing):
            return np.asarray(problem.path.array)
        assert isinstance(problem, PointToPoint)
        return np.array([problem.start, problem.goal])

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of everything drawn, with a little room, m."""
        shown = [self.joints.reshape(-1, 2), self.task_points]
        for obstacle in self.problem.obstacles:
            largest = max(obstacle.semi_axes)
            shown += [np.array([obstacle.center]) - largest, np.array([obstacle.center]) + largest]
        lower, upper = np.vstack(shown).min(axis=0), np.vstack(shown).max(axis=0)
        room = 0.06 * float((upper - lower).max())
        return lower[0] - room, upper[0] + room, lower[1] - room, upper[1] + room


def frames_of(motion: Motion, count: int = FRAMES) -> Frames:
    """Look at a motion at so many times."""
    times = np.linspace(0.0, motion.trajectory.duration, count)
    x, y = motion.problem.arm.joint_positions(motion.trajectory.samples(times).theta)
    return Frames(motion.problem, times, np.stack([as_array(x), as_array(y)], axis=2))
