"""A robot and its obstacles in the core, and questions about postures and motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from problems.base import CACHE_SIZE, FloatArray
from problems.core.asked import AskedSolids
from problems.core.compiled import CoreWorld, core
from problems.core.description import (
    RobotNumbers,
    described,
    drift_rounding,
    drifts_of,
    is_known,
    margins_of,
    pace_of,
)
from problems.core.interface import (
    ClosestPair,
    ClosestPairs,
    MovingSolids,
    Nearby,
    PathSearch,
    Proof,
    ProofRequest,
    Schedule,
    Separation,
    World,
)
from problems.motions import Trajectory
from problems.robots import Robot, SpatialArm
from problems.scene import Obstacle, standing

MOST_ITEMS = 200_000_000  # that a proof looks at
LEAST_CELLS = 48  # of time, at the beginning of a proof


@dataclass(frozen=True, kw_only=True)
class ConnectSettings:
    """Settings of the search for paths between two postures.

    Values are chosen.

    Attributes:
        edge_step: rad of the joint that turns most between two postures of an edge that are tested.
        longest_edge: rad, of an edge of a tree.
        longest_of_branches: likewise, of a robot of several branches: on a shelf 95 of 108 paths are found, 91 with 1.
        extensions: of the trees, at most.
        shortcuts: that are tried.
    """

    edge_step: float = 0.05
    longest_edge: float = 1.0
    longest_of_branches: float = 0.5
    extensions: int = 5_000
    shortcuts: int = 60


CONNECT = ConnectSettings()


class CompiledWorld(World):
    """A robot among obstacles that stand still or move, in the core; it asks for distances of those it does not know.

    Where some move, it matters when postures are tested: at the beginning by default. Of a robot whose joints are off
    what is planned, margins are those of all postures within their errors, by default those of joints at rest.

    Args:
        robot: with its margins; where it has a cover, that is what counts, else its spheres.
        obstacles: around it.
        fixed: names of links that no joint moves, of which alone it is then, and of how far obstacles are from them.

    Attributes:
        farthest: no ball of the robot is farther from the origin, m.
    """

    def __init__(self, robot: SpatialArm, obstacles: Sequence[Obstacle], fixed: tuple[str, ...] = ()) -> None:
        self._arm, self._obstacles, self._fixed = robot, tuple(obstacles), fixed
        self._robot = _numbers(robot, fixed)
        self._world = _core_world(robot, tuple(each.unmoved if is_known(each) else each for each in obstacles), fixed)
        drifts = drifts_of(obstacles)
        self._drifts = np.ascontiguousarray(drifts) if any(obstacle.moves for obstacle in obstacles) else None
        tracking = robot.tracking
        self._tracking = None if tracking is None else np.ascontiguousarray(tracking.numbers)
        self.farthest = farthest_ball(robot)

    @classmethod
    def of(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> CompiledWorld | None:
        """The world, where the core knows the robot; the same object for the same world."""
        return _known_world(robot, tuple(obstacles), ()) if type(robot) is SpatialArm else None

    @classmethod
    def of_fixed(
        cls, robot: SpatialArm, obstacles: Sequence[Obstacle], links: Sequence[str] | None = None
    ) -> CompiledWorld | None:
        """The world of links that no joint moves, all of them by default; None where there are none."""
        names = fixed_links(robot) if links is None else tuple(links)
        return _known_world(robot, tuple(obstacles), names) if names else None

    def __reduce__(self) -> tuple[object, ...]:
        return _known_world, (self._arm, self._obstacles, self._fixed)

    @property
    def dof(self) -> int:
        return self._arm.dof

    @cached_property
    def margins(self) -> dict[Separation, float]:
        return dict(zip((Separation.FROM_OBSTACLES, Separation.FROM_EACH_OTHER), margins_of(self._arm), strict=True))

    @cached_property
    def fastest(self) -> float:
        return max((pace_of(obstacle, self.farthest) for obstacle in self._obstacles), default=0.0)

    @property
    def moves(self) -> bool:
        return self._drifts is not None

    @cached_property
    def still(self) -> CompiledWorld:
        return _known_world(self._arm, tuple(standing(self._obstacles)), self._fixed) if self.moves else self

    def _moving(self, times: FloatArray | None, count: int) -> MovingSolids | None:
        """The obstacles at the times of so many postures; None where nothing moves."""
        if self._drifts is None:
            return None
        return MovingSolids(
            self._drifts, np.zeros(count) if times is None else np.ascontiguousarray(times, dtype=np.float64)
        )

    @property
    def is_exact(self) -> bool:
        """Whether joints are where they are planned."""
        return self._tracking is None

    def errors(self, speed: FloatArray, acceleration: FloatArray) -> FloatArray | None:
        return None if self._arm.tracking is None else self._arm.tracking.at(speed, acceleration)

    def _off(self, errors: FloatArray | None, count: int) -> FloatArray | None:
        """The given errors in so many postures, or those at rest; None of exact joints."""
        if self._tracking is None:
            return None
        found = np.tile(self._tracking[0], (count, 1)) if errors is None else errors
        return np.ascontiguousarray(found, dtype=np.float64)

    def _lower(
        self,
        theta: FloatArray,
        found: FloatArray,
        which: Separation,
        first: bool,
        times: FloatArray | None,
        errors: FloatArray | None,
    ) -> None:
        """Lower numbers, m, to the clearance margins of postures."""
        theta, count = np.ascontiguousarray(theta, dtype=np.float64), len(theta)
        self._world.lower_to_clearance_margins(
            theta, found, which, first, self._moving(times, count), self._off(errors, count)
        )

    def clearance_margins(
        self,
        theta: FloatArray,
        most: float = np.inf,
        which: Separation = Separation.ALL,
        times: FloatArray | None = None,
        errors: FloatArray | None = None,
    ) -> FloatArray:
        found = np.full(len(theta), most)
        self._lower(theta, found, which, False, times, errors)
        return found

    def clear(self, theta: FloatArray, extra_margin: float = 0.0, times: FloatArray | None = None) -> NDArray[np.bool_]:
        found = np.full(len(theta), extra_margin)
        self._lower(theta, found, Separation.ALL, True, times, None)
        return np.asarray(found >= extra_margin)

    def nearby(
        self, theta: FloatArray, below: float, times: FloatArray | None = None, errors: FloatArray | None = None
    ) -> Nearby:
        """The pairs with smaller clearance margins in postures; arguments as of :meth:`clearance_margins`.

        Of each link and each obstacle, and of each two links, the two balls that come nearest.
        """
        theta, count = np.ascontiguousarray(theta, dtype=np.float64), len(theta)
        return self._world.nearest(theta, below, Separation.ALL, self._moving(times, count), self._off(errors, count))

    def closest(
        self, theta: FloatArray, which: Separation = Separation.ALL, times: FloatArray | None = None
    ) -> ClosestPairs:
        """The pairs that come nearest in postures (n, dof), rad, at times (n,), s."""
        theta, count = np.ascontiguousarray(theta, dtype=np.float64), len(theta)
        places, values = self._world.closest(theta, which, self._moving(times, count), self._off(None, count))
        pairs = tuple(self._named(*place) for place in places.tolist())
        return ClosestPairs(pairs, values[:, 0], values[:, 1:].reshape(count, 2, 3))

    def prove(
        self,
        trajectory: Trajectory,
        which: Separation = Separation.ALL,
        gap: float = 1.0,
        most_items: int = MOST_ITEMS,
    ) -> Proof:
        """Bound the clearance margin of a motion for all t.

        Args:
            trajectory: of the joints; its clock is that of the obstacles.
            which: what has to keep a distance.
            gap: share by which the proven margin may be below the least that was seen; 1 asks for no positive margin.
            most_items: that are looked at; nothing is known where that is not enough.
        """
        breaks = np.ascontiguousarray(trajectory.breakpoints, dtype=np.float64)
        coefficients = np.ascontiguousarray(trajectory.coefficients, dtype=np.float64)
        drifts = self._drifts
        rounding = 0.0 if drifts is None else drift_rounding(self._arm, drifts, float(breaks[-1]))
        found = self._world.prove(
            ProofRequest(breaks, coefficients, which, gap, LEAST_CELLS, most_items, drifts, rounding, self._tracking)
        )
        status = {1: True, 0: False, -1: None}[found.status]
        where, cell = self._named(found.one, found.two, found.kind), (found.start, found.end)
        return Proof(status, found.proven, found.smallest, found.time, where, cell if status is None else None)

    def _named(self, one: int, two: int, kind: int) -> ClosestPair | None:
        if one < 0:
            return None
        names = self._robot.names
        return ClosestPair((names[one],), two) if kind == 0 else ClosestPair((names[two], names[one]), None)

    def connect(
        self,
        start: FloatArray,
        goal: FloatArray,
        box: FloatArray,
        seed: int,
        extra_margin: float = 0.0,
        extensions: int = CONNECT.extensions,
        schedule: Schedule | None = None,
    ) -> FloatArray | None:
        """A path between two postures (dof,), rad, by RRT-Connect and shortcuts; None where none was found.

        Of a robot of several branches, paths are also looked for of one branch after the other, in each order; two are
        then gone along at the same time, as far as that is clear. The seed says what is tried first.

        Args:
            start: of the way.
            goal: its end.
            box: lower and upper bounds of what is tried, (2, dof), rad.
            seed: of what is drawn.
            extra_margin: clearance margin of the postures that are tested, m.
            extensions: of the trees, at most.
            schedule: when postures are passed, about; that of the beginning where obstacles move and None is given.

        Returns:
            (m, dof), rad: where the way bends, start and goal included.

        Raises:
            ValueError: a number is not finite.
        """
        if not all(np.isfinite(part).all() for part in (start, goal, box)):
            raise ValueError("start, goal, box: a number is not finite")
        errors = None if self._tracking is None else self._tracking[0]
        search = PathSearch(
            box,
            CONNECT.edge_step,
            extra_margin,
            CONNECT.longest_of_branches if self._arm.chain.orders else CONNECT.longest_edge,
            extensions,
            CONNECT.shortcuts,
            seed,
            self._drifts,
            schedule,
            errors,
        )
        tried = (self._world.connect(start, goal, replace(search, turns=turns)) for turns in self._turns(seed))
        return next((path for path in tried if len(path)), None)

    def _turns(self, seed: int) -> list[NDArray[np.int32] | None]:
        """When each joint has its turn in the searches for a path; None in that in which all joints move at once."""
        orders = [np.array(turns, dtype=np.int32) for turns in self._arm.chain.orders]
        first = seed // 2 % max(len(orders), 1)
        in_turn = [*orders[first:], *orders[:first]]
        return [None, *in_turn] if seed % 2 else [*in_turn, None]

    def described(self, where: ClosestPair, numbers: Sequence[int] | None = None) -> str:
        """The names of a closest pair, for messages; obstacles have numbers from 1 on where none are given."""
        k = where.obstacle
        other = () if k is None else (self._obstacles[k].label(k + 1 if numbers is None else numbers[k]),)
        return ", ".join((*where.links, *other))

    def overhang(self, where: ClosestPair) -> float:
        """The distance by which balls of a cover stick out of their links there, m; 0 of spheres."""
        return sum(self._overhangs.get(name, 0.0) for name in where.links)

    @cached_property
    def _overhangs(self) -> dict[str, float]:
        cover = self._arm.cover
        return {} if cover is None else {link.name: link.overhang for link in cover.links}


@lru_cache(maxsize=CACHE_SIZE)
def _known_world(robot: SpatialArm, obstacles: tuple[Obstacle, ...], fixed: tuple[str, ...]) -> CompiledWorld:
    return CompiledWorld(robot, obstacles, fixed)


@lru_cache(maxsize=CACHE_SIZE)
def _core_world(robot: SpatialArm, obstacles: tuple[Obstacle, ...], fixed: tuple[str, ...]) -> CoreWorld:
    """The core's world of a robot among obstacles, as seen from their frames where it knows how they move."""
    asked = {number: each for number, each in enumerate(obstacles) if not is_known(each)}
    solids = AskedSolids(asked, farthest_ball(robot)) if asked else None
    return core().world(*described(robot, _numbers(robot, fixed), obstacles), solids)


