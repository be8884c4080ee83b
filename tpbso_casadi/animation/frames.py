"""The frames of an animation."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from problems import Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from tpbso_casadi.figures.scene import Course, courses_of, extent_of
from tpbso_casadi.figures.space_scene import Scene
from tpbso_casadi.planning import Motion

FRAME_COUNT = 121
PLAYED_SECONDS = 4.0  # whatever the motion takes: most last less than a second


@dataclass(frozen=True)
class Frames:
    """The postures of a motion and its surroundings, for any animation.

    Attributes:
        problem: whose arm, obstacles and task are drawn.
        trajectory: of the joints.
        times: (n,), s.
        joints: where base, joints and tip are, (n, frames, dim), m.
        notes: times in s, and what is written from then on.
        clearance: what is proven and found of the distance from obstacles over all of it; empty where nothing is.
        seconds: that a player takes; fewer or more than the motion, where that is too short or too long to be watched.
    """

    problem: Criteria
    trajectory: Trajectory
    times: FloatArray
    joints: FloatArray
    notes: tuple[tuple[float, str], ...] = ()
    clearance: str = ""
    seconds: float = PLAYED_SECONDS

    @property
    def duration(self) -> float:
        """Of the motion, s."""
        return float(self.times[-1])

    @property
    def task_points(self) -> FloatArray:
        """The points that the tip has to reach, (p, dim), m; none where the task has none."""
        return np.vstack([np.empty((0, self.problem.robot.dim)), *(marker.points for marker in self.problem.markers())])

    @cached_property
    def courses(self) -> tuple[Course, ...]:
        """Where the obstacles that move are at these times."""
        return courses_of(self.problem.scenery, self.times)

    @cached_property
    def theta(self) -> FloatArray:
        """Joint angles, (n, dof), rad."""
        return self.trajectory.at(self.times)

    @cached_property
    def scene(self) -> Scene:
        """Robot and surroundings in space."""
        return Scene(self.problem.robot, self.problem.scenery, self.problem.markers(), self.courses)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of everything drawn in the plane, with some padding, m."""
        return extent_of(self.problem, self.joints, self.task_points, self.courses)


def frames_of(motion: Motion, count: int = FRAME_COUNT) -> Frames:
    """The postures of a motion at ``count`` equally spaced times."""
    times = np.linspace(0.0, motion.trajectory.duration, count)
    return Frames(motion.criteria, motion.trajectory, times, motion.joint_positions(times))


def judged_frames(motion: Motion, count: int = FRAME_COUNT) -> Frames:
    """The same, with what the motion's verdicts say of its clearance."""
    return replace(frames_of(motion, count), clearance=motion.clearance_in_words)
