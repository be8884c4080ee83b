"""Checks of what a user states; each raises InvalidProblem with the field and one line of reason."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.ranges import COORDINATES, TIMES, check_within, shown
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle


def check_choice(field: str, value: str, known: Collection[str]) -> None:
    """The value is one of the known ones."""
    if value not in known:
        raise InvalidProblem(field, f"{value!r} is not one of {', '.join(known)}")


def check_range(field: str, bounds: tuple[float, float]) -> None:
    """0 < lower < upper, both durations in s that can be computed with."""
    lower, upper = bounds
    if not 0.0 < lower < upper < np.inf:
        raise InvalidProblem(field, f"0 < {shown(lower)} < {shown(upper)} does not hold, or is not finite")
    check_within(field, bounds, TIMES, "s")


def check_at_least(field: str, value: int | None, least: int, what: str = "") -> None:
    """The value, if there is one, is no fewer than ``least``."""
    if value is not None and value < least:
        raise InvalidProblem(field, f"{value} is fewer than {least}{what}")


def check_obstacles(robot: Robot, obstacles: Sequence[Obstacle]) -> None:
    """The base of the robot lies in no obstacle."""
    for obstacle in obstacles:
        if obstacle.contains(robot.base):
            raise InvalidProblem("obstacles", f"the base lies inside the obstacle at {obstacle.place}")


def check_point(
    robot: Robot, obstacles: Sequence[Obstacle], field: str, point: tuple[float, ...], name: str = ""
) -> None:
    """The tip can be at a point: within reach, not too close, in no obstacle."""
    check_within(field, point, COORDINATES, "m")
    distance = float(np.hypot.reduce(np.array(point) - robot.base))
    inner, outer = robot.reach()
    place = f"{name}{point} is {distance:.6g} m from the base"
    if not distance <= outer:
        raise InvalidProblem(field, f"{place}, out of reach: the arm reaches {outer:.6g} m")
    if distance < inner:
        raise InvalidProblem(field, f"{place}, too close: the arm reaches from {inner:.6g} m on")
    for obstacle in obstacles:
        if obstacle.contains(point):
            raise InvalidProblem(field, f"{name}{point} lies inside the obstacle at {obstacle.place}")
