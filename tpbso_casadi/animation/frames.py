"""The frames of an animation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

import numpy as np

from problems import Trajectory
from problems.assembly import Criteria
from problems.base import FloatArray
from tpbso_casadi.figures.scene import Course, courses_of, extent_of
from tpbso_casadi.figures.space_scene import Scene
from tpbso_casadi.planning import JudgedMotion

FRAME_COUNT, MOST_FRAMES, FRAMES_PER_SECOND = 121, 241, 20  # of a motion; long ones have more
LEAST_NOTE = 0.02  # of the motion, for which a note is shown
Spans: TypeAlias = Sequence[tuple[float, float]]
LONGEST_PLAYED = 20.0  # s: what takes longer is played faster


@dataclass(frozen=True)
class Frames:
    """The postures of a motion and its surroundings, for any animation.

    Attributes:
        criteria: whose arm, obstacles and task are drawn.
        trajectory: of the joints.
        times: (n,), s.
        joints: where base, joints and tip are, (n, frames, dim), m.
        notes: times in s, and what is written from then on.
        clearance: what is proven and found of the distance from obstacles over all of it; empty where nothing is.
        seconds: that a player takes: those of the motion, unless it is long.
        broken: by the names of limits, from when to when they are broken, s.
    """

    criteria: Criteria
    trajectory: Trajectory
    times: FloatArray
    joints: FloatArray
    notes: tuple[tuple[float, str], ...] = ()
    clearance: str = ""
    seconds: float = LONGEST_PLAYED
    broken: Mapping[str, Spans] = field(default_factory=dict)

    @property
    def duration(self) -> float:
        """The duration of the motion, s."""
        return float(self.times[-1])

    @property
    def task_points(self) -> FloatArray:
        """The points that the tip has to reach, (p, dim), m; none where the task has none."""
        return np.vstack(
            [np.empty((0, self.criteria.robot.dim)), *(marker.points for marker in self.criteria.task.markers())]
        )

    @cached_property
    def courses(self) -> tuple[Course, ...]:
        """The places of the moving obstacles at these times."""
        return courses_of(self.criteria.task.scenery, self.times)

    @cached_property
    def theta(self) -> FloatArray:
        """Joint angles, (n, dof), rad."""
        return self.trajectory.at(self.times)

    @cached_property
    def scene(self) -> Scene:
        """Robot and surroundings in space."""
        return Scene(self.criteria.robot, self.criteria.task.scenery, self.criteria.task.markers(), self.courses)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of everything drawn in the plane, with some padding, m."""
        return extent_of(self.criteria, self.joints, self.task_points, self.courses)


def frames_of(motion: JudgedMotion, count: int = FRAME_COUNT) -> Frames:
    """The postures of a motion at ``count`` equally spaced times."""
    times = np.linspace(0.0, motion.trajectory.duration, count)
    seconds = min(motion.trajectory.duration, LONGEST_PLAYED)
    return Frames(motion.criteria, motion.trajectory, times, motion.joint_positions(times), seconds=seconds)


def judged_frames(motion: JudgedMotion) -> Frames:
    """Frames of a motion with its clearance, and with the times at which it breaks limits."""
    wanted = int(np.ceil(FRAMES_PER_SECOND * motion.trajectory.duration)) + 1
    frames = frames_of(motion, max(FRAME_COUNT, min(wanted, MOST_FRAMES)))
    notes = broken_notes(motion.broken_spans, frames.duration)
    return replace(frames, clearance=motion.clearance_in_words, broken=motion.broken_spans, notes=notes)


def broken_notes(broken: Mapping[str, Spans], duration: float) -> tuple[tuple[float, str], ...]:
    """Notes on the limits that are broken, from when on; short breaks are shown a little longer."""
    least = LEAST_NOTE * duration
    lasting = [(start, max(end, start + least), name) for name, spans in broken.items() for start, end in spans]
    times = sorted({time for start, end, _ in lasting for time in (start, end)})
    told = [(time, dict.fromkeys(name for start, end, name in lasting if start <= time < end)) for time in times]
    return tuple((time, f"broken now: {', '.join(names)}" if names else "") for time, names in told)
