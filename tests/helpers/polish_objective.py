"""Objectives of motions between two postures, as tests state them."""

from __future__ import annotations

from problems.objectives import OBJECTIVES, Objective
from problems.polish import Deviations, IntegrandFunctions, PolishObjective
from problems.robots import Robot


def polish_objective(motions: Deviations, robot: Robot, objective: Objective = OBJECTIVES["time"]) -> PolishObjective:
    """An objective of motions that may take ten times as long as the direct one."""
    integrand = IntegrandFunctions.of(objective, robot)
    assert integrand is not None
    return PolishObjective(motions, integrand, (0.0, 10.0 * motions.direct.duration))
