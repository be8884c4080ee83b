"""Clearance of the robot's bodies from obstacles, (14); and how far a joint may move from sample to sample."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca

from problems.base.arguments import Statement
from problems.base.matrix import Matrix, columns
from problems.limits.constraint import Constraint
from problems.limits.limit import SAMPLING_MARGIN, Limit
from problems.motions.samples import Samples
from problems.robots.robot import Body, Robot
from problems.scene.obstacle import Obstacle

MAX_STEP_SHARE = 0.9  # the longest step of a joint between two samples, as a share of the smallest obstacle's width


@dataclass(frozen=True)
class CollisionPair(Statement):
    """A body and an obstacle (number 1, 2, ...) that it may touch."""

    body: Body
    number: int
    obstacle: Obstacle

    def __str__(self) -> str:
        return f"{self.body.name}, obstacle {self.number}"

    def clearance(self, positions: Sequence[Matrix]) -> Matrix:
        """Clearance in m in n postures, (n, 1); positions of the frames, each (n, dim)."""
        return self.obstacle.segment_clearance(positions[self.body.start], positions[self.body.end])

    def swept_clearance(self, before: Sequence[Matrix], after: Sequence[Matrix]) -> Matrix:
        """Clearance in m of the straight line that the body's far end draws from one posture to the next, (n, 1)."""
        return self.obstacle.segment_clearance(before[self.body.end], after[self.body.end])


def reachable_pairs(robot: Robot, obstacles: Sequence[Obstacle], margin: float = 0.0) -> tuple[CollisionPair, ...]:
    """All pairs of body and obstacle except those that can never come within ``margin`` m of each other."""
    return tuple(
        CollisionPair(body, number, obstacle)
        for number, obstacle in enumerate(obstacles, start=1)
        for body in robot.bodies
        if robot.reach(body.end)[1] >= obstacle.distance_to(robot.base) - margin
    )


@dataclass(frozen=True)
class Clearance(Limit):
    """(14): no link meets an obstacle at a sample, no joint crosses one between two samples.

    With checks at the samples alone the tip could cut a corner of an obstacle between two samples, which the travel
    length rewards. The straight line from each joint's position at one sample to the next closes this gap: together
    with the links it bounds the area that a link sweeps.

    Args:
        robot: whose bodies.
        pairs: of body and obstacle that may touch.
    """

    name: ClassVar[str] = "clearance"

    robot: Robot
    pairs: tuple[CollisionPair, ...]

    @classmethod
    def holding(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit, where there is anything within reach."""
        pairs = reachable_pairs(robot, obstacles, SAMPLING_MARGIN * robot.reach()[1]) if obstacles else ()
        return cls(robot, pairs) if pairs else None

    def at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The bodies at each sample, kept clear by a share ``margin`` of the reach."""
        clearances = ca.horzcat(*(pair.clearance(samples.positions) for pair in self.pairs))
        formula = "clearance(link i at t_j, obstacle) >= margin: the link's point nearest to the obstacle"
        return [self._constraint(self.name, "", clearances, margin, formula)]

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        """Clearance of the straight line from each joint's position at one sample to that at the next."""
        swept = ca.horzcat(*(pair.swept_clearance(before.positions, after.positions) for pair in self.pairs))
        formula = "clearance(line from a link's end at t_j to the same at t_j+1, obstacle) >= margin"
        return [self._constraint("swept clearance", "end of ", swept, margin, formula)]

    def _constraint(self, name: str, what: str, clearances: Matrix, margin: float, formula: str) -> Constraint:
        return Constraint(
            name=name,
            equation="(14), (18)",
            unit="m",
            expression=clearances,
            lower=ca.repmat(margin * self.robot.radius, 1, len(self.pairs)),
            upper=None,
            columns=tuple(f"{what}{pair}" for pair in self.pairs),
            scale=ca.repmat(ca.horzcat(self.robot.radius / 2.0), 1, len(self.pairs)),
            transform=self._smooth,
            formula=formula,
        )

    def _smooth(self, clearances: Matrix) -> Matrix:
        each = zip(self.pairs, columns(clearances), strict=True)
        return ca.horzcat(*(pair.obstacle.smooth(column) for pair, column in each))


@dataclass(frozen=True)
class StepLimit(Limit):
    """No joint moves so far between two samples that a link could pass over an obstacle; what a search is told besides.

    The area that a link sweeps in a step shorter than an obstacle's width cannot contain that obstacle: if the links at
    the samples and the lines between them are clear, so is all of it, except for the curvature of the motion.

    Args:
        robot: whose joints.
        width: of the narrowest obstacle, m.
    """

    name: ClassVar[str] = "step"
    numbers: ClassVar[tuple[str, ...]] = ("width",)

    robot: Robot
    width: float

    @classmethod
    def holding(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit, where there are obstacles."""
        return cls(robot, min(obstacle.width for obstacle in obstacles)) if obstacles else None

    def at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """None: the limit is on steps."""
        return []

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        """The squared length of each joint's step."""
        bodies = self.robot.bodies
        steps = [after.positions[body.end] - before.positions[body.end] for body in bodies]
        bound = ca.repmat(ca.horzcat((MAX_STEP_SHARE * self.width) ** 2), 1, len(bodies))
        return [
            Constraint(
                name=self.name,
                unit="m^2",
                expression=ca.horzcat(*(ca.sum2(step * step) for step in steps)),
                lower=None,
                upper=bound,
                columns=tuple(f"end of {body.name}" for body in bodies),
                scale=bound,
                formula="|end of link i at t_j+1 - at t_j|^2 <= (0.9 x the smallest obstacle's width)^2",
            )
        ]
