"""What the player is told of a motion in the plane alone."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems.scene.obstacle import standing
from tpbso_casadi.animation.content import rounded
from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.courses import Course


def content_of(frames: Frames) -> dict[str, Any]:
    """What is seen of the arm and its surroundings: lengths in m."""
    problem = frames.problem
    return {
        "extent": rounded(np.array(frames.extent)),
        "bodies": [[body.start, body.end, float(body.radius)] for body in problem.robot.bodies if body.radius],
        "obstacles": [rounded(obstacle.outline()) for obstacle in standing(problem.obstacles)],
        "moving": [_moving(course) for course in frames.courses],
    }


def _moving(course: Course) -> dict[str, Any]:
    """An obstacle that moves: its outline as seen from its frame, and origin and first axis of that at each time."""
    return {
        "outline": rounded(course.obstacle.unmoved.outline()),
        "frames": rounded(course.frames[:, :2].reshape(-1, 4)),
        "way": rounded(course.middles),
    }
