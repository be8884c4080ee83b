"""Motions with certificates: straight moves, from rest to rest, of the core's robots among obstacles."""

from __future__ import annotations

import json
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from helpers.core_robots import SCENE, postures, robot_of

from problems import OBJECTIVES
from problems.assembly import Criteria, certificate_of
from problems.base import InvalidProblem
from problems.certify import check_certificate as checker
from problems.certify import exact_time_scale
from problems.limits import limits_of
from problems.motions import Trajectory
from problems.robots import SpatialArm
from problems.scene import Box, ConstantVelocity, MovingObstacle, Obstacle
from problems.tasks import Joints, Move

Content = dict[str, Any]
FAR = {"upright": (2, 3, 6), "sliding": (0, 1, 2, 4), "bars": (1, 3, 4), "fork": (1, 3, 4)}  # obstacles
CART = MovingObstacle(
    Box(center=(0.0, 0.0, 0.0), size=(0.2, 0.2, 0.2), name="cart"),
    ConstantVelocity((0.5, 0.2, 0.0), (-3.0, 0.5, 0.3)),
    margin_rate=0.01,
)
SMOOTHSTEP = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])[:, None]


def scene_of(name: str) -> tuple[Obstacle, ...]:
    """Solids of several shapes, one of them on its way."""
    return (*(SCENE[number] for number in FAR[name]), CART)


def straight(robot: SpatialArm, start: np.ndarray, goal: np.ndarray, slower: float = 1.001) -> Trajectory:
    """A move of degree 5, in two pieces, a little slower than the limits of the joints allow."""
    shape = start * (np.arange(6) == 0)[:, None] + SMOOTHSTEP * (goal - start)
    whole = Trajectory.from_pieces(np.array([1.0]), [shape])
    limits = [limit for limit in limits_of(robot, ()) if limit.scales_with_time]
    motion = whole.time_scaled(slower * exact_time_scale(limits, whole))
    middle = 0.4 * motion.duration
    return motion.part(0.0, middle).followed_by(motion.part(middle, motion.duration))


def criteria_of(robot: SpatialArm, motion: Trajectory, obstacles: tuple[Obstacle, ...]) -> Criteria:
    """Of a move between the ends of a motion."""
    start, goal = (Joints(tuple(row)) for row in motion.at(motion.breakpoints[[0, -1]]).tolist())
    task = Move(robot, start, (goal,), obstacles=obstacles)
    return Criteria(task=task, objective=OBJECTIVES["time"], limits=limits_of(robot, obstacles))


def draw(robot: SpatialArm, seed: int) -> Trajectory:
    """A move between two random postures."""
    rng = np.random.default_rng(seed)
    start, goal = postures(robot, rng, 2)
    return straight(robot, start, start + rng.uniform(0.05, 0.4) * (goal - start))


@dataclass(frozen=True, eq=False)
class Case:
    """A motion that is clear, and its certificate."""

    robot: SpatialArm
    obstacles: tuple[Obstacle, ...]
    motion: Trajectory
    content: dict[str, Any]


@cache
def case(name: str, number: int = 0) -> Case:
    """The motion of that number, from 0 on, of a robot among obstacles; of those at random that are clear."""
    robot, obstacles = robot_of(name), scene_of(name)
    for seed in range(1_000):
        motion = draw(robot, seed)
        with suppress(InvalidProblem):
            content = certificate_of(criteria_of(robot, motion, obstacles), motion)
            if number == 0:
                return Case(robot, obstacles, motion, content)
            number -= 1
    raise AssertionError("no motion is clear")


def accepted(content: dict[str, Any]) -> bool:
    """Whether the checker accepts the content as it is in a file."""
    try:
        checker.check(json.loads(json.dumps(content)))
    except checker.RefusedError:
        return False
    return True


def changed(content: Content, *path: Any, value: Any) -> Content:
    """The content with another value at a place of its stage; a function makes it of the one that is there."""
    new = deepcopy(content)
    place, path = (new, path) if path[0] in ("format", "version", "stages") else (new["stages"][0], path)
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value(place[path[-1]]) if callable(value) else value
    return new
