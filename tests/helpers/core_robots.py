"""Robots for tests of the core, every ball of them by NumPy alone, and motions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import casadi as ca
import numpy as np
from helpers.meshed import covered_arm
from helpers.space import small_arm
from scipy.spatial.transform import Rotation

from problems.base import as_array
from problems.core import CompiledWorld
from problems.motions import Trajectory
from problems.robots import ChainJoint, FixedFrame, SpatialArm, Sphere
from problems.robots.chain import Chain, JointKind
from problems.scene import (
    Ball,
    Box,
    Capsule,
    ConstantVelocity,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    MovingObstacle,
    Obstacle,
    Polytope,
)

MARGIN, AMONG_LINKS = 0.01, 0.02
BASE = Rotation.from_rotvec([0.3, -0.2, 0.5])
TILTED = Rotation.from_rotvec([-0.4, 0.9, 0.2])


def rows(rotation: Rotation) -> tuple[tuple[float, float, float], ...]:
    return tuple(tuple(row) for row in rotation.as_matrix().tolist())


def upright() -> SpatialArm:
    """Seven joints that turn; spheres on the base and on the first axis, pairs that are not all of two links."""
    spheres = (
        Sphere(0, (0.0, 0.0, 0.05), 0.08, "foot"),
        Sphere(1, (0.0, 0.0, 0.1), 0.06, "column"),
        *(Sphere(2, (0.0, 0.0, 0.1 * k), 0.06, "upper arm") for k in range(4)),
        *(Sphere(4, (0.0, 0.01 * k, 0.1 * k), 0.05, "forearm") for k in range(4)),
        *(Sphere(7, (0.02, 0.0, 0.05 * k), 0.04, "hand") for k in range(4)),
    )
    far = [(one, two) for one in range(6) for two in range(10, 14)]
    pairs = (*far, (7, 0), (9, 0), (8, 1))
    return small_arm(
        spheres=spheres, kept_pairs=pairs[:-5], proven_pairs=pairs[-5:], margin=MARGIN, self_collision=True,
        base_frame=FixedFrame(rows(BASE), (0.1, -0.2, 0.3)),
    )  # fmt: skip


def sliding() -> SpatialArm:
    """Two of four joints slide, one of them between joints that turn; frames and axes are askew."""
    joints = (
        ChainJoint(name="one", link="tower", pose=FixedFrame(translation=(0.1, 0.0, 0.2)), axis=(0.0, 0.6, 0.8)),
        ChainJoint(
            name="two", link="boom", kind=JointKind.PRISMATIC, position=(-0.3, 0.4),
            pose=FixedFrame(rows(TILTED), (0.2, 0.1, 0.3)), axis=(0.8, 0.0, 0.6),
        ),
        ChainJoint(name="three", link="arm", pose=FixedFrame(rows(TILTED * BASE), (0.3, 0.0, 0.1))),
        ChainJoint(name="four", link="rod", kind=JointKind.PRISMATIC, position=(-0.2, 0.2), axis=(1.0, 0.0, 0.0)),
    )  # fmt: skip
    spheres = (
        Sphere(1, (0.0, 0.05, 0.0), 0.1, "tower"),
        Sphere(2, (0.1, 0.0, 0.05), 0.07, "boom"),
        *(Sphere(3, (0.1 * k, 0.05, 0.0), 0.05, "arm") for k in range(3)),
        *(Sphere(4, (0.4 + 0.1 * k, 0.0, 0.02), 0.04, "rod") for k in range(3)),
    )
    return SpatialArm(
        chain=Chain(name="sliding", joints=joints, tip=FixedFrame(translation=(0.2, 0.0, 0.0))),
        max_speed=(2.0, 0.5, 2.0, 0.5), max_acceleration=(10.0, 2.0, 10.0, 2.0),
        position_limits=((-2.8, 2.8), (-0.3, 0.4), (-2.8, 2.8), (-0.2, 0.2)),
        spheres=spheres, margin=MARGIN, self_collision=True,
        kept_pairs=tuple((one, two) for one in range(2) for two in range(2, 8)),
    )  # fmt: skip


def fork() -> SpatialArm:
    """Two branches on a column that turns, their joints by turns; one joint slides, and one branch carries the tool."""
    left, right = FixedFrame(rows(BASE), (0.0, 0.2, 0.3)), FixedFrame(translation=(0.0, -0.2, 0.3))
    up, out = FixedFrame(translation=(0.0, 0.0, 0.3)), FixedFrame(translation=(0.3, 0.0, 0.05))
    joints = (
        ChainJoint(name="column", link="column", pose=FixedFrame(rows(TILTED), (0.1, 0.0, 0.2))),
        ChainJoint(name="left 1", link="left 1", parent=1, axis=(0.0, 1.0, 0.0), pose=left),
        ChainJoint(name="right 1", link="right 1", parent=1, axis=(0.6, 0.8, 0.0), pose=right),
        ChainJoint(name="left 2", link="left 2", parent=2, pose=out),
        ChainJoint(name="right 2", link="right 2", parent=3, kind=JointKind.PRISMATIC, axis=(1.0, 0.0, 0.0), pose=up),
        ChainJoint(name="left 3", link="left 3", parent=4, axis=(0.0, 0.6, 0.8), pose=out),
        ChainJoint(name="right 3", link="right 3", parent=5, axis=(0.0, 1.0, 0.0), pose=out),
    )  # fmt: skip
    names = ("base", *(joint.link for joint in joints))
    spheres = tuple(
        Sphere(body, (0.1 * k, 0.02, 0.01 * body), 0.05, name) for body, name in enumerate(names) for k in range(2)
    )
    return SpatialArm(
        chain=Chain(name="fork", joints=joints, tip=FixedFrame(rows(TILTED), (0.2, 0.0, 0.0)), tip_body=6),
        max_speed=(2.0,) * 7, max_acceleration=(10.0,) * 7, spheres=spheres, margin=MARGIN, self_collision=True,
        position_limits=((-2.8, 2.8),) * 4 + ((-0.2, 0.2),) + ((-2.8, 2.8),) * 2,
        base_frame=FixedFrame(rows(BASE), (0.1, -0.2, 0.3)),
        kept_pairs=tuple((one, two) for one in range(2, 16) for two in range(one) if (one // 2, two // 2) in APART),
    )  # fmt: skip


APART = {(5, 0), (3, 2), (4, 3), (5, 4), (6, 5), (7, 6), (7, 2), (6, 1), (7, 3)}  # bodies, of one branch and of both


def arm(*joints: ChainJoint, **changes: object) -> SpatialArm:
    """Turning by up to 6 rad, sliding by up to 6 m; no margin."""
    dof = len(joints)
    return SpatialArm(
        chain=Chain(name="by hand", joints=joints), max_speed=(2.0,) * dof, max_acceleration=(10.0,) * dof,
        position_limits=((-6.0, 6.0),) * dof, margin=0.0, **changes,  # type: ignore[arg-type]
    )  # fmt: skip


def slider(radius: float, **changes: object) -> SpatialArm:
    """A ball that slides up and down."""
    joint = ChainJoint(name="lift", link="ball", kind=JointKind.PRISMATIC, position=(-6.0, 6.0), axis=(0.0, 0.0, 1.0))
    return arm(joint, spheres=(Sphere(1, (0.0, 0.0, 0.0), radius, "ball"),), **changes)


@cache
def robot_of(name: str) -> SpatialArm:
    """Covers keep another margin from each other than from obstacles."""
    if name == "bars":
        return replace(covered_arm(), margin=MARGIN, self_margin=AMONG_LINKS)
    return {"upright": upright, "sliding": sliding, "fork": fork}[name]()


ROBOTS = ("upright", "sliding", "bars", "fork")
TURNED = tuple(Rotation.from_rotvec([0.4, -0.7, 0.3]).as_quat().tolist())
CORNERS = tuple(map(tuple, (np.random.default_rng(5).normal(size=(30, 3)) * [0.15, 0.1, 0.2]).tolist()))
EXAMPLES: dict[str, Obstacle] = {  # by the names that scenarios have for shapes
    "box": Box(center=(0.5, 0.2, 0.7), quaternion=TURNED, size=(0.2, 0.3, 0.1)),
    "sphere": Ball(center=(-0.5, 0.3, 0.6), radius=0.15),
    "capsule": Capsule(center=(0.3, -0.6, 0.6), quaternion=TURNED, radius=0.07, length=0.4),
    "cylinder": Cylinder(center=(0.4, 0.5, 1.0), quaternion=TURNED, radius=0.12, length=0.2),
    "half-space": HalfSpace(center=(0.0, 0.0, -0.4), quaternion=TURNED),
    "ellipsoid": Ellipsoid(center=(-0.4, -0.5, 0.8), quaternion=TURNED, semi_axes=(0.1, 0.2, 0.15)),
    "polytope": Polytope(center=(0.1, 0.7, 0.7), quaternion=TURNED, points=CORNERS),
}
SCENE = tuple(EXAMPLES.values())


def world_of(robot: SpatialArm, obstacles: tuple[Obstacle, ...]) -> CompiledWorld:
    """The world of what the core knows."""
    world = CompiledWorld.of(robot, obstacles)
    assert world is not None
    return world


@dataclass(frozen=True)
class LinkBalls:
    """Balls of a link, or one sphere: the number of the body, its name, centres (n, 3) and radii (n,)."""

    body: int
    name: str
    centers: np.ndarray
    radii: np.ndarray


def links_and_pairs(robot: SpatialArm) -> tuple[list[LinkBalls], tuple[tuple[int, int], ...]]:
    if robot.cover is not None:
        links = [LinkBalls(link.body, link.name, link.balls.centers, link.balls.radii) for link in robot.cover.links]
        return links, robot.cover.pairs if robot.self_collision else ()
    each = [LinkBalls(s.link, s.name, np.array([s.center], dtype=float), np.array([s.radius])) for s in robot.spheres]
    return each, (*robot.kept_pairs, *robot.proven_pairs) if robot.self_collision else ()


def placed(robot: SpatialArm, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (n, dof + 1, 3, 3) and origins (n, dof + 1, 3) of all bodies, a product of transformations anew."""
    turn = np.broadcast_to(np.array(robot.base_frame.rotation), (len(theta), 3, 3))
    place = np.broadcast_to(np.array(robot.base_frame.translation), (len(theta), 3))
    turns, places = [turn], [place]
    for number, (joint, value) in enumerate(zip(robot.chain.joints, theta.T, strict=True)):
        on = number if joint.parent is None else joint.parent
        turn, place = turns[on], places[on]
        place = place + turn @ np.array(joint.pose.translation)
        turn = turn @ np.array(joint.pose.rotation)
        if joint.kind is JointKind.PRISMATIC:
            place = place + value[:, None] * (turn @ np.array(joint.axis, dtype=float))
        else:
            turn = turn @ Rotation.from_rotvec(value[:, None] * np.array(joint.axis)).as_matrix()
        turns.append(turn)
        places.append(place)
    return np.stack(turns, axis=1), np.stack(places, axis=1)