def farthest_ball(robot: SpatialArm) -> float:
    """A bound of the distance of a robot's balls from the origin, m."""
    return known_robot(robot).farthest + float(np.linalg.norm(robot.base))


def known_robot(robot: SpatialArm) -> RobotNumbers:
    """The robot's part of a description, made once."""
    return _known_numbers(_ByShape(robot))


class _ByShape:
    """A robot, hashed by what its part of a description is made of."""

    def __init__(self, robot: SpatialArm) -> None:
        self.robot = robot
        shape = robot.spheres if robot.cover is None else robot.cover
        self._parts = shape, robot.chain, robot.self_collision, robot.kept_pairs, robot.proven_pairs
        self._hash = hash(self._parts)

    def __hash__(self) -> int:
        return self._hash

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ByShape) and self._parts == other._parts


@lru_cache(maxsize=CACHE_SIZE)
def _known_numbers(shape: _ByShape) -> RobotNumbers:
    return RobotNumbers.of(shape.robot)


def _numbers(robot: SpatialArm, fixed: tuple[str, ...]) -> RobotNumbers:
    return RobotNumbers.of_fixed(robot, fixed) if fixed else known_robot(robot)


def fixed_links(robot: SpatialArm) -> tuple[str, ...]:
    """The names of links that no joint moves and whose geometry is known, each once."""
    return tuple(dict.fromkeys(name for name, _, moves in known_robot(robot).roots if not moves))


def fixed_clearance(robot: Robot, obstacles: Sequence[Obstacle]) -> float:
    """The distance from obstacles of the links that no joint moves, such as the base, as far as they must not touch.

    Args:
        robot: of whose cover, or spheres, the nearest point counts.
        obstacles: where they are at t = 0.

    Returns:
        m, negative where one goes into the other; infinite where there is nothing that could be near.
    """
    world = CompiledWorld.of_fixed(robot, obstacles) if type(robot) is SpatialArm else None
    if world is None:
        return np.inf
    margin = world.margins[Separation.FROM_OBSTACLES]
    return margin + float(world.clearance_margins(np.zeros((1, robot.dof)), which=Separation.FROM_OBSTACLES)[0])
