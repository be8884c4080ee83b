"""Counts and numbers that describe a robot and obstacles to the core, in the order in which it reads them.

Of rounding: with u = 2^-53, entries of a joint's rotation are within 16 u, and so are products of rotations for each
factor; a point of the n-th body is within 16 (n + 2) u times the lengths up to it, and so are distances with a few u
more. ``ROUNDING`` (n + 4) u times the largest coordinates there are is more than all of that together.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.geometry import Balls, BallTree
from problems.robots import SpatialArm
from problems.scene import ConstantVelocity, MovingObstacle, Obstacle, PlainSolid, Shape, Solid

ROUNDING = 128.0 * 2.0**-53
FORMULA_ROUNDING = 1e-9  # m, of distances of solids that are asked


@dataclass(frozen=True, eq=False)
class LinkTree:
    """The balls of a link as a tree.

    Attributes:
        name: of the link.
        body: that carries it, 0 for the base.
        moves: whether a joint moves any of them.
        tree: of the balls.
    """

    name: str
    body: int
    moves: bool
    tree: BallTree


@dataclass(frozen=True, eq=False)
class RobotNumbers:
    """The robot's part of a description.

    Attributes:
        counts: of joints and nodes.
        joints: numbers of joints.
        nodes: numbers of nodes.
        names: of the link of each node.
        roots: links, the number of the first node of each, and whether a joint moves it.
        groups: that must keep apart: two nodes, and from where to where pairs of their balls are meant, (g, 4).
        pairs: of balls, (p, 2).
        farthest: no ball is farther from the base, m.
        fixed: whether it is of links that no joint moves; else these are there for others to keep apart from.
    """

    counts: NDArray[np.int64]
    joints: FloatArray
    nodes: FloatArray
    names: tuple[str, ...]
    roots: tuple[tuple[str, int, bool], ...]
    groups: list[tuple[int, int, int, int]]
    pairs: list[tuple[int, int]]
    farthest: float
    fixed: bool = False

    @classmethod
    def of(cls, robot: SpatialArm) -> RobotNumbers:
        """The numbers of a robot's cover, where it has one, else of its spheres."""
        return cls._of_links(robot, _links(robot), fixed=False)

    @classmethod
    def of_fixed(cls, robot: SpatialArm, names: Collection[str]) -> RobotNumbers:
        """The numbers of links of some names as far as no joint moves them."""
        links = [link for link in _links(robot) if link.name in names and not link.moves]
        return cls._of_links(robot, links, fixed=True)

    @classmethod
    def _of_links(cls, robot: SpatialArm, links: Sequence[LinkTree], fixed: bool) -> RobotNumbers:
        firsts = np.cumsum([0, *(len(link.tree.count) for link in links)]).tolist()
        chain = robot.chain
        counts = [int(part) for one in zip(chain.joints, chain.parents, strict=True) for part in (one[0].turns, one[1])]
        nodes: list[float] = []
        for link, start in zip(links, firsts, strict=False):
            tree = link.tree
            body = np.full(len(tree.count), link.body)
            counts += np.column_stack([body, tree.first + start, tree.count]).ravel().tolist()
            nodes += np.column_stack([tree.nodes.centers, tree.nodes.radii]).ravel().tolist()
        joints = [
            part
            for joint in chain.joints
            for part in (*(entry for row in joint.pose.rotation for entry in row), *joint.pose.translation, *joint.axis)
        ]
        groups, pairs = ([], []) if fixed else _own_pairs(robot, links, firsts)
        farthest = float(chain.offsets.sum()) + max(
            (float(np.linalg.norm(link.tree.nodes.centers[0])) + float(link.tree.nodes.radii[0]) for link in links),
            default=0.0,
        )
        return cls(
            counts=np.array(counts, dtype=np.int64),
            joints=np.array(joints, dtype=np.float64),
            nodes=np.array(nodes, dtype=np.float64),
            names=tuple(link.name for link in links for _ in link.tree.count),
            roots=tuple((link.name, start, link.moves) for link, start in zip(links, firsts, strict=False)),
            groups=groups,
            pairs=pairs,
            farthest=farthest,
            fixed=fixed,
        )


def _links(robot: SpatialArm) -> list[LinkTree]:
    return _covered(robot) if robot.cover is not None else _of_spheres(robot)