def distances(obstacle: Obstacle, points: np.ndarray) -> np.ndarray:
    """Of points (n, 3), with a sign: (n,)."""
    if isinstance(obstacle, Polytope):
        return obstacle.exact_distances(points)
    return as_array(obstacle.point_clearance(ca.DM(points))).ravel()


def seen_from(obstacle: Obstacle, points: np.ndarray, times: np.ndarray | None) -> tuple[Obstacle, np.ndarray]:
    """An obstacle that stands still, and points (n, b, 3) as they are beside it at times (n,)."""
    if not isinstance(obstacle, MovingObstacle):
        return obstacle, points
    motion = obstacle.motion
    assert isinstance(motion, ConstantVelocity) and times is not None
    return obstacle.still, points - (motion.origin + times[:, None] * np.array(motion.velocity))[:, None]


def margins(
    robot: SpatialArm, obstacles: tuple[Obstacle, ...], theta: np.ndarray, times: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """How much more than they must all balls keep of obstacles, and of each other, both (n,); infinite of nothing.

    Obstacles that move, at constant velocities, are where they are at times (n,), s.
    """
    links, pairs = links_and_pairs(robot)
    turns, places = placed(robot, theta)
    centers = [places[:, None, k.body] + np.einsum("nij,bj->nbi", turns[:, k.body], k.centers) for k in links]
    others = placed(robot, np.random.default_rng(0).uniform(-0.3, 0.3, (5, robot.dof)))
    outside = np.full(len(theta), np.inf)
    for link, here in zip(links, centers, strict=True):
        at_random = others[1][:, None, link.body] + np.einsum("nij,bj->nbi", others[0][:, link.body], link.centers)
        if np.ptp(at_random, axis=0).max() < 1e-12:
            continue  # no joint moves it
        for obstacle in obstacles:
            if (link.name, obstacle.name) not in robot.may_touch:
                still, seen = seen_from(obstacle, here, times)
                found = distances(still, seen.reshape(-1, 3)).reshape(here.shape[:2]) - link.radii
                outside = np.minimum(outside, found.min(axis=1) - robot.margin)
    own, kept = np.full(len(theta), np.inf), robot.margin if robot.cover is None else robot.self_margin
    for one, two in pairs:
        apart = np.linalg.norm(centers[one][:, :, None] - centers[two][:, None], axis=3)
        apart -= links[one].radii[:, None] + links[two].radii + kept
        own = np.minimum(own, apart.min(axis=(1, 2)))
    return outside, own


def postures(robot: SpatialArm, rng: np.random.Generator, count: int) -> np.ndarray:
    """At random within the joints' ranges, (n, dof)."""
    assert robot.position_limits is not None
    low, high = np.array(robot.position_limits).T
    return rng.uniform(low, high, (count, robot.dof))


def through(stops: np.ndarray, degree: int, rng: np.random.Generator, wild: float = 0.3) -> Trajectory:
    """A motion through postures (m, dof), between them polynomials at random; how wild, as a share of the way."""
    pieces = []
    for start, end in pairwise(stops):
        powers = wild * rng.normal(size=(degree, stops.shape[1])) * np.abs(end - start)
        pieces.append(np.concatenate([start[None], powers + (end - start - powers.sum(axis=0)) / degree]))
    return Trajectory.from_pieces(rng.uniform(0.2, 2.0, len(pieces)), pieces)
