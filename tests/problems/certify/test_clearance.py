"""Clearances for all t, of obstacles that stand and that move, against dense samples of distances written anew."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
import pytest
from helpers.space import LENGTHS, small_arm
from oracles.moving import KINDS, random_motion
from oracles.outlines import dense, inside, skeletons, to_segment
from scipy.spatial.transform import Rotation

from problems import (
    CertificateStatus,
    ConstantVelocity,
    Joints,
    Move,
    MovingObstacle,
    PlanarArm,
    Rectangle,
    Tabulated,
    Trajectory,
    move,
)
from problems.certify import closest_approach, prove_clearance
from problems.limits import Clearance, reachable_pairs
from problems.robots import Robot, Sphere
from problems.scene import Ellipse, Obstacle, Polygon, Polytope
from problems.scene.solids import Ball, Box, Capsule, Cylinder, Ellipsoid, HalfSpace

SPHERES = (
    *(Sphere(2, (0.0, 0.0, 0.1 * k), 0.06, "upper arm") for k in range(4)),
    *(Sphere(4, (0.0, 0.0, 0.1 * k), 0.05, "forearm") for k in range(4)),
    *(Sphere(7, (0.0, 0.0, 0.05 * k), 0.04, "hand") for k in range(4)),
)
SPATIAL = small_arm(spheres=SPHERES, margin=0.01)


def quintics(postures: np.ndarray, rng: np.random.Generator) -> Trajectory:
    """From rest to rest from posture to posture."""
    powers = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
    pieces = [powers[:, None] * (b - a) + np.eye(6)[:, :1] * a for a, b in pairwise(postures)]
    return Trajectory.from_pieces(rng.uniform(0.5, 2.0, len(pieces)), pieces)


def two_quintics(rng: np.random.Generator) -> Trajectory:
    """Of the arm in space; the joints that carry the arm turn less."""
    return quintics(rng.uniform(-1.0, 1.0, (3, 7)) * [1.5, 0.5, 1.0, 1.0, 1.5, 1.0, 1.5], rng)


def of_box(p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.maximum(np.abs(p) - [0.1, 0.15, 0.05], 0.0), axis=1)


def of_capsule(p: np.ndarray) -> np.ndarray:
    return np.linalg.norm(p - np.clip(p, [0.0, 0.0, -0.2], [0.0, 0.0, 0.2]), axis=1) - 0.07


def sphere_centers(theta: np.ndarray) -> np.ndarray:
    """Forward kinematics of the arm of the helpers, once more: (n, spheres, 3), m."""
    turn, place = Rotation.identity(len(theta)), np.zeros((len(theta), 3))
    frames = [(turn, place)]
    for joint, length in enumerate(LENGTHS):
        place = place + turn.apply([0.0, 0.0, length])
        turn = turn * Rotation.from_rotvec(theta[:, [joint]] * np.eye(3)[2 - joint % 2])
        frames.append((turn, place))
    each = [frames[sphere.link][1] + frames[sphere.link][0].apply(sphere.center) for sphere in SPHERES]
    return np.stack(each, axis=1)


SAMPLES = 2000
ARM = PlanarArm((0.6, 0.5, 0.4), (4.0,) * 3, (20.0,) * 3, margin=0.01)
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


BOX_CORNERS = tuple(product((-0.1, 0.1), (-0.15, 0.15), (-0.05, 0.05)))
SOLIDS: dict[str, tuple[Obstacle, Callable[[np.ndarray], np.ndarray]]] = {
    "sphere": (Ball(center=(0.0, 0.0, 0.0), radius=0.15), of_ball),
    "box": (Box(center=(0.0, 0.0, 0.0), size=(0.2, 0.3, 0.1)), of_box),
    "capsule": (Capsule(center=(0.0, 0.0, 0.0), radius=0.07, length=0.4), of_capsule),
    "cylinder": (Cylinder(center=(0.0, 0.0, 0.0), radius=0.12, length=0.2), of_cylinder),
    "ellipsoid": (Ellipsoid(center=(0.0, 0.0, 0.0), semi_axes=(0.1, 0.2, 0.15)), of_ellipsoid),
    "half-space": (HalfSpace(center=(0.0, 0.0, -0.9)), of_half_space),
    "polytope": (Polytope(points=BOX_CORNERS), of_box),
}
SPARSE = {"ellipsoid": 100}  # samples, where one takes long


@dataclass(frozen=True)
class Case:
    """A motion near what it has to keep clear of, and what samples say: distances at times."""

    limit: Clearance
    trajectory: Trajectory
    times: np.ndarray
    distances: np.ndarray
    rate: float

    def status(self, margin: float, coarse: float) -> CertificateStatus:
        """No certificate is false, and where there is none, samples come as near; ``coarse`` m is what these miss."""
        proof, kept = prove_clearance(self.limit, self.trajectory), self.distances - self.rate * self.times
        assert proof is not None
        if proof.status is CertificateStatus.CERTIFIED:
            assert kept.min() >= proof.proven - 1e-9
            assert proof.proven >= margin + 0.8 * (kept.min() - margin) - coarse
        else:
            assert kept.min() < margin + coarse
        return proof.status

    def check(self, margin: float, coarse: float) -> None:
        """The closest approach too is what samples say."""
        self.status(margin, coarse)
        if self.distances.min() > coarse:
            closest = closest_approach(self.limit, self.trajectory)
            assert closest is not None
            assert closest.distance <= self.distances.min() + 1e-6
            assert closest.distance >= self.distances.min() - coarse


def planar_case(shape: str, kind: str, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    frame, frames = random_motion(rng, kind, (0.6, 0.0), 0.5)
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
    limit = Clearance(ARM, reachable_pairs(ARM, [obstacle]))
    return Case(limit, trajectory, times, np.where(entered, 0.0, found), rate)


def solid_case(shape: str, kind: str, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    frame, frames = random_motion(rng, kind, (0.6, 0.0, 0.6), 0.5)
    still, distance = SOLIDS[shape]
    rate = float(rng.choice([0.0, 0.05]))
    trajectory = two_quintics(rng)
    times = np.linspace(0.0, trajectory.duration, SPARSE.get(shape, SAMPLES))
    origins, axes = frames(times)
    centers = sphere_centers(trajectory.at(times))[:, 1:]  # no joint moves the first one
    seen = np.einsum("nij,nmi->nmj", axes, centers - origins[:, None])
    radii = np.array([sphere.radius for sphere in SPHERES[1:]])
    found = (distance(seen.reshape(-1, 3)).reshape(seen.shape[:2]) - radii).min(axis=1)
    limit = Clearance(SPATIAL, reachable_pairs(SPATIAL, [MovingObstacle(still, frame, rate)]))
    return Case(limit, trajectory, times, found, rate)


def each_shape_and_kind(shapes: Iterable[str]) -> pytest.MarkDecorator:
    """All pairs; each shape with one kind of motion and each kind with a shape in every run."""
    pairs = [(shape, kind, (i + k) % 3) for i, shape in enumerate(shapes) for k, kind in enumerate(KINDS)]
    return pytest.mark.parametrize(
        ("shape", "kind"), [pytest.param(s, k, marks=[pytest.mark.slow] if later else []) for s, k, later in pairs]
    )


@each_shape_and_kind(PLANAR)
def test_in_the_plane(shape: str, kind: str) -> None:
    planar_case(shape, kind, 0).check(ARM.margin, 0.02)


@each_shape_and_kind(SOLIDS)
def test_in_space(shape: str, kind: str) -> None:
    solid_case(shape, kind, 0).check(SPATIAL.margin, 0.03 if shape in SPARSE else 0.005)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", SOLIDS)
def test_in_space_many_times(shape: str, kind: str) -> None:
    for seed in range(100, 150 if shape not in SPARSE else 110):
        solid_case(shape, kind, seed).check(SPATIAL.margin, 0.03 if shape in SPARSE else 0.005)


def test_some_are_certified_and_some_are_not() -> None:
    statuses = Counter(solid_case("box", kind, seed).status(0.01, 0.005) for kind in KINDS for seed in range(3))
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


def test_bodies_farther_out_than_the_tool_count() -> None:
    """The bound of a turning wall without end goes by the farthest body, here 1 m beside the last link."""
    far = small_arm(spheres=(Sphere(7, (1.0, 0.0, 0.0), 0.05, "boom"),))
    turns = np.array([[0.0, 0.0, np.sin(a / 2.0), np.cos(a / 2.0)] for a in (0.0, 0.5, 1.0)])
    wall = HalfSpace(center=(0.0, 0.0, -0.5))
    (pair,) = reachable_pairs(far, [MovingObstacle(wall, Tabulated.through([0.0, 1.0, 2.0], np.zeros((3, 3)), turns))])
    (travel,) = pair.link_travel(far, np.array([[0.4, 0.6]]))
    assert travel >= 0.5 * 0.1 * np.hypot(sum(LENGTHS), 1.0) * 0.99


def test_where_nothing_can_come_near_there_is_no_closest_approach() -> None:
    assert closest_approach(Clearance(ARM, ()), still_arm(1.0)) is None


def test_bodies_that_cannot_touch_are_in_the_least_clearance() -> None:
    """The first link cannot reach the disc, and is nearest to it all the same: 1.2 m below its centre."""
    arm = PlanarArm((1.0, 1.0), (2.0, 2.0), (10.0, 10.0))
    disc = Ellipse((0.5, 1.2), (0.1, 0.1))
    task = Move(arm, Joints((0.0, -1.5)), (Joints((0.0, -1.6)),), obstacles=(disc,))
    problem = move(task)
    assert [str(pair) for limit in problem.criteria.limits if isinstance(limit, Clearance) for pair in limit.pairs] == [
        "link 2, obstacle 1"
    ]
    turned = Trajectory(np.array([0.0, 1.0]), np.array([[[0.0, -0.1]], [[0.0, -1.5]]]))
    (verdict,) = [row for row in problem.criteria.verify(turned) if row.name == "clearance"]
    assert 0.89 * 1.1 <= verdict.worst <= 1.1 and verdict.where.startswith("link 1")
    closest = problem.criteria.closest_approach(turned, ())
    assert closest is not None and closest.distance == pytest.approx(1.1, abs=1e-6)


class Fence(Clearance):
    """A clearance of its own, from what no obstacle of the scene is."""

    name = "fence"

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Fence | None:
        return cls(robot, reachable_pairs(robot, (Rectangle((0.55, 0.45), (0.1, 0.1)),)))


def test_a_clearance_of_another_class_keeps_its_pairs_and_its_name() -> None:
    arm = PlanarArm((1.0, 1.0), (2.0, 2.0), (10.0, 10.0))
    disc = Ellipse((-0.8, -0.3), (0.05, 0.05))
    problem = move(Move(arm, Joints((0.0, 0.2)), (Joints((1.4, 0.2)),), obstacles=(disc,)), limits=[Fence])
    turned = Trajectory(np.array([0.0, 1.0]), np.array([[[1.4, 0.0]], [[0.0, 0.2]]]))
    rows = {row.name: row for row in problem.criteria.verify(turned)}
    assert (
        rows["fence"].status is CertificateStatus.VIOLATED and rows["clearance"].status is CertificateStatus.CERTIFIED
    )
    assert [row.name for row in problem.criteria.verify(turned)].count("clearance") == 1
