"""An arm without anything around it, in the core: postures that reach a pose."""

from __future__ import annotations

from functools import lru_cache

from problems.core.implementation import core
from problems.robots import NewtonSteps, SpatialArm, Steps, geometry_of

KEPT = 16  # arms


def steps_of(robot: SpatialArm) -> Steps:
    """Damped Newton steps of the robot, whose joints may move it in a way of its own."""
    return _known(geometry_of(robot)) if type(robot) is SpatialArm else NewtonSteps(robot)


@lru_cache(maxsize=KEPT)
def _known(geometry: SpatialArm) -> Steps:
    return core().steps(geometry)
