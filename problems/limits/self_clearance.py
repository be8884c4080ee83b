"""Clearance between a robot's own bodies."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, as_array
from problems.limits.limit import Constraint, Repetition
from problems.limits.proximity import LEAST_PAIRS, Pair, Proximity, clusters_of
from problems.motions import Samples
from problems.robots import Body, Robot
from problems.scene import Obstacle, crossing_clearance

TINY_SQUARED = 1e-30  # m^2: keeps the gradient of no distance finite


@dataclass(frozen=True)
class BodyPair(Pair):
    """Two bodies of the robot, the one nearer the base first: lines in the plane, or balls."""

    first: Body
    second: Body

    def __str__(self) -> str:
        return f"{self.first.name}, {self.second.name}"

    @property
    def group(self) -> Hashable:
        """Lines, or balls."""
        return self.first.is_ball, self.second.is_ball

    @property
    def form(self) -> BodyPair:
        """Of bodies without a name."""
        return BodyPair(self.first.form, self.second.form)

    @property
    def thickness(self) -> Operand:
        """Both radii."""
        return self.first.radius + self.second.radius

    @property
    def dim(self) -> int:
        """That of the bodies: lines in the plane, balls in space."""
        return 3 if self.first.is_ball else 2

    @property
    def radii(self) -> tuple[Operand, ...]:
        """Those of both bodies."""
        return self.first.radius, self.second.radius

    @property
    def frames(self) -> tuple[int, ...]:
        """Those of both bodies."""
        return *self.first.frames, *self.second.frames

    def opposite(self, positions: Sequence[Matrix], times: FloatArray) -> FloatArray:
        """The middle line of the second body."""
        return np.stack([as_array(positions[frame]) for frame in self.second.frames], axis=1)

    def apart(self, *ends: Matrix) -> Matrix:
        """Between two lines in the plane, exact, or between two points."""
        if len(ends) == 2:
            apart = ends[0] - ends[1]
            return ca.sqrt(ca.sum2(apart * apart) + TINY_SQUARED)
        return crossing_clearance((ends[0], ends[1]), (ends[2], ends[3]))

    def motion(self, robot: Robot) -> tuple[FloatArray, FloatArray]:
        """Only the joints between the two move them as seen from each other."""
        return robot.relative_motion(self.first, self.second)


@dataclass(frozen=True)
class SelfClearance(Proximity):
    """No two bodies that no joint connects come nearer to each other than the robot's margin.

    Args:
        robot: whose bodies.
        pairs: of bodies that may touch.
    """

    name: ClassVar[str] = "self clearance"

    pairs: tuple[BodyPair, ...]

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit, where it is asked for and there are bodies that could touch."""
        pairs = tuple(BodyPair(*pair) for pair in robot.own_pairs) if robot.self_collision else ()
        return cls(robot, pairs) if pairs else None

    def repetitions(self, symbolic_copy: SelfClearance) -> list[Repetition]:
        """Among balls, pairs of the same two clusters together; nothing is repeated."""
        bodies = dict.fromkeys(body for pair in self.pairs for body in (pair.first, pair.second))
        if not all(body.is_ball for body in bodies):
            return []
        clusters = clusters_of(self.robot, list(bodies))
        number = {body: k for k, cluster in enumerate(clusters) for body in cluster.bodies}
        groups: dict[tuple[int, int], list[BodyPair]] = {}
        for pair, own in zip(self.pairs, symbolic_copy.pairs, strict=True):
            groups.setdefault((number[pair.first], number[pair.second]), []).append(own)
        limits = []
        for (one, two), pairs in groups.items():
            first, second = clusters[one], clusters[two]
            around = BodyPair(first.bodies[0], second.bodies[0]), first.radius + second.radius
            limits.append(
                SelfClearance(symbolic_copy.robot, tuple(pairs), around if len(pairs) >= LEAST_PAIRS else None)
            )
        frames = tuple(body.start for body in bodies)
        return [Repetition(limits=tuple(limits), symbols=ca.SX(0, 1), numbers=np.empty((1, 0)), frames=frames)]

    def repeated_numbers(self) -> list[FloatArray]:
        """None: nothing is repeated."""
        bodies = (body for pair in self.pairs for body in (pair.first, pair.second))
        return [np.empty((1, 0))] if all(body.is_ball for body in bodies) else []

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """The bodies at each sample, kept apart by a share ``margin`` of the reach on top of the robot's margin."""
        formula = "clearance(link i at t_j, link l at t_j) >= margin, for links with another in between"
        return [self.constraint(self.name, "", self.clearances(samples), margin, formula)]
