"""What is proven of a candidate among what was observed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from problems import (
    CertificateStatus,
    ConstantVelocity,
    Constraint,
    LimitKind,
    MovingObstacle,
    Obstacle,
    Robot,
    Trajectory,
)
from problems.base import FloatArray, Reading
from problems.certify import TOLERANCE, ClearanceProof, prove, prove_among, prove_clearance
from problems.core import Separation
from problems.limits import Clearance, Pair, Proximity, SelfClearance, limits_of, proximity_limits
from problems.motions import Samples

ROUNDING = 1e-9  # of numbers of obstacles that are one


@dataclass(frozen=True)
class MergedClearance(Proximity):
    """Pairs of several limits, which are proven together: where the robot is, is computed once."""

    name: ClassVar[str] = "clearance"

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        return [self.constraint(self.name, "", self.clearances(samples), margin, "clearance >= margin")]


CELLS, MOST_CELLS = 33, 4_000  # of time, at the beginning of a proof and in all: a step has little
WHOLE_GAP = 1.0  # no more than what has to be kept is proven
MOST_ITEMS = 200_000  # that a proof looks at: what is nearer than that takes is refused


@dataclass(frozen=True)
class KeptClear:
    """The obstacles and links that a robot has to keep clear of.

    Args:
        robot: that moves.
        obstacles: by their numbers among all.
        own: whether its own bodies are meant too.
    """

    robot: Robot
    obstacles: Mapping[int, Obstacle] = field(hash=False)
    own: bool = False

    def proof(self, trajectory: Trajectory) -> ClearanceProof | None:
        """The proof of clearance for all t; None where there is nothing to keep clear of."""
        if not (self.obstacles or self.own):
            return None
        which = Separation.ALL if self.own else Separation.FROM_OBSTACLES
        known = prove_among(self.robot, self.obstacles, trajectory, which, WHOLE_GAP, MOST_ITEMS)
        if known is not None:
            return known
        return prove_clearance(self._merged, trajectory, WHOLE_GAP, CELLS, MOST_CELLS, tell_broken=False)

    @cached_property
    def _merged(self) -> MergedClearance:
        """All pairs, where the core does not know the robot."""
        each, numbers = tuple(self.obstacles.values()), list(self.obstacles)
        limit = Clearance.for_robot(self.robot, each)
        pairs: list[Pair] = [] if limit is None else [replace(p, number=numbers[p.number - 1]) for p in limit.pairs]
        own = SelfClearance.of_all(self.robot) if self.own else None
        return MergedClearance(self.robot, (*pairs, *(() if own is None else own.pairs)))

    def are_clear_of(self, trajectory: Trajectory) -> bool:
        """Whether a motion is proven to keep clear of everything, for all t."""
        return is_clear(self.proof(trajectory))


@dataclass(frozen=True)
class ObservedScene:
    """Obstacles at one time, and what the robot has to keep from them and from itself.

    Args:
        robot: that moves.
        obstacles: on a clock that starts then.
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...]

    def _numbered(self, moves: bool) -> dict[int, Obstacle]:
        return {number: each for number, each in enumerate(self.obstacles, start=1) if each.moves == moves}

    @cached_property
    def moving(self) -> KeptClear:
        """The obstacles that are moving."""
        return KeptClear(self.robot, self._numbered(moves=True))

    @cached_property
    def fixed(self) -> KeptClear:
        """Obstacles that stand still, and the robot itself."""
        return KeptClear(self.robot, self._numbered(moves=False), self.robot.self_collision)

    def less_certain(self, rate: float) -> ObservedScene:
        """The scene in which moving obstacles may leave their motions at a rate in m/s."""
        return ObservedScene(self.robot, tuple(obstacle.less_certain(rate) for obstacle in self.obstacles))

    def later(self, seconds: float) -> ObservedScene:
        """The scene as it is predicted so many seconds later."""
        return ObservedScene(self.robot, tuple(o.later(seconds) if o.moves else o for o in self.obstacles))

    def is_as_predicted(self, before: ObservedScene, seconds: float) -> bool:
        """Whether nothing is other than one has expected so many seconds before, but for rounding."""
        return len(self.obstacles) == len(before.obstacles) and all(
            _is_one(obstacle, predicted)
            for obstacle, predicted in zip(self.obstacles, before.later(seconds).obstacles, strict=True)
        )

    def is_within(self, before: ObservedScene, seconds: float, rate: float) -> bool:
        """Whether nothing has left what one has expected so many seconds before faster than at a rate in m/s."""
        return len(self.obstacles) == len(before.obstacles) and all(
            _is_within(obstacle, predicted, rate * seconds, rate)
            for obstacle, predicted in zip(self.obstacles, before.later(seconds).obstacles, strict=True)
        )


def _is_one(first: Obstacle, second: Obstacle) -> bool:
    """Whether two obstacles are the same, but for rounding."""
    one, other = Reading(first), Reading(second)
    return one.structure_key == other.structure_key and np.allclose(
        one.values, other.values, rtol=ROUNDING, atol=ROUNDING
    )


def _is_within(first: Obstacle, second: Obstacle, way: float, rate: float) -> bool:
    """Whether two obstacles are one, but for a way in m and a velocity in m/s, where they keep theirs."""
    if not (isinstance(first, MovingObstacle) and isinstance(second, MovingObstacle)):
        return _is_one(first, second)
    one, other = first.motion, second.motion
    if not (isinstance(one, ConstantVelocity) and isinstance(other, ConstantVelocity)):
        return _is_one(first, second)
    away = np.linalg.norm(np.subtract(one.origin, other.origin))
    change = np.linalg.norm(np.subtract(one.velocity, other.velocity))
    is_near = bool(away <= way + ROUNDING and change <= rate + ROUNDING)
    return is_near and _is_one(replace(first, motion=other), second)


def is_clear(proof: ClearanceProof | None) -> bool:
    """Whether a motion is proven to stay clear, or nothing is there."""
    return proof is None or proof.status is CertificateStatus.CERTIFIED


class RobotLimits:
    """The limits of a robot that have nothing to do with what may touch it.

    Args:
        robot: whose limits.
        more: kinds of limits that hold besides.
    """

    def __init__(self, robot: Robot, more: Sequence[LimitKind] = ()) -> None:
        near = {limit.name for limit in proximity_limits(robot, ())}
        limits = [limit for limit in limits_of(robot, (), more) if limit.name not in near]
        anywhere = Trajectory.standing(np.zeros(robot.dof), 1.0).samples(np.zeros(1))
        self._bounds = [
            (limit.order, *_with_slack(constraint))
            for limit in limits
            if limit.order is not None
            for constraint in limit.constraints_at(anywhere)
        ]
        self._other = [limit for limit in limits if limit.order is None]

    def hold(self, trajectory: Trajectory) -> bool:
        """Whether all are proven for all t of a motion, which may begin and end in motion."""
        if trajectory.jumps_inside(0) or not all(_stays_within(trajectory, *bound) for bound in self._bounds):
            return False
        return all(verdict.satisfied for limit in self._other for verdict in prove(limit, trajectory))


def _with_slack(constraint: Constraint) -> tuple[FloatArray, FloatArray]:
    """The bounds of a constraint, both (k,), each with room for rounding."""
    (lower, upper), slack = constraint.bounds, TOLERANCE * constraint.scales
    return lower - slack, upper + slack


def _stays_within(trajectory: Trajectory, order: int, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether a derivative does; it is infinite where the one below it jumps."""
    jumps = order > 1 and trajectory.jumps_inside(order - 1)
    return not jumps and trajectory.stays_within(order, lower, upper)
