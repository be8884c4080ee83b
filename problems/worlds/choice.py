"""The world of a robot among obstacles: in the compiled core where that knows them, else by formulas of pairs."""

from __future__ import annotations

from collections.abc import Sequence

from problems.core import CompiledWorld, World
from problems.limits import Limit
from problems.robots import Robot
from problems.scene import Obstacle
from problems.worlds.pair_world import PairWorld


def world_of(robot: Robot, obstacles: Sequence[Obstacle], limits: Sequence[Limit]) -> World:
    """The world of a robot among obstacles.

    Args:
        robot: with its margins.
        obstacles: around it.
        limits: on distances, which are its pairs where the core does not know the robot.
    """
    return CompiledWorld.of(robot, obstacles) or PairWorld.of(robot, limits)
