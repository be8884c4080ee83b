"""Postures at the ends that a motion may choose among."""

from __future__ import annotations

import numpy as np

from problems.base import FloatArray
from problems.robots import Robot
from problems.tasks import Elbow, Place

POSTURES = 200  # that are drawn where a place leaves joints to choose
ELBOWS: dict[Elbow, tuple[float, ...]] = {"free": (1.0, -1.0), "up": (1.0,), "down": (-1.0,)}
TURN = 2.0 * np.pi


def postures_around(robot: Robot, place: Place, elbow: Elbow = "free", count: int = POSTURES) -> FloatArray:
    """Postures at a place: its own, and others that it leaves to choose, equal in every call, (n, dof), rad."""
    rng = np.random.default_rng(0)
    choices = place.choices(robot)
    low, high = np.array([(choice.lower, choice.upper) for choice in choices]).reshape(-1, 2).T
    chosen = np.vstack([(low + high) / 2.0, rng.uniform(low, high, (count if choices else 0, len(choices)))])
    branches = ELBOWS[elbow] if place.chosen_by_inverse_kinematics else (1.0,)
    found = [place.postures(robot, chosen, branch) for branch in branches]
    postures, reached = (np.concatenate(part) for part in zip(*found, strict=True))
    for joint, (least, most) in enumerate(robot.limits.position or ()):
        reached &= (postures[:, joint] >= least) & (postures[:, joint] <= most)
    reached[0] = True
    return np.asarray(postures[reached])


def in_nearest_turns(robot: Robot, theta: FloatArray, near: FloatArray) -> FloatArray:
    """Angles (n, dof) of joints that turn, in the turns nearest to others (dof,), rad, where their ranges allow it."""
    turned = theta - TURN * np.round((theta - near) / TURN)
    if robot.limits.position is None:
        return np.asarray(turned)
    low, high = np.array(robot.limits.position).T
    return np.where((turned < low) | (turned > high), theta, turned)