def _covered(robot: SpatialArm) -> list[LinkTree]:
    assert robot.cover is not None
    return [LinkTree(link.name, link.body, link.body > 0, link.tree) for link in robot.cover.links]


def _of_spheres(robot: SpatialArm) -> list[LinkTree]:
    """Trees of spheres of one name on one body, those that no joint moves apart from the others."""
    groups: dict[tuple[str, int, bool], list[int]] = {}
    for number, sphere in enumerate(robot.spheres):
        moves = bool(robot.bodies.levers[number].any())
        groups.setdefault((sphere.name, sphere.link, moves), []).append(number)
    found = []
    for (name, body, moves), numbers in groups.items():
        centers = np.array([robot.spheres[number].center for number in numbers], dtype=float)
        radii = np.array([robot.spheres[number].radius for number in numbers], dtype=float)
        found.append(LinkTree(name, body, moves, BallTree.of(Balls(centers, radii))))
    return found


def _own_pairs(
    robot: SpatialArm, links: Sequence[LinkTree], firsts: Sequence[int]
) -> tuple[list[tuple[int, int, int, int]], list[tuple[int, int]]]:
    """Groups and pairs of links that must keep apart, that which more joints move first."""
    if not robot.self_collision:
        return [], []
    if robot.cover is not None:
        ordered = (sorted(pair, key=lambda number: links[number].body) for pair in robot.cover.pairs)
        return [(firsts[two], firsts[one], 0, 0) for one, two in ordered], []
    places = _places(robot, links, firsts)
    together: dict[tuple[int, int], list[tuple[int, int]]] = {}
    for one, two in (map(robot.bodies.number_of, pair) for pair in robot.bodies.proven_pairs):
        (first, ball), (second, other) = places[two], places[one]
        together.setdefault((first, second), []).append((ball, other))
    groups: list[tuple[int, int, int, int]] = []
    pairs: list[tuple[int, int]] = []
    for (one, two), own in together.items():
        if len(own) == 1:
            groups.append((*own[0], 0, 0))
        elif len(own) == len(links[one].tree.leaves) * len(links[two].tree.leaves):
            groups.append((firsts[one], firsts[two], 0, 0))
        else:
            groups.append((firsts[one], firsts[two], len(pairs), len(pairs) + len(own)))
            pairs += own
    return groups, pairs


def _places(robot: SpatialArm, links: Sequence[LinkTree], firsts: Sequence[int]) -> list[tuple[int, int]]:
    """The number of each sphere's link among the trees, and of its node."""
    known: dict[tuple[str, int, float, float, float, float], tuple[int, int]] = {}
    for number, (link, start) in enumerate(zip(links, firsts, strict=False)):
        balls = link.tree.nodes
        for leaf in link.tree.leaves.tolist():
            x, y, z = balls.centers[leaf].tolist()
            known[link.name, link.body, x, y, z, float(balls.radii[leaf])] = number, start + leaf
    found = []
    for sphere in robot.spheres:
        x, y, z = map(float, sphere.center)
        found.append(known[sphere.name, sphere.link, x, y, z, float(sphere.radius)])
    return found


def obstacle_numbers(obstacle: Obstacle) -> PlainSolid | None:
    """The obstacle in numbers, where the core knows its exact class; None for others."""
    return obstacle.plain if isinstance(obstacle, Solid) and "plain" in vars(type(obstacle)) else None


def moves_straight(obstacle: Obstacle) -> bool:
    """Whether an obstacle stands still, or moves at a constant velocity without turning."""
    return not obstacle.moves or (type(obstacle) is MovingObstacle and type(obstacle.motion) is ConstantVelocity)


def is_known(obstacle: Obstacle) -> bool:
    """Whether the core knows an obstacle, its shape and how it moves."""
    return obstacle_numbers(obstacle.unmoved) is not None and moves_straight(obstacle)


DRIFT = 7


def drift_of(obstacle: Obstacle) -> FloatArray:
    """The motion of an obstacle, (7,), m, m/s and m/s, as far as it moves straight, else zeros.

    Where it is at t = 0, its velocity, and what more is kept from it with every second.
    """
    if not (isinstance(obstacle, MovingObstacle) and moves_straight(obstacle)):
        return np.zeros(DRIFT)
    motion, level = obstacle.motion, (0.0,) * (3 - obstacle.dim)  # the plane z = 0
    assert isinstance(motion, ConstantVelocity)
    return np.array([*motion.origin, *level, *motion.velocity, *level, obstacle.margin_rate])


