"""Proofs about obstacles that move, against dense samples of distances written without them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pytest
from helpers.space import LENGTHS, small_arm
from oracles.moving import Table, random_table
from oracles.outlines import dense, inside, skeletons, to_segment

from problems import (
    Ball,
    Box,
    Capsule,
    CertificateStatus,
    Cylinder,
    Ellipse,
    Ellipsoid,
    HalfSpace,
    InvalidProblem,
    Obstacle,
    PlanarArm,
    Polygon,
    Rectangle,
    Trajectory,
)
from problems.certify import ClearanceProof, ClosestApproach, closest_approach, prove_clearance
from problems.limits import Clearance, reachable_pairs
from problems.robots import Robot, Sphere
from problems.scene import Tabulated
from problems.scene.moving import ConstantVelocity, MovingObstacle, ObstacleMotion
from tests.problems.certify.test_space import SPHERES, motion, sphere_centers

SAMPLES = 2000
SEEDS = 2
Frames = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
ARM = PlanarArm((0.6, 0.5, 0.4), (4.0,) * 3, (20.0,) * 3, margin=0.01)
SPATIAL = small_arm(spheres=SPHERES, margin=0.01)
CORNERS = np.array([[-0.15, -0.1], [0.2, -0.1], [0.15, 0.12], [0.0, 0.02], [-0.1, 0.15]])
PLANAR: dict[str, tuple[Obstacle, np.ndarray]] = {
    "ellipse": (
        Ellipse((0.0, 0.0), (0.2, 0.1)),
        np.column_stack([0.2 * np.cos(a := np.linspace(0.0, 2.0 * np.pi, 200)), 0.1 * np.sin(a)]),
    ),
    "box": (
        Rectangle((0.0, 0.0), (0.3, 0.1)),
        dense(np.array([[-0.15, -0.05], [0.15, -0.05], [0.15, 0.05], [-0.15, 0.05]]), 50),
    ),
    "polygon": (Polygon(tuple(map(tuple, CORNERS.tolist()))), dense(CORNERS, 40)),
}
SPHERICAL = np.random.default_rng(0).normal(size=(2000, 3))
SPHERICAL /= np.linalg.norm(SPHERICAL, axis=1, keepdims=True)


def of_ball(p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(p, axis=1) - 0.15


def of_box(p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.maximum(np.abs(p) - [0.1, 0.15, 0.05], 0.0), axis=1)


def of_capsule(p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(p - np.clip(p, [0.0, 0.0, -0.2], [0.0, 0.0, 0.2]), axis=1) - 0.07


def of_cylinder(p: np.ndarray) -> np.ndarray:
    across = np.maximum(np.hypot(p[:, 0], p[:, 1]) - 0.12, 0.0)
    return np.hypot(across, np.maximum(np.abs(p[:, 2]) - 0.1, 0.0))


def of_ellipsoid(p: np.ndarray) -> np.ndarray:
    surface = SPHERICAL * [0.1, 0.2, 0.15]
    return np.concatenate(
        [np.linalg.norm(part[:, None] - surface, axis=2).min(axis=1) for part in np.array_split(p, 40)]
    )


def of_half_space(p: np.ndarray) -> np.ndarray:
    return p[:, 2] + 0.9


SOLIDS: dict[str, tuple[Obstacle, Callable[[np.ndarray], np.ndarray]]] = {
    "sphere": (Ball(center=(0.0, 0.0, 0.0), radius=0.15), of_ball),
    "box": (Box(center=(0.0, 0.0, 0.0), size=(0.2, 0.3, 0.1)), of_box),
    "capsule": (Capsule(center=(0.0, 0.0, 0.0), radius=0.07, length=0.4), of_capsule),
    "cylinder": (Cylinder(center=(0.0, 0.0, 0.0), radius=0.12, length=0.2), of_cylinder),
    "ellipsoid": (Ellipsoid(center=(0.0, 0.0, 0.0), semi_axes=(0.1, 0.2, 0.15)), of_ellipsoid),
    "half-space": (HalfSpace(center=(0.0, 0.0, -0.9)), of_half_space),
}
SPARSE = {"ellipsoid": 100}  # samples, where one takes long
KINDS = ("velocity", "table", "turning table")
each_kind = pytest.mark.parametrize("kind", KINDS)


def moving_frame(rng: np.random.Generator, dim: int, kind: str, height: float) -> tuple[ObstacleMotion, Frames]:
    """A frame that comes near the arm, and where it is by SciPy alone."""
    if kind == "velocity":
        way = rng.normal(size=dim)
        origin = np.append(rng.uniform(0.3, 0.8) * way[:2] / np.linalg.norm(way[:2]), [height] * (dim - 2))
        velocity = 0.4 * rng.normal(size=dim)

        def frames(times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return origin + np.outer(times, velocity), np.broadcast_to(np.eye(dim), (len(times), dim, dim))

        return ConstantVelocity(tuple(velocity.tolist()), tuple(origin.tolist())), frames
    while True:
        table = random_table(rng, dim, kind == "turning table")
        table = replace(table, places=table.places + np.append([0.6, 0.0], [height] * (dim - 2)))
        try:
            return Tabulated.through(table.times.tolist(), table.places, table.turns), table.frames
        except InvalidProblem:
            continue


@dataclass(frozen=True)
class Case:
    """A motion, its proof, its closest approach, and what samples say: distances at times."""

    proof: ClearanceProof | None
    closest: ClosestApproach | None
    times: np.ndarray
    distances: np.ndarray
    rate: float

    def check(self, margin: float, coarse: float) -> CertificateStatus:
        """No certificate is false, and where there is none, samples come as near; ``coarse`` m is what these miss."""
        assert self.proof is not None and self.closest is not None
        kept = self.distances - self.rate * self.times
        if self.proof.status is CertificateStatus.CERTIFIED:
            assert kept.min() >= self.proof.proven - 1e-9
            assert self.proof.proven >= margin
        else:
            assert kept.min() < margin + coarse
        if self.distances.min() > coarse:
            assert self.closest.distance <= self.distances.min() + 1e-6
            assert self.closest.distance >= self.distances.min() - coarse
        return self.proof.status


def planar_case(shape: str, kind: str, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    frame, frames = moving_frame(rng, 2, kind, 0.0)
    still, outline = PLANAR[shape]
    rate = float(rng.choice([0.0, 0.05]))
    trajectory = quintics(rng.uniform(-1.5, 1.5, (3, 3)), rng)
    times = np.linspace(0.0, trajectory.duration, SAMPLES // 10)
    origins, axes = frames(times)
    places = skeletons(ARM, trajectory.at(times))[:, :4]
    seen = np.einsum("nij,nmi->nmj", axes, places - origins[:, None])
    found = [min(to_segment(outline, *pair).min() for pair in pairwise(posture)) for posture in seen]
    entered = [inside(outline, posture).any() for posture in seen]
    obstacle = MovingObstacle(still, frame, rate)
    return case(ARM, obstacle, trajectory, times, np.where(entered, 0.0, found), rate)


def solid_case(shape: str, kind: str, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    frame, frames = moving_frame(rng, 3, kind, 0.6)
    still, distance = SOLIDS[shape]
    rate = float(rng.choice([0.0, 0.05]))
    trajectory = motion(rng)
    times = np.linspace(0.0, trajectory.duration, SPARSE.get(shape, SAMPLES))
    origins, axes = frames(times)
    centers = sphere_centers(trajectory.at(times))[:, 1:]  # no joint moves the first one
    seen = np.einsum("nij,nmi->nmj", axes, centers - origins[:, None])
    radii = np.array([sphere.radius for sphere in SPHERES[1:]])
    found = (distance(seen.reshape(-1, 3)).reshape(seen.shape[:2]) - radii).min(axis=1)
    return case(SPATIAL, MovingObstacle(still, frame, rate), trajectory, times, found, rate)


def case(
    robot: Robot, obstacle: Obstacle, trajectory: Trajectory, times: np.ndarray, distances: np.ndarray, rate: float
) -> Case:
    limit = Clearance(robot, reachable_pairs(robot, [obstacle]))
    proof, closest = prove_clearance(limit, trajectory), closest_approach(limit, trajectory)
    return Case(proof, closest, times, distances, rate)


def quintics(postures: np.ndarray, rng: np.random.Generator) -> Trajectory:
    """From rest to rest from posture to posture."""
    powers = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
    pieces = [powers[:, None] * (b - a) + np.eye(6)[:, :1] * a for a, b in pairwise(postures)]
    return Trajectory.from_pieces(rng.uniform(0.4, 1.5, len(pieces)), pieces)


@each_kind
@pytest.mark.parametrize("shape", PLANAR)
def test_in_the_plane(shape: str, kind: str) -> None:
    for seed in range(SEEDS):
        planar_case(shape, kind, seed).check(ARM.margin, 0.02)


@each_kind
@pytest.mark.parametrize("shape", SOLIDS)
def test_in_space(shape: str, kind: str) -> None:
    for seed in range(SEEDS if shape not in SPARSE else 1):
        solid_case(shape, kind, seed).check(SPATIAL.margin, 0.03 if shape in SPARSE else 0.005)


@pytest.mark.slow
@each_kind
@pytest.mark.parametrize("shape", SOLIDS)
def test_in_space_many_times(shape: str, kind: str) -> None:
    for seed in range(100, 150 if shape not in SPARSE else 110):
        solid_case(shape, kind, seed).check(SPATIAL.margin, 0.03 if shape in SPARSE else 0.005)


def test_some_are_certified_and_some_are_not() -> None:
    statuses = Counter(solid_case("box", kind, seed).check(0.01, 0.005) for kind in KINDS for seed in range(4))
    assert statuses[CertificateStatus.CERTIFIED] >= 2
    assert statuses[CertificateStatus.VIOLATED] >= 2


def still_arm(seconds: float) -> Trajectory:
    """The planar arm stretched along x for so long."""
    return Trajectory(np.array([0.0, seconds]), np.zeros((1, 1, 3)))


def limit_of(obstacle: Obstacle) -> Clearance:
    return Clearance(ARM, reachable_pairs(ARM, [obstacle]))


def test_by_hand_a_disc_that_comes_down_onto_the_arm() -> None:
    """Its lower edge is at y = 1 - 0.5 t; with 0.1 m/s of doubt, 1 - 0.6 t is left of what 1 cm has to be kept."""
    disc = Ellipse((1.0, 1.2), (0.2, 0.2))
    motion = ConstantVelocity((0.0, -0.5))
    for rate, fine, wrong in ((0.0, 1.9, 2.0), (0.1, 1.6, 1.7)):
        limit = limit_of(MovingObstacle(disc, motion, rate))
        proofs = [prove_clearance(limit, still_arm(seconds)) for seconds in (fine, wrong)]
        assert [proof and proof.status for proof in proofs] == [CertificateStatus.CERTIFIED, CertificateStatus.VIOLATED]
        proof, closest = proofs[0], closest_approach(limit, still_arm(fine))
        assert proof is not None and closest is not None
        left = 1.0 - (0.5 + rate) * fine
        assert left - 0.1 * (left - 0.01) - 1e-3 <= proof.proven <= left
        assert closest.distance == pytest.approx(1.0 - 0.5 * fine, abs=1e-6)  # the disc itself, without any doubt
        assert closest.time == pytest.approx(fine, abs=1e-6)
        assert closest.pair == "link 2, obstacle 1"


def test_by_hand_a_disc_that_passes() -> None:
    """From (3, 0.5) to the left: nearest to the tip at (1.5, 0) where it is above it, and from then on to the links."""
    passing = MovingObstacle(Ellipse((3.0, 0.5), (0.1, 0.1)), ConstantVelocity((-1.0, 0.1)))
    closest = closest_approach(limit_of(passing), still_arm(2.0))
    assert closest is not None
    t = (1.5 - 0.05) / 1.01  # of the line from the tip: (1.5 - t)^2 + (0.5 + 0.1 t)^2 is least
    assert closest.time == pytest.approx(t, abs=1e-4)
    assert closest.distance == pytest.approx(np.hypot(1.5 - t, 0.5 + 0.1 * t) - 0.1, abs=1e-7)
    assert closest.pair == "link 3, obstacle 1"


def test_the_end_of_the_motion_is_covered_and_a_table_may_end_in_between() -> None:
    """It reaches the arm at t = 1 exactly, where its table ends; until then all is well."""
    table = Tabulated.through([0.0, 0.5, 1.0], np.array([[0.0, 0.0], [0.0, -0.5], [0.0, -1.0]]))
    limit = limit_of(MovingObstacle(Ellipse((1.0, 1.2), (0.2, 0.2)), table))
    statuses = [prove_clearance(limit, still_arm(seconds)) for seconds in (0.98, 1.0, 5.0)]
    assert [proof and proof.status for proof in statuses] == [
        CertificateStatus.CERTIFIED,
        CertificateStatus.VIOLATED,
        CertificateStatus.VIOLATED,
    ]


def test_a_half_space_without_end_may_turn() -> None:
    """A wall far below that swings up about the origin by a quarter turn: how far it is, the sphere's place says."""
    turns = np.array([[np.sin(a / 2.0), 0.0, 0.0, np.cos(a / 2.0)] for a in np.linspace(0.0, 1.2, 4)])
    swinging = Tabulated.through([0.0, 1.0, 2.0, 3.0], np.zeros((4, 3)), turns)
    limit = Clearance(SPATIAL, reachable_pairs(SPATIAL, [MovingObstacle(HalfSpace(center=(0.0, 0.0, -0.9)), swinging)]))
    still = Trajectory(np.array([0.0, 3.0]), np.zeros((1, 1, 7)))
    proof = prove_clearance(limit, still)
    assert proof is not None and proof.status is CertificateStatus.CERTIFIED
    times = np.linspace(0.0, 3.0, 2000)
    _, axes = swinging_axes(turns, times)
    heights = np.einsum("ni,mi->nm", axes[:, :, 2], sphere_centers(np.zeros((1, 7)))[0, 1:]) + 0.9
    sampled = (heights - [sphere.radius for sphere in SPHERES[1:]]).min()
    assert 0.85 * sampled < proof.proven <= sampled


def swinging_axes(turns: np.ndarray, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return Table(np.arange(4.0), np.zeros((4, 3)), turns).frames(times)


def test_bodies_farther_out_than_the_tool_count() -> None:
    """The bound of a turning wall without end goes by the farthest body, here 1 m beside the last link."""
    far = small_arm(spheres=(Sphere(7, (1.0, 0.0, 0.0), 0.05, "boom"),))
    turns = np.array([[0.0, 0.0, np.sin(a / 2.0), np.cos(a / 2.0)] for a in (0.0, 0.5, 1.0)])
    wall = HalfSpace(center=(0.0, 0.0, -0.5))
    (pair,) = reachable_pairs(far, [MovingObstacle(wall, Tabulated.through([0.0, 1.0, 2.0], np.zeros((3, 3)), turns))])
    (travel,) = pair.own_travel(far, np.array([[0.4, 0.6]]))
    assert travel >= 0.5 * 0.1 * np.hypot(sum(LENGTHS), 1.0) * 0.99


def test_where_nothing_can_come_near_there_is_no_closest_approach() -> None:
    assert closest_approach(Clearance(ARM, ()), still_arm(1.0)) is None
