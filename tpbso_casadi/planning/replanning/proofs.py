"""What is proven of motions while an arm moves: each thing once, the cheapest first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems import Limit, Robot, Trajectory
from problems.base.matrix import FloatArray
from problems.certify.clearance import ClearanceProof, prove_clearance
from problems.certify.verdict import TOLERANCE, CertificateStatus
from problems.certify.verification import prove
from problems.limits import limits_of
from problems.limits.constraint import Constraint
from problems.limits.distances.clearance import Clearance
from problems.scene.obstacle import Obstacle


@dataclass(frozen=True)
class Scene:
    """Obstacles at one time, and what the robot has to keep from them.

    Args:
        robot: that moves.
        obstacles: on a clock that starts then.
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...]

    @cached_property
    def _clearance(self) -> Clearance | None:
        return Clearance.holding(self.robot, self.obstacles)

    def _part(self, timed: bool) -> Clearance | None:
        pairs = [] if self._clearance is None else [pair for pair in self._clearance.pairs if pair.timed is timed]
        return Clearance(self.robot, tuple(pairs)) if pairs else None

    @cached_property
    def standing(self) -> Clearance | None:
        """From the obstacles that stand still; None where none is within reach."""
        return self._part(timed=False)

    @cached_property
    def moving(self) -> Clearance | None:
        """From those that move."""
        return self._part(timed=True)

    def less_certain(self, rate: float) -> Scene:
        """The same where what moves may leave its motion at a rate in m/s."""
        return Scene(self.robot, tuple(obstacle.less_certain(rate) for obstacle in self.obstacles))


def proof_of_clearance(limit: Clearance | None, trajectory: Trajectory) -> ClearanceProof | None:
    """For all t; None where there is nothing to meet."""
    return None if limit is None else prove_clearance(limit, trajectory)


def is_clear(proof: ClearanceProof | None) -> bool:
    """Whether a motion is proven to stay clear, or nothing is there."""
    return proof is None or proof.status is CertificateStatus.CERTIFIED


class RobotLimits:
    """The limits of a robot that have nothing to do with obstacles.

    Args:
        robot: whose limits.
        more: kinds of limits that hold besides.
    """

    def __init__(self, robot: Robot, more: Sequence[type[Limit]] = ()) -> None:
        limits = limits_of(robot, (), more)
        anywhere = Trajectory.standing(np.zeros(robot.dof), 1.0).samples(np.zeros(1))
        self._bounds = [
            (limit.order, *_with_slack(constraint))
            for limit in limits
            if limit.order is not None
            for constraint in limit.at(anywhere)
        ]
        self._other = [limit for limit in limits if limit.order is None]

    def hold(self, trajectory: Trajectory) -> bool:
        """Whether all are proven for all t of a motion, which may begin and end in motion."""
        return all(_stays_within(trajectory, *bound) for bound in self._bounds) and all(
            verdict.satisfied for limit in self._other for verdict in prove(limit, trajectory)
        )


def _with_slack(constraint: Constraint) -> tuple[FloatArray, FloatArray]:
    """The bounds of a constraint, both (k,), each with room for rounding."""
    (lower, upper), slack = constraint.bounds, TOLERANCE * constraint.scales
    return lower - slack, upper + slack


def _stays_within(trajectory: Trajectory, order: int, lower: FloatArray, upper: FloatArray) -> bool:
    """Whether a derivative does; it is infinite where the one below it jumps."""
    jumps = order > 1 and trajectory.jumps_inside(order - 1)
    return not jumps and trajectory.stays_within(order, lower, upper)
