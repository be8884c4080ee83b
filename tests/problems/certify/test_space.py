"""Certificates in space against 20,000 samples of a checker of its own: none is false, and few are missing."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from helpers.space import LENGTHS, TOOL, small_arm
from scipy.spatial.transform import Rotation

from problems import Box, Capsule, CertificateStatus, Obstacle, Trajectory
from problems.certify import ClearanceProof, prove_clearance
from problems.limits import proximity_limits
from problems.robots import SpatialArm, Sphere

SAMPLES = 20_000
SCENES = 100
IN_EVERY_RUN = 3
MARGIN = 0.01
SPHERES = (
    *(Sphere(2, (0.0, 0.0, 0.1 * k), 0.06, "upper arm") for k in range(4)),
    *(Sphere(4, (0.0, 0.0, 0.1 * k), 0.05, "forearm") for k in range(4)),
    *(Sphere(7, (0.0, 0.0, 0.05 * k), 0.04, "hand") for k in range(4)),
)
PAIRS = tuple((one, two) for one in range(4) for two in range(8, 12))
ARM: SpatialArm = small_arm(spheres=SPHERES, kept_pairs=PAIRS, margin=MARGIN, self_collision=True)


def scene(rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Boxes and capsules beside the arm."""
    obstacles: list[Obstacle] = []
    for k in range(4):
        way = rng.normal(size=3)
        center = tuple((np.array([0.0, 0.0, 0.6]) + rng.uniform(0.5, 1.1) * way / np.linalg.norm(way)).tolist())
        turn = tuple(Rotation.random(random_state=int(rng.integers(1 << 30))).as_quat().tolist())
        if k % 2:
            obstacles.append(Capsule(center=center, quaternion=turn, radius=0.06, length=0.3))
        else:
            obstacles.append(Box(center=center, quaternion=turn, size=tuple(rng.uniform(0.05, 0.4, 3).tolist())))
    return tuple(obstacles)


def motion(rng: np.random.Generator) -> Trajectory:
    """Two quintics one after the other, from rest to rest each; the joints that carry the arm turn less."""
    postures = rng.uniform(-1.0, 1.0, (3, 7)) * [1.5, 0.5, 1.0, 1.0, 1.5, 1.0, 1.5]
    powers = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
    pieces = [powers[:, None] * (b - a) + np.eye(6)[:, :1] * a for a, b in pairwise(postures)]
    return Trajectory.from_pieces(rng.uniform(0.5, 2.0, 2), pieces)


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


def distances(obstacle: Obstacle, points: np.ndarray) -> np.ndarray:
    """Of points (m, 3) outside an obstacle, 0 inside; (m,), m."""
    local = Rotation.from_quat(obstacle.quaternion).inv().apply(points - obstacle.center)
    if isinstance(obstacle, Box):
        half = np.array(obstacle.size) / 2.0
        return np.linalg.norm(local - np.clip(local, -half, half), axis=1)
    ends = np.array([[0.0, 0.0, -0.15], [0.0, 0.0, 0.15]])
    share = np.clip((local - ends[0]) @ (ends[1] - ends[0]) / 0.09, 0.0, 1.0)
    return np.maximum(0.0, np.linalg.norm(local - ends[0] - share[:, None] * (ends[1] - ends[0]), axis=1) - 0.06)


def nearest(trajectory: Trajectory, obstacles: tuple[Obstacle, ...]) -> tuple[dict[str, float], dict[str, float]]:
    """The smallest clearance of each pair at many samples, from obstacles, and of spheres from each other, m."""
    centers = sphere_centers(trajectory.at(np.linspace(0.0, trajectory.duration, SAMPLES)))
    radii = np.array([sphere.radius for sphere in SPHERES])
    outside = [distances(o, centers.reshape(-1, 3)).reshape(centers.shape[:2]) - radii for o in obstacles]
    between = [np.linalg.norm(centers[:, a] - centers[:, b], axis=1) - radii[a] - radii[b] for a, b in PAIRS]
    return (
        {f"{k}, {n}": float(d) for n, each in enumerate(outside, start=1) for k, d in enumerate(each.min(axis=0))},
        {f"{a}, {b}": float(each.min()) for (a, b), each in zip(PAIRS, between, strict=True)},
    )


def test_the_second_kinematics_are_the_arms() -> None:
    theta = np.random.default_rng(0).uniform(-2.0, 2.0, (20, 7))
    first = len(LENGTHS) + 1
    frames = np.stack([np.array(place) for place in ARM.positions(ca.DM(theta))], axis=1)
    assert frames[:, first:-1] == pytest.approx(sphere_centers(theta), abs=1e-12)
    assert frames[0, -1, 2] <= sum(LENGTHS) + TOOL


@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=[] if k < IN_EVERY_RUN else pytest.mark.slow) for k in range(SCENES)]
)
def test_no_certificate_is_false(seed: int) -> None:
    rng = np.random.default_rng(seed)
    obstacles, trajectory = scene(rng), motion(rng)
    clearance, self_clearance = proximity_limits(ARM, obstacles)
    outside, between = nearest(trajectory, obstacles)
    within_reach = [f"{ARM.number_of(pair.body)}, {pair.number}" for pair in clearance.pairs if pair.can_touch(ARM)]
    check(prove_clearance(clearance, trajectory), min(outside.values()), min(outside[pair] for pair in within_reach))
    check(prove_clearance(self_clearance, trajectory), min(between.values()), min(between.values()))


def check(proof: ClearanceProof | None, sampled: float, sampled_within_reach: float) -> None:
    assert proof is not None
    if proof.status is CertificateStatus.CERTIFIED:
        assert sampled >= MARGIN
        assert MARGIN <= proof.proven <= sampled_within_reach + 1e-9
        assert proof.proven >= MARGIN + 0.8 * (sampled_within_reach - MARGIN) - 1e-9
    else:
        assert sampled < MARGIN + 1e-4
