"""Pairs that keep clear of each other, balls in clusters, clearances; and a robot's own bodies."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add
from typing import ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, Parametric, Relaxation, as_array, columns, is_zero
from problems.limits.limit import SAMPLING_MARGIN, Constraint, Limit, Repetition, WorldQuestion
from problems.motions import Samples
from problems.robots import Body, BodyPairs, Robot
from problems.scene import Frames, Obstacle, crossing_clearance

MOST_BALLS = 8  # in a cluster
LEAST_PAIRS = 4  # for which the one around them is looked at first
DISTANCE_ROUNDING = 1e-9  # m: what a distance may lack
STEP_SHARE = 3.0  # of what programs keep between samples: by how much a margin is changed to see what it is worth


@dataclass(frozen=True)
class Cluster:
    """Bodies that are balls.

    Attributes:
        bodies: the one in the middle first.
        radius: no point of theirs is farther from the centre of the first, m.
    """

    bodies: tuple[Body, ...]
    radius: float


def clusters_of(robot: Robot, bodies: Sequence[Body]) -> list[Cluster]:
    """Balls of a robot in clusters that move as one and are small.

    Args:
        robot: whose bodies.
        bodies: balls, in order.
    """
    places = [as_array(place)[0] for place in robot.positions(ca.DM.zeros(1, robot.dof))]
    groups: dict[int, list[Body]] = {}
    for body in bodies:
        groups.setdefault(robot.bodies.moved_by(body), []).append(body)
    return [_cluster(part, places) for group in groups.values() for part in _halved(group, places)]


def _halved(bodies: list[Body], places: Sequence[FloatArray]) -> list[list[Body]]:
    """Parts of bodies, cut in two along their longest extent until no part has too many."""
    if len(bodies) <= MOST_BALLS:
        return [bodies]
    centers = np.array([places[body.start] for body in bodies])
    order = np.argsort(centers[:, int(np.argmax(np.ptp(centers, axis=0)))], kind="stable")
    halves = order[: len(order) // 2], order[len(order) // 2 :]
    return [part for half in halves for part in _halved([bodies[k] for k in half], places)]


def _cluster(bodies: list[Body], places: Sequence[FloatArray]) -> Cluster:
    centers = np.array([places[body.start] for body in bodies])
    radii = np.array([float(body.radius) for body in bodies])
    farthest = (np.linalg.norm(centers[:, None] - centers, axis=2) + radii).max(axis=1)
    middle = int(np.argmin(farthest))
    others = [body for k, body in enumerate(bodies) if k != middle]
    return Cluster((bodies[middle], *others), float(farthest[middle]) + DISTANCE_ROUNDING)


NEAR = 0.1  # of the reach: pairs that stay farther apart, on top of what they have to keep, may be forgotten


class Pair(Parametric, ABC):
    """Two objects that have to keep a distance. A subclass is a frozen dataclass."""

    @property
    @abstractmethod
    def group(self) -> Hashable:
        """A key; pairs of one group are computed together."""

    @property
    def description(self) -> str:
        """The names and places of both, for messages."""
        return str(self)

    @property
    def thickness(self) -> Operand:
        """The widths of the two, and the slack, by which the distance of their middle lines is larger, m."""
        return reduce(add, self.radii) + self.slack if self.slack else reduce(add, self.radii)

    @property
    @abstractmethod
    def slack(self) -> float:
        """The distance by which the two may be nearer than planned, as joints do not follow exactly, m."""

    def tracked(self, robot: Robot) -> Self:
        """The pair of a robot whose joints may be off."""
        if robot.joint_errors is None:
            return self
        turns, levers = self.motion(robot)
        shares = zip(levers @ np.abs(turns), robot.joint_errors, strict=True)
        return replace(self, slack=sum((float(share) * float(error) for share, error in shares), 0.0))  # type: ignore[type-var]

    @property
    @abstractmethod
    def radii(self) -> tuple[Operand, ...]:
        """The radii of the bodies that move, m, in the order of their ends."""

    @property
    @abstractmethod
    def dim(self) -> int:
        """The dimension: 2 in the plane, 3 in space."""

    @property
    @abstractmethod
    def frames(self) -> tuple[int, ...]:
        """Numbers of the frames in which their middle lines end, as far as these move."""

    def ends(self, positions: Sequence[Matrix]) -> tuple[Matrix, ...]:
        """The points of their middle lines that move, each (n, dim), m; positions of the frames, each (n, dim)."""
        return tuple(positions[frame] for frame in self.frames)

    @property
    def is_time_dependent(self) -> bool:
        """Whether its distance depends on the time; not by default."""
        return False

    @property
    @abstractmethod
    def form(self) -> Pair:
        """The pair without what :meth:`apart` does not depend on: whose ends they are, and how they move."""

    def view(self, times: FloatArray) -> Frames | None:
        """The frames in which one sees the other at times (n,), s; None for that of the world."""
        return None

    @abstractmethod
    def opposite(self, positions: Sequence[Matrix], times: FloatArray) -> FloatArray:
        """The middle line or outline in the plane that the first faces, for drawing: lines (n, points, 2), m.

        Args:
            positions: of the frames, each (n, 2), m.
            times: (n,), s.
        """

    @property
    def growth_rate(self) -> float:
        """The rate at which the distance to be kept grows, m/s; 0 by default."""
        return 0.0

    @abstractmethod
    def apart(self, *ends: Matrix) -> Matrix:
        """Distances of the middle lines, (n, 1), m, given their ends (n, dim) as one sees the other."""

    def exactly_apart(self, *ends: FloatArray) -> FloatArray | None:
        """Sharper numeric distances, (n,), m, for proofs; None by default."""
        return None

    def between(self, *ends: Matrix, times: Matrix | None = None) -> Matrix:
        """Distances of the middle lines, (n, 1), m, whichever pairs of its group the ends (n, dim) belong to.

        Args:
            ends: of the middle lines, (n, dim), m.
            times: (n, 1), s, or one for all; None where nothing moves by itself.
        """
        return self.apart(*ends)

    def clearance(self, positions: Sequence[Matrix], times: Matrix | None = None) -> Matrix:
        """The clearance in n postures, (n, 1), m; positions of the frames, each (n, dim); times (n, 1), s.

        Negative where they meet. Else no more than a distance that changes by no more than the points of one move as
        seen from the other.
        """
        return self.narrowed(self.between(*self.ends(positions), times=times))

    def narrowed(self, distance: Matrix) -> Matrix:
        """The clearance that a distance between the middle lines leaves, m."""
        return distance if is_zero(self.thickness) else distance - self.thickness

    def distance(self, positions: Sequence[Matrix], times: Matrix | None = None) -> float:
        """The distance in one posture, exact to rounding, m; by default the clearance."""
        return float(self.clearance(positions, times))

    @abstractmethod
    def motion(self, robot: Robot) -> tuple[FloatArray, FloatArray]:
        """Factors that bound how fast both move as seen from each other.

        Returns:
            turns (m, dof), from joint speeds to angular rates u = turns @ dq/dt; and levers (m,), m: no point moves
            faster than the sum over j of levers[j] |u_j|.
        """

    def link_travel(self, robot: Robot, cells: FloatArray) -> FloatArray:
        """Changes of the distance of any pair of its group within cells of time though no joint moves, at most.

        Args:
            robot: of which they are pairs.
            cells: start and end of each, (n, 2), s.

        Returns:
            (n,), m: an upper bound of the difference to the middle of each cell.
        """
        return np.zeros(len(cells))

    def without_growth(self) -> Pair:
        """The pair without growth of the distance to be kept: itself by default."""
        return self

    def can_touch(self, robot: Robot) -> bool:
        """Whether they can come nearer than they must keep."""
        return True

    def smooth(self, clearance: Matrix) -> Matrix:
        """An increasing function of the clearance that a nonlinear program bounds instead; itself by default."""
        return clearance


def clearances(pairs: Sequence[Pair], positions: Sequence[Matrix], times: Matrix | None = None) -> Matrix:
    """Clearances of pairs in n postures, (n, pairs), m; positions of frames, each (n, dim); times (n, 1), s."""
    groups: dict[Hashable, list[int]] = {}
    for number, pair in enumerate(pairs):
        groups.setdefault(pair.group, []).append(number)
    found: list[Matrix] = [ca.DM()] * len(pairs)
    for members in groups.values():
        stacked = [ca.vertcat(*ends) for ends in zip(*(pairs[i].ends(positions) for i in members), strict=True)]
        clock = ca.repmat(times, len(members), 1) if times is not None and pairs[members[0]].is_time_dependent else None
        distances = ca.vertsplit(pairs[members[0]].between(*stacked, times=clock), positions[0].shape[0])
        for i, distance in zip(members, distances, strict=True):
            found[i] = pairs[i].narrowed(distance)
    return ca.horzcat(*found)


@dataclass(frozen=True)
class Proximity(Limit):
    """A limit on pairs, each of which keeps the robot's margin.

    Args:
        robot: whose bodies.
        pairs: that could come too near.
        around: a pair and a length, m: no pair is nearer than the distance between the middle lines of this one, less
            the length; None where no such pair is known.

    Attributes:
        proof_gap: share of the smallest clearance seen beyond the margin by which the proven one may be smaller.
    """

    within_tracking: ClassVar[bool] = True
    proof_gap: ClassVar[float] = 0.1

    robot: Robot
    pairs: tuple[Pair, ...]
    around: tuple[Pair, float] | None = None

    def required_clearance(self, share: float) -> Operand:
        """The clearance to be kept, m: the robot's margin, and a share of its reach."""
        spare = share * self.robot.radius
        return spare if is_zero(self.robot.margin) else self.robot.margin + spare

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        margin = float(self.robot.margin)

        def nearer(by: float) -> dict[str, object]:
            return {"margin": margin - by}

        least = STEP_SHARE * SAMPLING_MARGIN * float(self.robot.radius)
        own = Relaxation(
            limit=self.name, of="margin", statement=self.robot, values=nearer, size=margin, unit="m", least_step=least
        )
        return (own,)

    def constraint(
        self, name: str, what: str, clearances: Matrix, margin: float, formula: str, equation: str = "-"
    ) -> Constraint:
        """The constraint on clearances (rows, pairs), m.

        Args:
            name: of the constraint.
            what: of a pair is meant, before its name in that of a column.
            clearances: one column a pair.
            margin: to keep on top of the robot's, a share of the reach.
            formula: for a reader.
            equation: of the paper.
        """
        return Constraint(
            name=name,
            equation=equation,
            unit="m",
            expression=clearances,
            lower=ca.repmat(ca.horzcat(self.required_clearance(margin)), 1, len(self.pairs)),
            upper=None,
            columns=tuple(f"{what}{pair}" for pair in self.pairs),
            scale=ca.repmat(ca.horzcat(self.robot.radius / 2.0), 1, len(self.pairs)),
            transform=self._smooth,
            formula=formula,
        )

    def may_break(self, samples: Samples, margin: float = 0.0) -> Matrix | None:
        if self.around is None:
            return None
        pair, length = self.around
        between = pair.between(*pair.ends(samples.positions), times=samples.times)
        return between < self.required_clearance(margin) + length

    def near(self, samples: Samples) -> Self | None:
        """The pairs within a share of the reach of what they have to keep, and those that time may bring near."""
        room = as_array(self.clearances(samples)).min(axis=0) - float(self.required_clearance(0.0))
        near, pairs = NEAR * float(self.robot.radius), zip(self.pairs, room, strict=True)
        return self._of(tuple(pair for pair, left in pairs if pair.is_time_dependent or left < near))

    @property
    def time_dependent_part(self) -> Self | None:
        return self._of(tuple(pair for pair in self.pairs if pair.is_time_dependent))

    @property
    def time_independent_part(self) -> Self | None:
        return self._of(tuple(pair for pair in self.pairs if not pair.is_time_dependent))

    def _of(self, pairs: tuple[Pair, ...]) -> Self | None:
        """The limit of some of its pairs, if there are any."""
        return replace(self, pairs=pairs, around=None) if pairs else None

    def clearances(self, samples: Samples) -> Matrix:
        """The clearances of all pairs at each sample, (n, pairs), m."""
        return clearances(self.pairs, samples.positions, samples.times)

    def _smooth(self, clearances: Matrix) -> Matrix:
        each = zip(self.pairs, columns(clearances), strict=True)
        return ca.horzcat(*(pair.smooth(column) for pair, column in each))


