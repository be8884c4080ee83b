"""Postures at the stops of a sequence: where a place leaves a choice, and where the tool is led to."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from problems import InvalidProblem, Robot
from problems.base import FloatArray
from problems.motions import JointPath
from problems.tasks import Following, Joints, Place, ToolPath
from problems.timing import least_durations

DRAWN = 64  # postures of a place that states none, of which the nearest are kept
MOST_ENDS = 6  # of a way of the tool, toward which the joints are led
FREEDOMS = {2: 2, 3: 6}  # of joints, by the robot's dimensions, with which a way of the tool leaves no choice


def bounds_between(robot: Robot, before: FloatArray, after: FloatArray) -> FloatArray:
    """Least durations of the slowest joint from each posture (n, dof) to each of others (m, dof): (n, m), s."""
    ways = (after[None] - before[:, None]).reshape(-1, robot.dof)
    return np.asarray(least_durations(ways, robot.limits).max(axis=1).reshape(len(before), len(after)))


def postures_at(goal: Place, robot: Robot, obstacles: Sequence[Any], key: str) -> FloatArray:
    """Clear postures at a place, (n, dof).

    Raises:
        InvalidProblem: there is none.
    """
    if isinstance(goal, Joints):
        return np.array([goal.values])
    branches = [place.branch_angles for place in goal.branches(robot, obstacles, None, key)]
    if all(branches):
        return np.array(branches)
    choices = goal.choices(robot)
    low, high = (np.array([getattr(choice, end) for choice in choices]) for end in ("lower", "upper"))
    drawn = np.random.default_rng(1).uniform(low, high, (DRAWN, len(choices)))
    postures, there = goal.postures(robot, drawn)
    return np.asarray(postures[there])


def led_along(way: ToolPath, robot: Robot, posture: FloatArray, stage: Any) -> JointPath:
    """The joints along a way of the tool, the shortest way; where that ends, toward postures at the way's end.

    Raises:
        InvalidProblem: the tool cannot be led along.
    """
    accuracies = stage.accuracy, stage.angular_accuracy
    try:
        return Following(way, robot).joints(posture, *accuracies)
    except InvalidProblem as error:
        for toward in _ends_of(way, robot, posture):
            with suppress(InvalidProblem):
                return Following(way, robot, toward).joints(posture, *accuracies)
        raise error


def _ends_of(way: ToolPath, robot: Robot, posture: FloatArray) -> FloatArray:
    """Postures with the tool at the end of a way, the nearest first, (n, dof); where that leaves a choice at all."""
    (end,) = way.places(np.ones(1))
    if robot.dof <= FREEDOMS[robot.dim]:
        return np.empty((0, robot.dof))
    try:
        found = postures_at(end, robot, (), "goal")
    except InvalidProblem:
        return np.empty((0, robot.dof))
    nearest = np.argsort(np.abs(found - posture).max(axis=1), kind="stable")
    return np.asarray(found[nearest[:MOST_ENDS]])
