"""The three objectives: execution time (8), (19); joint rotation (9), (20); travel length of the tip (10)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca

from problems.base.matrix import Matrix, columns, differences, total
from problems.motions.samples import Samples
from problems.robots.planar import PlanarArm


@dataclass(frozen=True)
class Objective:
    """What is minimised.

    Attributes:
        name: as in a scenario file.
        symbol: as in the paper.
        equation: where the paper states it.
        unit: of its value.
        of: the formula: arm and samples of a motion -> scalar.
    """

    name: str
    symbol: str
    equation: str
    unit: str
    of: Callable[[PlanarArm, Samples], Matrix]


def execution_time(arm: PlanarArm, samples: Samples) -> Matrix:
    """(8) T = t_1 + t_2, (19) T = t_T; s."""
    return samples.duration


def joint_rotation(arm: PlanarArm, samples: Samples) -> Matrix:
    """(9), (20): sum over joints and time steps of the absolute angular displacement; rad."""
    return total(ca.fabs(differences(samples.theta)))


def tip_travel(arm: PlanarArm, samples: Samples) -> Matrix:
    """(10): length of the line through the tip's positions at the samples; m."""
    dx, dy = columns(differences(arm.tip(samples.theta)))
    return total(ca.sqrt(dx * dx + dy * dy))


OBJECTIVES = {
    objective.name: objective
    for objective in (
        Objective("time", "T", "(8)", "s", execution_time),
        Objective("rotation", "F_q", "(9)", "rad", joint_rotation),
        Objective("length", "F_d", "(10)", "m", tip_travel),
    )
}
