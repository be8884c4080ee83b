"""Clearance of covers of an arm's links from obstacles and from each other, for verdicts.

A node of a link's tree of balls is far from something when the ball around it is. From the roots down, only nodes that
may matter are opened: a thousand balls cost little more than one where they are far.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import ClassVar, NamedTuple, Self

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import Arguments, FloatArray, Reading, as_array
from problems.evaluation import PARAMETERS, RowFunction
from problems.limits.cover_nodes import Items, Nodes, Numbers, Postures
from problems.limits.limit import Constraint, Limit, WorldQuestion
from problems.motions import Samples
from problems.robots import Robot, SpatialArm
from problems.scene import Obstacle


class Nearest(NamedTuple):
    """The nearest pairs in n postures.

    Attributes:
        clearance: (n,), m; infinite where there is nothing.
        items: which balls that are, and in which posture, (n,).
    """

    clearance: FloatArray
    items: Items


@dataclass(frozen=True)
class CoverLimit(Limit):
    """A limit on covers, which keep the robot's margin.

    Args:
        robot: whose cover.

    Attributes:
        proof_gap: what is proven is lower than the smallest clearance by so much, relative, beyond the margin.
        sample_count: postures in which the nearest is looked for before a proof.
    """

    within_tracking: ClassVar[bool] = True
    proof_gap: ClassVar[float] = 0.1
    sample_count: ClassVar[int] = 100

    robot: SpatialArm

    @cached_property
    def nodes(self) -> Nodes:
        """The nodes of the cover."""
        assert self.robot.cover is not None
        return Nodes.of(self.robot.cover, self.robot.chain)

    @property
    def margin(self) -> float:
        """The margin to be kept, m: the robot's by default."""
        return self.robot.margin

    @abstractmethod
    def roots(self, rows: int) -> Items:
        """The items of all roots that may come near each other, in so many postures."""

    @abstractmethod
    def gaps(self, items: Items, postures: Postures) -> FloatArray:
        """Lower bounds of the distances of items, (m,), m; the distances of two balls, or a ball and an obstacle."""

    @abstractmethod
    def sizes(self, items: Items) -> FloatArray:
        """The radius of the node that could be opened, (m,), m; 0 where both are balls themselves."""

    @abstractmethod
    def opened(self, items: Items) -> Items:
        """Smaller items that together hold all of some items, which can be opened."""

    @abstractmethod
    def travel(self, items: Items, turns: FloatArray, cells: FloatArray) -> FloatArray:
        """Bounds of how far items move as seen from each other, (m,), m.

        Args:
            items: whose rows are cells of time.
            turns: how far each joint turns from where it is in the middle of each cell, (cells, dof), rad or m.
            cells: start and end of each, (cells, 2), s.
        """

    @abstractmethod
    def described(self, item: Items) -> str:
        """The names of the first of some items, for messages."""

    @abstractmethod
    def overhang(self, item: Items) -> float:
        """The distance by which covers of the first of some items stick out of what they hold, m."""

    @cached_property
    def _tubes(self) -> FloatArray:
        """The share of each joint's error in the distance of each node, (nodes, dof), m.

        Of a node with others in it by so much more that it is no farther than any of these.
        """
        nodes, dof = self.nodes, self.robot.dof
        each = np.array([float(error) for error in self.robot.joint_errors or ()])
        turns = np.array([joint.turns for joint in self.robot.chain.joints])
        radii = np.where(nodes.tree.count > 0, nodes.tree.nodes.radii, 0.0)
        moved = np.arange(dof) < nodes.body[:, None]
        return np.asarray((nodes.levers + radii[:, None] * turns) * moved * each)

    def _overhang_of(self, node: int) -> float:
        assert self.robot.cover is not None
        return float(self.robot.cover.links[self.nodes.link[node]].overhang)

    def _sizes_of(self, nodes: Numbers) -> FloatArray:
        """The radii of nodes that can be opened, (m,), m; 0 of balls themselves."""
        return np.where(self.nodes.tree.count[nodes] > 0, self.nodes.tree.nodes.radii[nodes], 0.0)

    def nearest(self, theta: FloatArray, times: FloatArray, each: bool = True) -> Nearest:
        """The balls that come nearest in postures (n, dof), rad, at times (n,), s.

        Args:
            theta: joint angles.
            times: of the postures.
            each: whether in every one of them; else in that in which anything comes nearest, and (1,) is returned.
        """
        return self.nearest_of(self.roots(len(theta)), Postures.of(self.robot, theta, times), each)

    def nearest_of(self, items: Items, postures: Postures, each: bool = True, below: float = np.inf) -> Nearest:
        """The balls that come nearest of those that some items hold.

        Args:
            items: to be opened.
            postures: n of them.
            each: as for :meth:`nearest`.
            below: only balls nearer than that count, m; where there are none, that is the clearance.
        """
        count = len(postures.times) if each else 1
        least, best = np.full(count, below), Items(*(np.zeros(count, dtype=np.intp) for _ in range(3)))
        reached = self._reached(items, postures)
        np.minimum.at(least, reached.items.row * each, np.nextafter(reached.clearance, np.inf))
        while len(items.row):
            gaps, sizes, place = self.gaps(items, postures), self.sizes(items), items.row * each
            ends = np.flatnonzero(sizes == 0.0)
            ends = ends[np.argsort(-gaps[ends], kind="stable")]  # the nearest comes last, and stays
            nearer = ends[gaps[ends] < least[place[ends]]]
            least[place[nearer]] = gaps[nearer]
            for kept, part in zip(best, items, strict=True):
                kept[place[nearer]] = part[nearer]
            within = least.copy()
            np.minimum.at(within, place, gaps + 4.0 * sizes)  # a ball is no farther
            items = items.taken((sizes > 0.0) & (gaps <= within[place]))
            items = self.opened(items) if len(items.row) else items
        return Nearest(least, best)

    def _reached(self, items: Items, postures: Postures) -> Nearest:
        """The balls found by descending to the nearest node repeatedly; the nearest is no farther than these."""
        sizes = self.sizes(items)
        while sizes.any():
            items = self.parted(items)
            sizes = self.sizes(items)
            order = np.lexsort((self.gaps(items, postures) + sizes, items.row))
            first = order[np.diff(items.row[order], prepend=-1) > 0]
            items, sizes = items.taken(first), sizes[first]
        return Nearest(self.gaps(items, postures), items)

    def parted(self, items: Items) -> Items:
        """The items in smaller parts, where they have any."""
        whole = self.sizes(items) == 0.0
        return items if whole.all() else Items.concatenated([items.taken(whole), self.opened(items.taken(~whole))])

    @abstractmethod
    def surfaces(self, found: Nearest, postures: Postures) -> FloatArray:
        """Points at which the surfaces of what is nearest in each posture are nearest, (n, 2, 3), m."""

    def closest(self, theta: FloatArray, times: FloatArray) -> tuple[Nearest, FloatArray]:
        """The nearest in each of n postures (n, dof), rad, at times (n,), s, and its points, (n, 2, 3), m."""
        found = self.nearest(theta, times)
        return found, self.surfaces(found, Postures.of(self.robot, theta, times))

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        theta = as_array(samples.theta)
        times = np.zeros(len(theta)) if samples.times is None else as_array(samples.times).ravel()
        clearance = self.nearest(theta, np.broadcast_to(times, len(theta))).clearance
        return [
            Constraint(
                name=self.name,
                unit="m",
                expression=ca.DM(clearance),
                lower=ca.DM(self.margin + margin * float(self.robot.radius)),
                upper=None,
                columns=("the nearest of all",),
                scale=ca.DM(float(self.robot.radius) / 2.0),
                formula="clearance(cover of any link at t_j, what it must not touch) >= margin",
            )
        ]


