"""Postures at a goal, of which any will do."""

from __future__ import annotations

import numpy as np

from problems.base import FloatArray
from problems.robots import Robot
from problems.tasks import Place

AROUND = 200  # postures that are drawn where the goal is a pose


def postures_around(robot: Robot, place: Place) -> FloatArray:
    """Postures at a place: its own, and of a pose others around that, the same ones every time; (n, dof), rad."""
    rng = np.random.default_rng(0)
    choices = place.choices(robot)
    low, high = np.array([(choice.lower, choice.upper) for choice in choices]).reshape(-1, 2).T
    chosen = np.vstack([(low + high) / 2.0, rng.uniform(low, high, (AROUND if choices else 0, len(choices)))])
    found, reached = place.postures(robot, chosen)
    for joint, (least, most) in enumerate(robot.limits.position or ()):
        reached &= (found[:, joint] >= least) & (found[:, joint] <= most)
    reached[0] = True
    return found[reached]
