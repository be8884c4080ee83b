"""What of the plane a picture shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.assembly.criteria import Criteria
from problems.base.matrix import FloatArray
from problems.scene.obstacle import standing
from tpbso_casadi.figures.courses import Course

PADDING = 0.06  # around everything drawn, of its larger side


def extent_of(
    problem: Criteria, joints: FloatArray, points: FloatArray, courses: Sequence[Course] = ()
) -> tuple[float, float, float, float]:
    """Left, right, bottom and top of everything drawn in the plane, with some padding, m.

    Obstacles that move are shown as far as the arm reaches.

    Args:
        problem: whose arm and obstacles are drawn.
        joints: where base, joints and tip are, (n, frames, 2), m.
        points: that the tip has to reach, (p, 2), m.
        courses: of the obstacles that move.
    """
    robot = problem.robot
    boxes = [obstacle.bounding_box() for obstacle in standing(problem.obstacles)]
    thickest = max((float(body.radius) for body in robot.bodies), default=0.0)
    base, reach = np.array(robot.base), robot.reach()[1] + thickest
    boxes += [course.within(base - reach, base + reach) for course in courses]
    places = joints.reshape(-1, 2)
    shown = np.vstack([places - thickest, places + thickest, points, *boxes])
    lower, upper = shown.min(axis=0), shown.max(axis=0)
    padding = PADDING * float((upper - lower).max())
    return lower[0] - padding, upper[0] + padding, lower[1] - padding, upper[1] + padding