@dataclass(frozen=True)
class CoverClearance(CoverLimit):
    """No link's cover comes nearer to an obstacle than the robot's margin.

    Args:
        robot: whose cover.
        obstacles: to keep clear of.
    """

    name: ClassVar[str] = "clearance"

    obstacles: tuple[Obstacle, ...]

    @classmethod
    def for_robot(cls, robot: SpatialArm, obstacles: Sequence[Obstacle]) -> Self | None:  # type: ignore[override]
        moves = robot.cover is not None and any(link.body > 0 for link in robot.cover.links)
        return cls(robot, tuple(obstacles)) if obstacles and moves else None

    @property
    def world_question(self) -> WorldQuestion | None:
        return (
            WorldQuestion(self.robot, self.obstacles, False, self.proof_gap) if type(self) is CoverClearance else None
        )

    def roots(self, rows: int) -> Items:
        node, other = self._watched
        row = np.repeat(np.arange(rows), len(node))
        return Items(row, np.tile(node, rows), np.tile(other, rows))

    @cached_property
    def _watched(self) -> tuple[Numbers, Numbers]:
        """Roots of links that a joint moves, and the obstacles that each must not touch."""
        assert self.robot.cover is not None
        pairs = [
            (root, number)
            for root, link in zip(self.nodes.roots, self.robot.cover.links, strict=True)
            for number, obstacle in enumerate(self.obstacles)
            if link.body > 0 and (link.name, obstacle.unmoved.name) not in self.robot.may_touch
        ]
        nodes, numbers = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
        return nodes, numbers

    def gaps(self, items: Items, postures: Postures) -> FloatArray:
        balls = self.nodes.tree.nodes
        points = postures.points(items.row, self.nodes.body[items.node], balls.centers[items.node])
        gaps, times = np.empty(len(points)), postures.times[items.row]
        for number in np.unique(items.other):
            chosen = items.other == number
            gaps[chosen] = distances_from(self.obstacles[number], points[chosen], times[chosen])
        if self.robot.tracking is not None:
            gaps -= self._tubes[items.node].sum(axis=1)
        return np.asarray(gaps - balls.radii[items.node])

    def surfaces(self, found: Nearest, postures: Postures) -> FloatArray:
        row, node, other = found.items
        balls, times = self.nodes.tree.nodes, postures.times[row]
        middles, falls = postures.points(row, self.nodes.body[node], balls.centers[node]), np.zeros((len(row), 3))
        for number in np.unique(other):
            chosen = np.flatnonzero(other == number)
            for axis, step in enumerate(STEP * np.eye(3)):
                ends = (
                    distances_from(self.obstacles[number], middles[chosen] + s * step, times[chosen]) for s in (-1, 1)
                )
                falls[chosen, axis] = np.subtract(*ends)
        return _along(middles, falls, balls.radii[node], found.clearance)

    def sizes(self, items: Items) -> FloatArray:
        return self._sizes_of(items.node)

    def opened(self, items: Items) -> Items:
        children, parents = self.nodes.tree.children(items.node)
        return Items(items.row[parents], children, items.other[parents])

    def travel(self, items: Items, turns: FloatArray, cells: FloatArray) -> FloatArray:
        moved = np.einsum("mj,mj->m", self.nodes.levers[items.node], turns[items.row])
        around = self._around
        for number, obstacle in enumerate(self.obstacles):
            if obstacle.moves:
                chosen = items.other == number
                moved[chosen] += obstacle.travel(cells, around)[items.row[chosen]]
        return np.asarray(moved)

    def obstacles_travel(self, cells: FloatArray) -> FloatArray:
        """Bounds of how far any obstacle moves within cells of time (n, 2), s, from the middle of each, (n,), m."""
        moving = [obstacle.travel(cells, self._around) for obstacle in self.obstacles if obstacle.moves]
        return np.asarray(np.max([np.zeros(len(cells)), *moving], axis=0))

    @cached_property
    def _around(self) -> float:
        """A bound of the distances of nodes' centres from the world's origin, m."""
        return float(self.nodes.levers.max() + self.robot.reach()[1] + np.linalg.norm(self.robot.base))

    @property
    def time_dependent_part(self) -> Limit | None:
        return CoverClearance.for_robot(self.robot, [obstacle for obstacle in self.obstacles if obstacle.moves])

    @property
    def time_independent_part(self) -> Limit | None:
        return CoverClearance.for_robot(self.robot, [obstacle for obstacle in self.obstacles if not obstacle.moves])

    def without_growth(self) -> CoverClearance:
        """The limit of planned postures, among obstacles where they are predicted."""
        exact = replace(self.robot, tracking=None)
        return CoverClearance(exact, tuple(obstacle.without_growth() for obstacle in self.obstacles))

    def overhang(self, item: Items) -> float:
        return self._overhang_of(item.node[0])

    def described(self, item: Items) -> str:
        assert self.robot.cover is not None
        number = int(item.other[0])
        link = self.robot.cover.links[self.nodes.link[item.node[0]]].name
        return f"{link}, {self.obstacles[number].label(number + 1)}"