TINY_SQUARED = 1e-30  # m^2: keeps the gradient of no distance finite


@dataclass(frozen=True)
class BodyPair(Pair):
    """Two bodies of the robot, that nearer the base first: lines in the plane, or balls; and their slack, m."""

    first: Body
    second: Body
    slack: float = 0.0

    def __str__(self) -> str:
        return f"{self.first.name}, {self.second.name}"

    @property
    def group(self) -> Hashable:
        return self.first.is_ball, self.second.is_ball

    @property
    def form(self) -> BodyPair:
        return BodyPair(self.first.form, self.second.form)

    @property
    def dim(self) -> int:
        return 3 if self.first.is_ball else 2

    @property
    def radii(self) -> tuple[Operand, ...]:
        return self.first.radius, self.second.radius

    @property
    def frames(self) -> tuple[int, ...]:
        return *self.first.frames, *self.second.frames

    def opposite(self, positions: Sequence[Matrix], times: FloatArray) -> FloatArray:
        return np.stack([as_array(positions[frame]) for frame in self.second.frames], axis=1)

    def apart(self, *ends: Matrix) -> Matrix:
        if len(ends) == 2:
            apart = ends[0] - ends[1]
            return ca.sqrt(ca.sum2(apart * apart) + TINY_SQUARED)
        return crossing_clearance((ends[0], ends[1]), (ends[2], ends[3]))

    def motion(self, robot: Robot) -> tuple[FloatArray, FloatArray]:
        return robot.bodies.motion(self.second, seen_from=self.first)

    def without_growth(self) -> BodyPair:
        return replace(self, slack=0.0)


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
        return cls._among(robot, robot.bodies.pairs)

    @property
    def world_question(self) -> WorldQuestion | None:
        own = type(self) is SelfClearance and self.robot.cover is None
        return WorldQuestion(self.robot, (), True, self.proof_gap) if own else None

    def complete(self, obstacles: Sequence[Obstacle]) -> SelfClearance:
        """The limit on all pairs that a verdict judges; itself where a class of its own chose pairs."""
        return (SelfClearance.of_all(self.robot) or self) if type(self) is SelfClearance else self

    @classmethod
    def of_all(cls, robot: Robot) -> Self | None:
        """The limit on all pairs that a verdict judges, where it is asked for and there are any.

        Of a robot with covers, a verdict speaks of these instead.
        """
        return cls._among(robot, robot.bodies.proven_pairs) if robot.cover is None else None

    @classmethod
    def _among(cls, robot: Robot, own: BodyPairs) -> Self | None:
        pairs = tuple(BodyPair(*pair).tracked(robot) for pair in own) if robot.self_collision else ()
        return cls(robot, pairs) if pairs else None

    def repetitions(self, symbolic_copy: SelfClearance) -> list[Repetition]:
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
            apart = first.radius + second.radius + max(pair.slack for pair in pairs)
            around = BodyPair(first.bodies[0], second.bodies[0]), apart
            limits.append(
                SelfClearance(symbolic_copy.robot, tuple(pairs), around if len(pairs) >= LEAST_PAIRS else None)
            )
        frames = tuple(body.start for body in bodies)
        return [Repetition(limits=tuple(limits), symbols=ca.SX(0, 1), numbers=np.empty((1, 0)), frames=frames)]

    def repeated_numbers(self) -> list[FloatArray]:
        bodies = (body for pair in self.pairs for body in (pair.first, pair.second))
        return [np.empty((1, 0))] if all(body.is_ball for body in bodies) else []

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        formula = "clearance(link i at t_j, link l at t_j) >= margin, for links with another in between"
        return [self.constraint(self.name, "", self.clearances(samples), margin, formula)]
