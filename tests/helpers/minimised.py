"""What is minimised of motions between two postures, as tests state it."""

from __future__ import annotations

from problems.objectives import OBJECTIVES, Objective
from problems.polish import Deviations, Integrals, Minimised
from problems.robots import Robot


def minimised(motions: Deviations, robot: Robot, objective: Objective = OBJECTIVES["time"]) -> Minimised:
    """An objective of motions that may take ten times as long as the direct one."""
    integrals = Integrals.of(objective, robot)
    assert integrals is not None
    return Minimised(motions, integrals, (0.0, 10.0 * motions.direct.duration))