STEP = 1e-5  # m: of differences


def _along(middles: FloatArray, ways: FloatArray, radii: FloatArray, clearance: FloatArray) -> FloatArray:
    """Points of balls (n, 3) farthest along directions (n, 3), and points farther by a clearance, (n, 2, 3), m."""
    toward = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), np.finfo(float).tiny)
    near = middles + radii[:, None] * toward
    return np.stack([near, near + clearance[:, None] * toward], axis=1)


def distances_from(obstacle: Obstacle, points: FloatArray, times: FloatArray) -> FloatArray:
    """Distances of points (m, 3) from an obstacle at times (m,), s, less what is kept as time goes by, (m,), m."""
    form, view = obstacle.unmoved, obstacle.frames(times)
    seen = points if view is None else view.seen(points)
    distances = form.exact_distances(seen)
    if distances is None:
        reading = Reading(form)
        function = _distance(_Form(reading.structure_key, form))
        distances = function(np.ascontiguousarray(seen.T), reading.values)[0]
    return np.asarray(distances - obstacle.growth_rate * times)


@dataclass(frozen=True)
class _Form:
    """An obstacle where it stands still, equal to others of the same formula."""

    make: Hashable
    obstacle: Obstacle = field(compare=False)


@lru_cache(maxsize=64)
def _distance(form: _Form) -> RowFunction:
    own = Arguments()
    obstacle, point = own.symbolic_copy(form.obstacle), ca.SX.sym("point", 3)
    clearance = ca.densify(obstacle.point_clearance(point.T))
    return RowFunction(
        ca.Function("clearance", [point, own.symbols], [clearance], ["point", PARAMETERS], ["clearance"]), 256
    )


