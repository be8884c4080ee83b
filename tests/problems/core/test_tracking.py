"""Joints that are off what is planned: room and proofs against postures drawn within their errors."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from helpers.core_robots import ROBOTS, SCENE, postures, robot_of, through, world_of
from helpers.slow import slow_except

from problems.base import FloatArray
from problems.certify import CertificateStatus, prove
from problems.limits import (
    Clearance,
    CoverClearance,
    CoverSelfClearance,
    Limit,
    SelfClearance,
    complete_limits,
    limits_of,
)
from problems.motions import Trajectory
from problems.robots import SpatialArm, TrackingError

HAIR = 1e-9  # m
each_robot = pytest.mark.parametrize("name", ROBOTS)
one_robot_often = pytest.mark.parametrize("name", slow_except(ROBOTS, 1))


def tracked(robot: SpatialArm, constant: float, speed: float = 0.0, acceleration: float = 0.0) -> SpatialArm:
    each = [tuple([part] * robot.dof) for part in (constant, speed, acceleration)]
    return replace(robot, tracking=TrackingError(*each))


def off(theta: FloatArray, errors: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Postures within the errors, half of them in corners."""
    drawn = rng.uniform(-1.0, 1.0, theta.shape)
    return theta + errors * np.where(rng.random((len(theta), 1)) < 0.5, np.sign(drawn), drawn)


@one_robot_often
def test_room_is_no_more_than_any_posture_within_the_errors_has(name: str) -> None:
    robot, rng = robot_of(name), np.random.default_rng(2)
    exact, world = world_of(robot, SCENE), world_of(tracked(robot, 0.02), SCENE)
    theta, errors = postures(robot, rng, 20), rng.uniform(0.0, 0.04, (20, robot.dof))
    room, at_rest, planned = (
        world.clearance_margins(theta, errors=errors),
        world.clearance_margins(theta),
        exact.clearance_margins(theta),
    )
    lost = []
    for _ in range(12):
        there = exact.clearance_margins(off(theta, errors, rng))
        assert (there >= room - HAIR).all()
        lost.append(planned - there)
        assert (exact.clearance_margins(off(theta, np.full_like(theta, 0.02), rng)) >= at_rest - HAIR).all()
    assert (planned - room).mean() < 4.0 * np.max(lost, axis=0).mean()  # all joints at their worst are seldom drawn
    np.testing.assert_array_equal(world.clearance_margins(theta, errors=np.zeros_like(theta)), planned)
    alone = [world.clearance_margins(theta[k : k + 1], errors=errors[k : k + 1])[0] for k in range(len(theta))]
    np.testing.assert_allclose(room, alone, rtol=0.0, atol=1e-12)
    near = world.nearby(theta, np.inf, errors=errors)
    least = np.full(len(theta), np.inf)
    np.minimum.at(least, near.samples, near.clearance_margins)
    np.testing.assert_allclose(least, room, rtol=0.0, atol=HAIR)
    assert (world.clear(theta) == (at_rest >= 0.0)).all()


def motion_of(robot: SpatialArm, rng: np.random.Generator) -> Trajectory:
    stops = postures(robot, rng, 3)
    return through(stops[:1] + 0.2 * (stops - stops[:1]), int(rng.choice([3, 5])), rng)


@one_robot_often
def test_no_proof_is_false_of_motions_within_the_errors(name: str) -> None:
    robot, statuses = robot_of(name), Counter[bool | None]()
    own = tracked(robot, 0.004, 0.003, 0.0005)
    exact, world = world_of(robot, SCENE), world_of(own, SCENE)
    assert own.tracking is not None
    for seed in range(8):
        rng = np.random.default_rng(seed)
        motion = motion_of(robot, rng)
        proof = world.prove(motion, gap=0.1)
        statuses[proof.status] += 1
        times = np.append(motion.times(150), motion.breakpoints[1:] - 1e-9)  # accelerations may jump
        theta, errors = motion.at(times), own.tracking.at(motion.at(times, 1), motion.at(times, 2))
        if proof.status:
            there = min(exact.clearance_margins(off(theta, errors, rng)).min() for _ in range(3))
            assert proof.proven <= there + HAIR
            assert proof.proven >= 0.85 * world.clearance_margins(theta, errors=errors).min() - HAIR
            assert exact.prove(motion, gap=0.1).proven > proof.proven
        else:
            assert world.clearance_margins(theta, errors=errors).min() < 0.02
    assert statuses[True] and statuses[False]


def limits_on_distances(robot: SpatialArm) -> list[Limit]:
    kinds = (Clearance, SelfClearance, CoverClearance, CoverSelfClearance)
    found = complete_limits(limits_of(robot, SCENE), robot, SCENE)
    return [limit for limit in found if isinstance(limit, kinds)]


@pytest.mark.parametrize("name", [name for name in ROBOTS if robot_of(name).cover is None])
def test_the_proofs_by_pairs_keep_the_same_room_or_more(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, compared = tracked(robot_of(name), 0.003, 0.002), 0
    world = world_of(robot, SCENE)
    motions = [motion_of(robot, np.random.default_rng(seed)) for seed in range(8)]
    known = [world.prove(motion, gap=0.1) for motion in motions]
    monkeypatch.setattr("problems.certify.verification.prove_clearance_in_core", lambda limit, trajectory: None)
    for motion, proof in zip(motions, known, strict=True):
        verdicts = [verdict for limit in limits_on_distances(robot) for verdict in prove(limit, motion)]
        if all(verdict.status is CertificateStatus.CERTIFIED for verdict in verdicts):
            assert proof.status  # levers are those of the posture in the core, and the longest there can be in them
            compared += 1
    assert compared


def test_what_only_the_error_breaks_is_not_said_to_be_broken() -> None:
    robot, world = robot_of("upright"), world_of(robot_of("upright"), SCENE)
    for seed in range(40):
        theta = postures(robot, np.random.default_rng(seed), 1)
        room = world.clearance_margins(theta)[0]
        if 0.0 < room < 0.03:
            break
    standing = Trajectory.standing(theta[0], 1.0)
    statuses = [
        {verdict.status for limit in limits_on_distances(each) for verdict in prove(limit, standing)}
        for each in (robot, tracked(robot, 0.1))
    ]
    assert statuses[0] == {CertificateStatus.CERTIFIED}
    assert CertificateStatus.UNDECIDED in statuses[1] and CertificateStatus.VIOLATED not in statuses[1]
