"""Limits of motions: one constraint object each, from which penalty, nonlinear program and audit derive."""

from collections.abc import Sequence
from typing import Protocol

from problems.base import InvalidProblem
from problems.limits.accuracy import Accuracy, AngularAccuracy, rotation_away, shares_along, turned_along
from problems.limits.clearance import (
    MAX_STEP_SHARE,
    Clearance,
    CollisionPair,
    StepLimit,
    pairs_among,
    reachable_pairs,
)
from problems.limits.covers import (
    CoverClearance,
    CoverLimit,
    CoverSelfClearance,
    cover_limits,
    touching_links,
)
from problems.limits.expression import MOVING, Bound, ExpressionLimit, StatedExpression
from problems.limits.free_axis import AxisName, DirectionBound, FreeAxis, TurnRange
from problems.limits.hand import HandConstraint, ToolOrientation, ToolRegion, ToolSpeed, Upright
from problems.limits.joint_limits import (
    AccelerationLimit,
    DurationBounds,
    JerkLimit,
    JointRange,
    SpeedLimit,
    TorqueLimit,
    can_hold,
    holding_torques,
)
from problems.limits.limit import (
    LARGEST_SLOWDOWN,
    SAMPLING_MARGIN,
    Constraint,
    Limit,
    PenaltyKind,
    Repetition,
    WorldQuestion,
    depends_on_speed,
    end_point,
    longest_time_scale,
    minimum_time_scale,
    peaks_of,
    reach_limit,
    scaling,
)
from problems.limits.proximity import BodyPair, Pair, Proximity, SelfClearance, clearances
from problems.limits.relative_pose import RelativePose, tool_at_tip
from problems.limits.staying import (
    AT_GOAL,
    TaperedMargin,
    stay_constraints,
    stay_matters,
    stay_shares,
    time_dependent_parts,
)
from problems.robots import Robot
from problems.scene import Obstacle

KINDS = (SpeedLimit, AccelerationLimit, JerkLimit, JointRange, TorqueLimit, Clearance, SelfClearance)
HAND_CONSTRAINTS: dict[str, type[HandConstraint]] = {
    each.kind: each for each in (Upright, ToolOrientation, ToolRegion, ToolSpeed, RelativePose)
}
LIMITS: dict[str, type[Limit]] = {limit.name: limit for limit in KINDS}


class LimitKind(Protocol):
    """A class derived from :class:`Limit`, or an object like it, that makes a limit for a robot among obstacles."""

    def for_robot(self, robot: Robot, obstacles: Sequence[Obstacle]) -> Limit | None:
        """The limit; None where it does not apply."""


def limits_of(robot: Robot, obstacles: Sequence[Obstacle], more: Sequence[LimitKind] = ()) -> tuple[Limit, ...]:
    """Every registered limit that applies to a robot among obstacles, and those of further kinds that do.

    Raises:
        InvalidProblem: two of them have the same name.
    """
    kinds: tuple[LimitKind, ...] = (*LIMITS.values(), *more)
    built = (kind.for_robot(robot, obstacles) for kind in kinds)
    limits = tuple(limit for limit in built if limit is not None)
    names = [limit.name for limit in limits]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InvalidProblem("limits", f"the limit {twice!r} is there twice")
    return limits


def proximity_limits(robot: Robot, obstacles: Sequence[Obstacle]) -> tuple[Proximity, ...]:
    """The limits that depend on a posture alone: on what has to keep clear of what."""
    return tuple(limit for limit in limits_of(robot, obstacles) if isinstance(limit, Proximity))


def complete_limits(limits: Sequence[Limit], robot: Robot, obstacles: Sequence[Obstacle]) -> tuple[Limit, ...]:
    """The limits as verdicts judge them: of all bodies, also of those that a search leaves out."""
    if robot.cover is not None:
        others = [limit.complete(obstacles) for limit in limits if type(limit) not in (Clearance, SelfClearance)]
        return (*others, *cover_limits(robot, obstacles))
    complete = [limit.complete(obstacles) for limit in limits]
    if not any(type(limit) is SelfClearance for limit in complete):
        complete += [own for own in [SelfClearance.of_all(robot)] if own is not None]
    return tuple(complete)


__all__ = [
    "AT_GOAL",
    "HAND_CONSTRAINTS",
    "KINDS",
    "LARGEST_SLOWDOWN",
    "LIMITS",
    "MAX_STEP_SHARE",
    "MOVING",
    "SAMPLING_MARGIN",
    "Accuracy",
    "AngularAccuracy",
    "AxisName",
    "BodyPair",
    "Bound",
    "Clearance",
    "CollisionPair",
    "Constraint",
    "CoverClearance",
    "CoverLimit",
    "CoverSelfClearance",
    "DirectionBound",
    "DurationBounds",
    "ExpressionLimit",
    "FreeAxis",
    "HandConstraint",
    "Limit",
    "LimitKind",
    "Pair",
    "PenaltyKind",
    "Proximity",
    "RelativePose",
    "Repetition",
    "SelfClearance",
    "StatedExpression",
    "StepLimit",
    "TaperedMargin",
    "ToolOrientation",
    "ToolRegion",
    "ToolSpeed",
    "TorqueLimit",
    "TurnRange",
    "Upright",
    "WorldQuestion",
    "can_hold",
    "clearances",
    "complete_limits",
    "cover_limits",
    "depends_on_speed",
    "end_point",
    "holding_torques",
    "limits_of",
    "longest_time_scale",
    "minimum_time_scale",
    "pairs_among",
    "peaks_of",
    "proximity_limits",
    "reach_limit",
    "reachable_pairs",
    "rotation_away",
    "scaling",
    "shares_along",
    "stay_constraints",
    "stay_matters",
    "stay_shares",
    "time_dependent_parts",
    "tool_at_tip",
    "touching_links",
    "turned_along",
]
