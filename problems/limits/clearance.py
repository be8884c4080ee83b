"""Clearance from obstacles, and between samples."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, reduce
from typing import ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import Arguments, FloatArray, Matrix, Operand, Reading, as_array, is_zero
from problems.limits.limit import SAMPLING_MARGIN, Constraint, Limit, Repetition, WorldQuestion
from problems.limits.proximity import LEAST_PAIRS, Cluster, Pair, Proximity, clusters_of
from problems.motions import Samples
from problems.robots import Body, Robot
from problems.scene import Frames, Obstacle

EQUATION = "(14), (18)"
CORNERS = 360  # of an outline that is a curve


@dataclass(frozen=True)
class CollisionPair(Pair):
    """A body and an obstacle (number 1, 2, ...) that it may touch.

    Args:
        body: of the robot.
        number: of the obstacle.
        obstacle: itself.
        measured: whether it counts how far they are apart, not only whether they are.
        slack: how much nearer they may be than is planned, m.
    """

    body: Body
    number: int
    obstacle: Obstacle
    measured: bool = False
    slack: float = 0.0

    def __str__(self) -> str:
        return f"{self.body.name}, {self.obstacle.label(self.number)}"

    @property
    def description(self) -> str:
        place = ", ".join(f"{part:.6g}" for part in self.obstacle.place)
        return f"{self}, {type(self.obstacle.unmoved).__name__} at ({place})"

    @property
    def group(self) -> Hashable:
        """The obstacle, and the kind of its distances: from lines, or from points."""
        return self.number, self.measured, self.body.is_ball

    @property
    def form(self) -> CollisionPair:
        return replace(self, body=self.body.form, number=0, obstacle=self.obstacle.unmoved, slack=0.0)

    def view(self, times: FloatArray) -> Frames | None:
        return self.obstacle.frames(times)

    @property
    def growth_rate(self) -> float:
        return self.obstacle.growth_rate

    def without_growth(self) -> CollisionPair:
        return replace(self, obstacle=self.obstacle.without_growth(), slack=0.0)

    @property
    def dim(self) -> int:
        return self.obstacle.dim

    @property
    def radii(self) -> tuple[Operand, ...]:
        return (self.body.radius,)

    @property
    def frames(self) -> tuple[int, ...]:
        return self.body.frames

    @property
    def is_time_dependent(self) -> bool:
        return self.obstacle.moves

    def opposite(self, positions: Sequence[Matrix], times: FloatArray) -> FloatArray:
        still = None if self.obstacle.moves else self.obstacle.outline(CORNERS)
        outlines = [self.obstacle.at(time).outline(CORNERS) if still is None else still for time in map(float, times)]
        return np.array([[*outline, outline[0]] for outline in outlines])

    def apart(self, *ends: Matrix) -> Matrix:
        """Distances from the obstacle to the lines between the ends, or to one point, in the obstacle's frame."""
        obstacle = self.obstacle.unmoved
        if len(ends) == 1:
            return obstacle.point_clearance(ends[0])
        measure = obstacle.segment_distance if self.measured else obstacle.segment_clearance
        return measure(*ends)

    def exactly_apart(self, *ends: FloatArray) -> FloatArray | None:
        return self.obstacle.unmoved.exact_distances(ends[0]) if len(ends) == 1 else None

    def between(self, *ends: Matrix, times: Matrix | None = None) -> Matrix:
        """Distances of ends where they are, less what is kept from the obstacle as time goes by."""
        return self._grown(self.apart(*(self.obstacle.seen(end, times) for end in ends)), times)

    def _grown(self, distance: Matrix, times: Matrix | None) -> Matrix:
        growth = self.obstacle.growth(times)
        return distance if is_zero(growth) else distance - growth

    def swept_clearance(self, before: Samples, after: Samples) -> Matrix:
        """Clearance in m of the straight line that the body's far end draws from one posture to the next, (n, 1).

        The line is drawn as the obstacle sees it.
        """
        ends = (self.obstacle.seen(one.positions[self.body.end], one.times) for one in (before, after))
        return self.narrowed(self._grown(self.apart(*ends), after.times))

    def distance(self, positions: Sequence[Matrix], times: Matrix | None = None) -> float:
        ends = (self.obstacle.seen(positions[frame], times) for frame in (self.body.start, self.body.end))
        start, end = (tuple(as_array(place).ravel()) for place in ends)
        return self.obstacle.unmoved.distance_of(start, end) - float(self.body.radius + self.obstacle.growth(times))

    def motion(self, robot: Robot) -> tuple[FloatArray, FloatArray]:
        """Motion of the body alone, as no joint can change what the obstacle adds."""
        return robot.bodies.motion(self.body)

    def link_travel(self, robot: Robot, cells: FloatArray) -> FloatArray:
        return self.obstacle.travel(cells, _farthest(robot) + float(np.linalg.norm(robot.base)))

    def can_touch(self, robot: Robot, spare: float = 0.0) -> bool:
        """Whether the body reaches as near as the margin, and ``spare`` m farther."""
        reach = max(robot.reach(frame)[1] for frame in (self.body.start, self.body.end) if frame > 0)
        kept = float(self.body.radius) + robot.margin + spare + self.slack
        return reach >= _distance(self.obstacle, robot.base) - kept

    def smooth(self, clearance: Matrix) -> Matrix:
        return self.obstacle.smooth(clearance + self.body.radius)


