"""A plan among obstacles made as fast as it can be, and clear where it is not: path and speed together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

from problems.limits.limit import Limit
from problems.limits.proximity import Proximity
from problems.motions.trajectory import Trajectory
from problems.sequential.descent import Descent
from problems.sequential.fitted import fitted
from problems.sequential.freedom import Freedom
from problems.sequential.nearness import Nearness
from problems.sequential.path_speed import MotionSpace
from problems.sequential.timed import timed
from problems.tasks.move import Move

SPACE = MotionSpace(path_pieces=12, speed_pieces=24)
SPARES = (6e-3, 1.2e-2, 2.4e-2)  # m, kept at samples on top of the margin: one after the other where proofs fail
JOINT_ORDERS = range(4)  # derivatives of the joint angles whose limits are kept


@dataclass(frozen=True)
class Polish:
    """What sequential programs make of motions of a task.

    Args:
        task: at rest at both ends, with nothing to pass on the way.
        limits: each of a derivative of the joint angles up to the jerk, or of clearances.
    """

    task: Move
    limits: tuple[Limit, ...]

    @cached_property
    def _nearness(self) -> Nearness:
        return Nearness(self.task.robot, tuple(limit for limit in self.limits if isinstance(limit, Proximity)))

    def __call__(self, start: Trajectory) -> Iterator[Trajectory]:
        """Motions, each with more clearance at its samples than the last, from one that may break limits."""
        robot = self.task.robot
        goal = self.task.reached_goal(start.at(start.breakpoints[-1:])[0])
        motion, freedom = fitted(start, SPACE), Freedom(robot, self.task.start, goal)
        for spare in SPARES:
            reached = Descent(SPACE, robot.limits, freedom, self._nearness, robot.margin, spare)(motion)
            yield timed(reached.motion)
            motion = reached.motion


def can_be_polished(task: Move, limits: Sequence[Limit]) -> bool:
    """Whether sequential programs know all that a task asks for."""
    known = all(limit.order in JOINT_ORDERS or isinstance(limit, Proximity) for limit in limits)
    return known and task.at_rest and task.passes_nothing and task.duration_bounds is None