def drifts_of(obstacles: Iterable[Obstacle]) -> FloatArray:
    """The motions of obstacles, (n, 7), as of :func:`drift_of`; zeros of those that the core does not know."""
    return np.array([drift_of(each) if is_known(each) else np.zeros(DRIFT) for each in obstacles]).reshape(-1, DRIFT)


PACE_CELLS = 600  # of time, in which the pace of obstacles is bounded
PACE_SECONDS = 60.0  # that these cells are together


def pace_of(obstacle: Obstacle, around: float) -> float:
    """How fast an obstacle comes nearer to anything that is no farther than so many m from the origin, about, m/s."""
    edges = np.linspace(0.0, PACE_SECONDS, PACE_CELLS + 1)
    cells = np.column_stack([edges[:-1], edges[1:]])
    return float(obstacle.travel(cells, around).max()) * 2.0 / float(edges[1]) if obstacle.moves else 0.0


def described(
    robot: SpatialArm, own: RobotNumbers, obstacles: Sequence[Obstacle]
) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], FloatArray]:
    """Counts and numbers of the whole description."""
    watched = [
        (root, number)
        for name, root, moves in own.roots
        for number, obstacle in enumerate(obstacles)
        if moves != own.fixed and (name, obstacle.unmoved.name) not in robot.may_touch
    ]
    solids = [(obstacle, _plain(obstacle)) for obstacle in obstacles]
    counts = [robot.dof, len(own.names), len(watched), len(own.groups), len(own.pairs), len(solids)]
    rows = [part for rows in (watched, own.groups, own.pairs) for row in rows for part in row]
    numbers: list[float] = [float(part) for row in robot.base_frame.rotation for part in row]
    numbers += [*robot.base, *margins_of(robot), _rounding(robot, own, obstacles)]
    of_solids: list[float] = []
    for obstacle, plain in solids:
        rows += [int(plain.shape), len(plain.planes), len(plain.faces), len(plain.edges)]
        of_solids += _of_solid(obstacle, plain)
    whole = [np.array(part, dtype=np.int64) for part in (counts, own.counts, rows)]
    real = [np.array(part, dtype=np.float64) for part in (numbers, own.joints, own.nodes, of_solids)]
    return np.concatenate(whole), np.concatenate(real)


def _plain(obstacle: Obstacle) -> PlainSolid:
    """The numbers of a solid, or that it has to be asked."""
    known = obstacle_numbers(obstacle)
    return PlainSolid(Shape.ASKED) if known is None else known


def _of_solid(obstacle: Obstacle, plain: PlainSolid) -> Iterable[float]:
    sizes = (*plain.sizes, 0.0, 0.0, 0.0)[:3]
    if not isinstance(obstacle, Solid):
        return [*np.eye(3).ravel().tolist(), *(0.0,) * 3, *sizes]
    tables = (plain.planes, plain.faces, plain.edges)
    return [
        *obstacle.axes.ravel().tolist(),
        *map(float, obstacle.center),
        *map(float, sizes),
        *(number for table in tables for number in table.ravel().tolist()),
    ]


def margins_of(robot: SpatialArm) -> tuple[float, float]:
    """The margins from obstacles and from each other, m."""
    return robot.margin, robot.self_margin if robot.cover is not None else robot.margin


def drift_rounding(robot: SpatialArm, drifts: FloatArray, seconds: float) -> float:
    """The error that rounding adds to distances where obstacles move for so many seconds, m."""
    ways = np.linalg.norm(drifts[:, :3], axis=1) + (np.linalg.norm(drifts[:, 3:6], axis=1) + drifts[:, 6]) * seconds
    return ROUNDING * (robot.dof + 4) * float(ways.max(initial=0.0))


def _rounding(robot: SpatialArm, own: RobotNumbers, obstacles: Sequence[Obstacle]) -> float:
    around = max((float(np.abs(obstacle.bounding_box()).max()) for obstacle in obstacles), default=0.0)
    size = own.farthest + float(np.linalg.norm(robot.base)) + around
    asked = 0.0 if all(map(is_known, obstacles)) else FORMULA_ROUNDING
    return ROUNDING * (robot.dof + 4) * size + asked
