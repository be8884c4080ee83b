"""Limits of motions: one constraint object each, from which penalty, nonlinear program and audit derive."""

from collections.abc import Sequence
from typing import Protocol

from problems.base.errors import InvalidProblem
from problems.limits.derivative import AccelerationLimit, JerkLimit, SpeedLimit
from problems.limits.distances.clearance import Clearance
from problems.limits.distances.proximity import Proximity
from problems.limits.distances.self_clearance import SelfClearance
from problems.limits.joint_range import JointRange
from problems.limits.limit import Limit
from problems.limits.torque import TorqueLimit
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle

KINDS = (SpeedLimit, AccelerationLimit, JerkLimit, JointRange, TorqueLimit, Clearance, SelfClearance)
LIMITS: dict[str, type[Limit]] = {limit.name: limit for limit in KINDS}


class LimitKind(Protocol):
    """What makes a limit for a robot among obstacles: a class derived from :class:`Limit`, or an object like it."""

    def holding(self, robot: Robot, obstacles: Sequence[Obstacle]) -> Limit | None:
        """The limit; None where it does not apply."""


def limits_of(robot: Robot, obstacles: Sequence[Obstacle], more: Sequence[LimitKind] = ()) -> tuple[Limit, ...]:
    """Every registered limit that applies to a robot among obstacles, and those of further kinds that do.

    Raises:
        InvalidProblem: two of them have the same name.
    """
    kinds: tuple[LimitKind, ...] = (*LIMITS.values(), *more)
    built = (kind.holding(robot, obstacles) for kind in kinds)
    limits = tuple(limit for limit in built if limit is not None)
    names = [limit.name for limit in limits]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InvalidProblem("limits", f"the limit {twice!r} is there twice")
    return limits


def proximity_limits(robot: Robot, obstacles: Sequence[Obstacle]) -> tuple[Proximity, ...]:
    """Those of them that depend on a posture alone: what has to keep clear of what."""
    return tuple(limit for limit in limits_of(robot, obstacles) if isinstance(limit, Proximity))