@dataclass(frozen=True)
class CoverSelfClearance(CoverLimit):
    """No two links that must keep apart come nearer to each other than the robot's margin for that.

    Neighbours of neighbours are as near in every posture, with much of their surfaces: a sharper proof would take long.
    """

    name: ClassVar[str] = "self clearance"
    proof_gap: ClassVar[float] = 0.5
    sample_count: ClassVar[int] = 10

    @property
    def margin(self) -> float:
        return self.robot.self_margin

    @classmethod
    def for_robot(cls, robot: SpatialArm, obstacles: Sequence[Obstacle]) -> Self | None:  # type: ignore[override]
        return cls(robot) if robot.self_collision and robot.cover is not None and robot.cover.pairs else None

    @property
    def world_question(self) -> WorldQuestion | None:
        return WorldQuestion(self.robot, (), True, self.proof_gap) if type(self) is CoverSelfClearance else None

    def roots(self, rows: int) -> Items:
        assert self.robot.cover is not None
        one, two = np.array(self.robot.cover.pairs, dtype=np.intp).T
        row = np.repeat(np.arange(rows), len(one))
        return Items(row, np.tile(self.nodes.roots[two], rows), np.tile(self.nodes.roots[one], rows))

    def gaps(self, items: Items, postures: Postures) -> FloatArray:
        balls, body = self.nodes.tree.nodes, self.nodes.body
        one, two = (postures.points(items.row, body[part], balls.centers[part]) for part in items[1:])
        apart = one - two
        between = np.sqrt(np.einsum("mi,mi->m", apart, apart))
        if self.robot.tracking is not None:
            between -= (self._tubes[items.node] * self._between(items)).sum(axis=1)
        return np.asarray(between - balls.radii[items.node] - balls.radii[items.other])

    def surfaces(self, found: Nearest, postures: Postures) -> FloatArray:
        row, node, other = found.items
        balls, body = self.nodes.tree.nodes, self.nodes.body
        one, two = (postures.points(row, body[part], balls.centers[part]) for part in (node, other))
        return _along(one, two - one, balls.radii[node], found.clearance)

    def sizes(self, items: Items) -> FloatArray:
        return np.maximum(self._sizes_of(items.node), self._sizes_of(items.other))

    def opened(self, items: Items) -> Items:
        first = self._sizes_of(items.node) >= self._sizes_of(items.other)
        one, two = items.taken(first), items.taken(~first)
        children, parents = self.nodes.tree.children(one.node)
        others, owners = self.nodes.tree.children(two.other)
        parts = Items(one.row[parents], children, one.other[parents]), Items(two.row[owners], two.node[owners], others)
        return Items.concatenated(parts)

    def travel(self, items: Items, turns: FloatArray, cells: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("mj,mj->m", self.nodes.levers[items.node] * self._between(items), turns[items.row]))

    def _between(self, items: Items) -> NDArray[np.bool_]:
        """Whether each joint is between the two nodes of each item, (m, dof)."""
        return np.asarray(np.arange(self.robot.dof) >= self.nodes.body[items.other][:, None])

    def overhang(self, item: Items) -> float:
        return self._overhang_of(item.node[0]) + self._overhang_of(item.other[0])

    def described(self, item: Items) -> str:
        assert self.robot.cover is not None
        links = [self.robot.cover.links[self.nodes.link[part[0]]].name for part in (item.other, item.node)]
        return ", ".join(links)