@lru_cache
def _farthest(robot: Robot) -> float:
    """The largest distance of a frame in which a body ends from the base, m."""
    return max(robot.reach(frame)[1] for body in robot.bodies.each for frame in body.frames if frame > 0)


@lru_cache
def _distance(obstacle: Obstacle, point: tuple[float, ...]) -> float:
    """A lower bound in m of the distance of an obstacle from a point; the same for all bodies of a robot."""
    return obstacle.distance_to(point)


def moving_bodies(robot: Robot) -> list[Body]:
    """The bodies that a joint moves."""
    return [body for body, levers in zip(robot.bodies.each, robot.bodies.levers, strict=True) if levers.any()]


def reachable_pairs(robot: Robot, obstacles: Sequence[Obstacle], spare: float = 0.0) -> tuple[CollisionPair, ...]:
    """All pairs of body and obstacle except those that can never come within the margin, and ``spare`` m more.

    Bodies that no joint moves, as the foot of a robot on a table, are none of them: no motion could avoid anything.
    What they touch is told beside the certificate.
    """
    return tuple(pair for pair in all_pairs(robot, obstacles) if pair.can_touch(robot, spare))


def all_pairs(robot: Robot, obstacles: Sequence[Obstacle]) -> tuple[CollisionPair, ...]:
    """All pairs of a body that a joint moves and an obstacle that it must not touch."""
    bodies = moving_bodies(robot)
    return pairs_among(robot, ((body, number) for number in range(len(obstacles)) for body in bodies), obstacles)


def pairs_among(
    robot: Robot, numbered: Iterable[tuple[Body, int]], obstacles: Sequence[Obstacle]
) -> tuple[CollisionPair, ...]:
    """The pairs of bodies and obstacles, these by their places among all, from 0 on, that must not touch."""
    each = ((body, number, obstacles[number]) for body, number in numbered)
    return tuple(
        CollisionPair(body, number + 1, obstacle, measured=is_measured(robot, body, obstacle)).tracked(robot)
        for body, number, obstacle in each
        if (body.name, obstacle.unmoved.name) not in robot.may_touch
    )


def bodies_clear_of(robot: Robot, obstacle: Obstacle) -> list[Body]:
    """The bodies that a joint moves and that must not touch an obstacle."""
    return [body for body in moving_bodies(robot) if (body.name, obstacle.unmoved.name) not in robot.may_touch]


def is_measured(robot: Robot, body: Body, obstacle: Obstacle) -> bool:
    """Whether some distance has to be kept, so that it counts how large it is."""
    exact = is_zero(body.radius) and is_zero(robot.margin) and is_zero(obstacle.growth(ca.DM(1.0)))
    return not exact or robot.joint_errors is not None


def _repetition(
    robot: Robot, numeric: Robot, clusters: Sequence[Cluster], pairs: Sequence[CollisionPair]
) -> Repetition:
    """The repetition of clusters of balls, here of symbols, and obstacles of pairs of one structure."""
    arguments = [Arguments() for _ in pairs]
    symbolic_copies = [own.symbolic_copy(pair.obstacle) for own, pair in zip(arguments, pairs, strict=True)]
    one, limits = replace(pairs[0], number=1, obstacle=symbolic_copies[0]), []
    for cluster in clusters:
        each = tuple(replace(one, body=body, slack=0.0).tracked(numeric) for body in cluster.bodies)
        apart = cluster.radius + max(pair.slack for pair in each)
        limits.append(Clearance(robot, each, (each[0], apart) if len(each) >= LEAST_PAIRS else None))
    return Repetition(
        limits=tuple(limits),
        symbols=arguments[0].symbols,
        numbers=np.array([own.values for own in arguments]),
        frames=tuple(body.start for cluster in clusters for body in cluster.bodies),
        is_time_dependent=pairs[0].is_time_dependent,
    )


