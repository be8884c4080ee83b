"""Two postures of an arm with a wall between them, and objectives of motions, as tests of the polish state them."""

from __future__ import annotations

import numpy as np

from problems.objectives import OBJECTIVES, Objective
from problems.polish import Deviations, IntegrandFunctions, PolishObjective
from problems.robots import Robot
from problems.scene import Box

START, GOAL = np.array([-0.8, 0.6, 0.0, 0.9, 0.0, 0.5, 0.0]), np.array([0.8, 0.6, 0.0, 0.9, 0.0, 0.5, 0.0])
ASIDE = np.array([0.1, 0.9, 0.2, 0.7, 0.1, 0.4, 0.3])
WALL = Box(center=(0.65, -0.2, 0.35), size=(0.4, 0.04, 1.2))


def polish_objective(motions: Deviations, robot: Robot, objective: Objective = OBJECTIVES["time"]) -> PolishObjective:
    """An objective of motions that may take ten times as long as the direct one."""
    integrand = IntegrandFunctions.of(objective, robot)
    assert integrand is not None
    return PolishObjective(motions, integrand, (0.0, 10.0 * motions.direct.duration))
