"""Postures at the stops of a sequence: where a place leaves a choice, and where the tool is led to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from problems import InvalidProblem, Robot
from problems.base import FloatArray
from problems.motions import JointPath
from problems.robots import SpatialArm
from problems.tasks import Following, FreeTurns, Joints, Place, Surroundings, ToolPath
from problems.timing import least_along, least_durations
from tpbso_casadi.scenario import LedStage, MovingStage

DRAWN = 64  # postures of a place that states none, of which the nearest are kept
MOST_WAYS = 3  # of the tool that is free to turn, from each posture
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


def ways_along(
    way: ToolPath, robot: Robot, posture: FloatArray, stage: MovingStage, around: Callable[[], Surroundings]
) -> list[JointPath]:
    """Paths of the joints along a way of the tool; several where an axis leaves the tool free to turn.

    Args:
        way: of the tool.
        robot: that moves.
        posture: in which it begins, (dof,).
        stage: with its accuracies.
        around: tells what postures keep clear of, where that is asked.

    Raises:
        InvalidProblem: the tool cannot be led along.
    """
    assert isinstance(stage, LedStage)
    if way.free is None:
        return [led_along(way, robot, posture, stage)]
    assert isinstance(robot, SpatialArm)
    turns = FreeTurns(way, robot, around())
    for laws in (turns.even(posture), turns.searched(posture)):
        found = []
        for law in laws:
            with suppress(InvalidProblem):
                found.append(Following(law, robot).joints(posture, stage.accuracy, stage.angular_accuracy))
        if found:
            return sorted(found, key=lambda path: least_along(path, robot.limits))[:MOST_WAYS]
    return [led_along(way, robot, posture, stage)]


def led_along(way: ToolPath, robot: Robot, posture: FloatArray, stage: LedStage) -> JointPath:
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