POSTURES, ALWAYS = 100, 0.95  # at random, and of them: links that touch at so many belong together


def touching_links(arm: SpatialArm) -> list[tuple[str, str]]:
    """Names of links that have to keep apart and touch at almost all random postures, of an arm with a cover."""
    assert arm.cover is not None
    low, high = np.array(arm.position_limits or [(-np.pi, np.pi)] * arm.dof).T
    theta = np.random.default_rng(0).uniform(np.maximum(low, -np.pi), np.minimum(high, np.pi), (POSTURES, arm.dof))
    found = []
    for one, two in arm.cover.pairs:
        pair = CoverSelfClearance(replace(arm, cover=replace(arm.cover, pairs=((one, two),))))
        if (pair.nearest(theta, np.zeros(POSTURES)).clearance < 0.0).mean() >= ALWAYS:
            found.append((arm.cover.links[one].name, arm.cover.links[two].name))
    return found


def cover_limits(robot: Robot, obstacles: Sequence[Obstacle]) -> tuple[CoverLimit, ...]:
    """The limits on the cover of an arm; none of a robot without one."""
    makers: tuple[Callable[..., CoverLimit | None], ...] = (CoverClearance.for_robot, CoverSelfClearance.for_robot)
    made = (make(robot, obstacles) for make in makers if robot.cover is not None)
    return tuple(limit for limit in made if limit is not None)
