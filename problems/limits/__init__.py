"""What a motion must keep: one constraint object, from which penalty, program and audit derive."""

from collections.abc import Sequence

from problems.limits.clearance import Clearance
from problems.limits.derivative import AccelerationLimit, SpeedLimit
from problems.limits.joint_range import JointRange
from problems.limits.limit import Limit
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle

LIMITS: dict[str, type[Limit]] = {limit.name: limit for limit in (SpeedLimit, AccelerationLimit, JointRange, Clearance)}


def limits_of(robot: Robot, obstacles: Sequence[Obstacle], more: Sequence[type[Limit]] = ()) -> tuple[Limit, ...]:
    """Every registered limit that applies to a robot among obstacles, and those of further kinds that do."""
    built = (kind.holding(robot, obstacles) for kind in (*LIMITS.values(), *more))
    return tuple(limit for limit in built if limit is not None)