@dataclass(frozen=True)
class Clearance(Proximity):
    """The limit (14): no link comes nearer to an obstacle than the robot's margin, at samples and between them.

    With checks at the samples alone the tip could cut a corner of an obstacle between two samples, which the travel
    length rewards. The straight line from each joint's position at one sample to the next closes this gap: together
    with the links it bounds the area that a link sweeps.

    Args:
        robot: whose bodies.
        pairs: of body and obstacle that may touch.
    """

    name: ClassVar[str] = "clearance"

    pairs: tuple[CollisionPair, ...]

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        pairs = reachable_pairs(robot, obstacles, SAMPLING_MARGIN * robot.reach()[1]) if obstacles else ()
        return cls(robot, pairs) if pairs else None

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        formula = "clearance(link i at t_j, obstacle) >= margin: the link's point nearest to the obstacle"
        return [self.constraint(self.name, "", self.clearances(samples), margin, formula, EQUATION)]

    @property
    def world_question(self) -> WorldQuestion | None:
        obstacles = {pair.number: pair.obstacle for pair in self.pairs}
        numbers = sorted(obstacles)
        if type(self) is not Clearance or self.robot.cover is not None or numbers != list(range(1, len(numbers) + 1)):
            return None
        return WorldQuestion(self.robot, tuple(obstacles[number] for number in numbers), False, self.proof_gap)

    def complete(self, obstacles: Sequence[Obstacle]) -> Clearance:
        """The limit on all pairs; itself where a class of its own chose pairs."""
        return Clearance(self.robot, all_pairs(self.robot, obstacles)) if type(self) is Clearance else self

    def repetitions(self, symbolic_copy: Clearance) -> list[Repetition]:
        """Repetitions among balls, one for each structure of obstacle: all balls that move, from one of them.

        Those that cannot touch it are among them, so that where obstacles are changes no code.
        """
        return [
            _repetition(symbolic_copy.robot, self.robot, self._clusters(pairs), pairs) for pairs in self._of_one_make
        ]

    def _clusters(self, pairs: Sequence[CollisionPair]) -> list[Cluster]:
        return clusters_of(self.robot, bodies_clear_of(self.robot, pairs[0].obstacle))

    def repeated_numbers(self) -> list[FloatArray]:
        return [np.array([Reading(pair.obstacle).values for pair in pairs]) for pairs in self._of_one_make]

    @cached_property
    def _of_one_make(self) -> list[list[CollisionPair]]:
        """Pairs of a ball with each obstacle, those of one structure together, in order; else none.

        Of one structure are obstacles of one make that the same bodies may touch.
        """
        if not all(pair.body.is_ball for pair in self.pairs):
            return []
        structures: dict[Hashable, dict[int, CollisionPair]] = {}
        for pair in {(pair.number, pair.measured): pair for pair in self.pairs}.values():
            allowed = tuple(body for body, obstacle in self.robot.may_touch if obstacle == pair.obstacle.unmoved.name)
            structure = Reading(pair.obstacle).structure_key, pair.measured, allowed
            structures.setdefault(structure, {})[pair.number] = pair
        return [list(pairs.values()) for pairs in structures.values()]

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        """Clearance of the lines from each joint's position at one sample to that at the next; none of balls."""
        if any(pair.body.is_ball for pair in self.pairs):
            return []
        swept = ca.horzcat(*(pair.swept_clearance(before, after) for pair in self.pairs))
        formula = "clearance(line from a link's end at t_j to the same at t_j+1, obstacle) >= margin"
        return [self.constraint("swept clearance", "end of ", swept, margin, formula, EQUATION)]


MAX_STEP_SHARE = 0.9  # the longest step of a joint between two samples, as a share of the smallest obstacle's width


@dataclass(frozen=True)
class StepLimit(Limit):
    """No joint moves so far between two samples that a link could pass over an obstacle; for searches.

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
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit, where there are obstacles and bodies that are lines: balls are too thick to pass unnoticed."""
        if not (obstacles and robot.bodies.each) or any(body.is_ball for body in robot.bodies.each):
            return None
        kept = robot.margin + min(float(body.radius) for body in robot.bodies.each)
        width = min(obstacle.width for obstacle in obstacles) + 2.0 * kept
        moving = tuple(obstacle for obstacle in obstacles if obstacle.moves)
        return cls(robot, width, moving, any_standing=len(moving) < len(obstacles))

    @property
    def _longest(self) -> Operand:
        """The longest step, m."""
        return MAX_STEP_SHARE * self.width

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        return []

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        bodies = self.robot.bodies.each
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
