"""How far a joint may move from sample to sample, so that nothing is jumped over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import ClassVar, Self

import casadi as ca

from problems.base.matrix import Matrix, Operand
from problems.limits.constraint import Constraint
from problems.limits.distances.clearance import CollisionPair, is_measured
from problems.limits.limit import Limit
from problems.motions.samples import Samples
from problems.robots.robot import Body, Robot
from problems.scene.obstacle import Obstacle

MAX_STEP_SHARE = 0.9  # the longest step of a joint between two samples, as a share of the smallest obstacle's width


@dataclass(frozen=True)
class StepLimit(Limit):
    """No joint moves so far between two samples that a link could pass over an obstacle; what a search is told besides.

    The area that a link sweeps in a step shorter than an obstacle's width cannot contain that obstacle: if the links at
    the samples and the lines between them are clear, so is all of it, except for the curvature of the motion. Of an
    obstacle that moves that is so for steps as the obstacle sees them; they may also be as long as the link is away
    from it afterwards, so that a robot can wait for it to pass at a distance.

    Args:
        robot: whose joints.
        width: of the narrowest obstacle and of what has to be kept free on both of its sides, m.
        moving: the obstacles that move.
        any_standing: whether there are others.
    """

    name: ClassVar[str] = "step"
    numbers: ClassVar[tuple[str, ...]] = ("width",)

    robot: Robot
    width: float
    moving: tuple[Obstacle, ...] = ()
    any_standing: bool = True

    @classmethod
    def holding(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit, where there are obstacles and bodies that are lines: a ball is too thick to pass unnoticed."""
        if not (obstacles and robot.bodies) or any(body.is_ball for body in robot.bodies):
            return None
        kept = robot.margin + min(float(body.radius) for body in robot.bodies)
        width = min(obstacle.width for obstacle in obstacles) + 2.0 * kept
        moving = tuple(obstacle for obstacle in obstacles if obstacle.moves)
        return cls(robot, width, moving, any_standing=len(moving) < len(obstacles))

    @property
    def _longest(self) -> Operand:
        """The longest step, m."""
        return MAX_STEP_SHARE * self.width

    def at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """None: the limit is on steps."""
        return []

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        """The squared length of each joint's step."""
        bodies = self.robot.bodies
        ends = [(before.positions[body.end], after.positions[body.end]) for body in bodies]
        steps: list[Matrix] = [_squared(last - first) for first, last in ends] if self.any_standing else []
        for obstacle in self.moving:
            steps += [self._seen(body, obstacle, before, after) for body in bodies]
        bound = ca.repmat(ca.horzcat(self._longest**2), 1, len(steps))
        views = [""] * self.any_standing + [" as a moving obstacle sees it"] * len(self.moving)
        return [
            Constraint(
                name=self.name,
                unit="m^2",
                expression=ca.horzcat(*steps),
                lower=None,
                upper=bound,
                columns=tuple(f"end of {body.name}{view}" for view in views for body in bodies),
                scale=bound,
                formula="|end of link i at t_j+1 - at t_j|^2 <= (0.9 x the smallest obstacle's width)^2",
            )
        ]

    def _seen(self, body: Body, obstacle: Obstacle, before: Samples, after: Samples) -> Matrix:
        """The squared length of the longer step of a body's ends as an obstacle sees them, (n, 1), m^2.

        It is made shorter by as much as a step may be longer for the distance that is kept afterwards.
        """
        ends = ((obstacle.seen(one.positions[end], one.times) for one in (after, before)) for end in body.frames)
        longest = reduce(ca.fmax, (_squared(last - first) for last, first in ends))
        pair, allowed = CollisionPair(body, 0, obstacle, is_measured(self.robot, body, obstacle)), self._longest
        return longest * (allowed / ca.fmax(allowed, pair.clearance(after.positions, after.times))) ** 2


def _squared(step: Matrix) -> Matrix:
    """The squared lengths of steps (n, dim), (n, 1)."""
    return ca.sum2(step * step)
