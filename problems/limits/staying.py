"""A robot that stands at its goal while obstacles go on moving: what is looked at then, as a search sees it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi as ca
import numpy as np

from problems.base.arguments import is_zero
from problems.base.matrix import FloatArray, Matrix, Operand
from problems.limits.constraint import Constraint
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.robots.robot import Robot

LOOK = 0.05  # s, from one look to the next
FEWEST, MOST = 21, 600  # looks
AT_GOAL = " at the goal"  # after the name of a constraint


def looks(seconds: float) -> FloatArray:
    """Shares of a stay of so many s at which it is looked at, (n,), from 0 to 1."""
    return np.linspace(0.0, 1.0, int(np.clip(np.ceil(seconds / LOOK) + 1.0, FEWEST, MOST)))


def staying(robot: Robot, theta: Matrix, arrival: Matrix, since: Matrix) -> Samples:
    """A posture, as samples of a motion after its end.

    Args:
        robot: that stands.
        theta: its joints, (1, dof), rad.
        arrival: when it arrives, scalar, s.
        since: how long it has stood, (n, 1), s.
    """
    postures = ca.repmat(theta, since.shape[0], 1)
    return Samples(robot=robot, derivatives=(postures,), duration=arrival, times=arrival + since)


def stay_constraints(
    limits: Sequence[Limit], robot: Robot, theta: Matrix, arrival: Matrix, since: Matrix, margin: float
) -> list[Constraint]:
    """What of some limits depends on the time itself, kept while a robot stands; arguments as of :func:`staying`."""
    samples = staying(robot, theta, arrival, since)
    return [
        replace(constraint, name=f"{constraint.name}{AT_GOAL}")
        for limit in timed(limits)
        for constraint in limit.at(samples, margin)
    ]


def timed(limits: Sequence[Limit]) -> list[Limit]:
    """What of limits depends on the time itself."""
    return [kept for limit in limits if (kept := limit.timed) is not None]


def stay_matters(limits: Sequence[Limit], seconds: Operand) -> bool:
    """Whether anything is asked for after arrival."""
    return bool(timed(limits)) and not is_zero(seconds)
