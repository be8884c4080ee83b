"""Postures of an arm that reach a pose, by the core, without anything around the arm."""

from __future__ import annotations

from functools import lru_cache

from problems.base import CACHE_SIZE
from problems.core.compiled import core
from problems.robots import NewtonSteps, SpatialArm, Steps


def steps_of(robot: SpatialArm) -> Steps:
    """Damped Newton steps of the robot, by its own class where that moves joints in its own way."""
    return _known(robot.geometry) if type(robot) is SpatialArm else NewtonSteps(robot)


@lru_cache(maxsize=CACHE_SIZE)
def _known(geometry: SpatialArm) -> Steps:
    return core().steps(geometry)
