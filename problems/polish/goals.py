"""Postures at a goal that a motion may choose among."""

from __future__ import annotations

import numpy as np

from problems.base import FloatArray
from problems.robots import Robot
from problems.tasks import Place

POSTURES = 200  # that are drawn where the goal is a pose


def postures_around(robot: Robot, place: Place, count: int = POSTURES) -> FloatArray:
    """Postures at a place: its own, and for a pose others around that, equal in every call, (n, dof), rad."""
    rng = np.random.default_rng(0)
    choices = place.choices(robot)
    low, high = np.array([(choice.lower, choice.upper) for choice in choices]).reshape(-1, 2).T
    chosen = np.vstack([(low + high) / 2.0, rng.uniform(low, high, (count if choices else 0, len(choices)))])
    postures, reached = place.postures(robot, chosen)
    for joint, (least, most) in enumerate(robot.limits.position or ()):
        reached &= (postures[:, joint] >= least) & (postures[:, joint] <= most)
    reached[0] = True
    return postures[reached]
