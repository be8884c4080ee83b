"""Room proven for all t from obstacles that move: against many samples, the proof in NumPy, and a closed form."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from helpers.core_robots import ROBOTS, margins, postures, robot_of, slider, through
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from problems.certify import CertificateStatus, prove_among
from problems.core import Separation, drifts_of, is_known
from problems.motions import Trajectory
from problems.robots import SpatialArm
from problems.scene import Ball, ConstantVelocity, HalfSpace, MovingObstacle, Obstacle, Tabulated

HAIR = 1e-9  # m
SHAPES = (Ball(center=(0.1, 0.0, 0.1), radius=0.1), Ball(center=(0.0, 0.0, 0.0), radius=0.25))


def moving(rng: np.random.Generator) -> dict[int, Obstacle]:
    """Balls that pass, one that stands still."""
    found: dict[int, Obstacle] = {3: Ball(center=(2.0, 0.0, 0.5), radius=0.2)}
    for number, shape in enumerate(SHAPES, start=5):
        origin, velocity = rng.uniform(-0.9, 0.9, 3), rng.uniform(-0.5, 0.5, 3)
        motion = ConstantVelocity(tuple(velocity.tolist()), tuple(origin.tolist()))
        found[number] = MovingObstacle(shape, motion, float(rng.choice([0.0, 0.1])))
    return found


def motion_of(robot: SpatialArm, rng: np.random.Generator) -> Trajectory:
    stops = postures(robot, rng, 3)
    return through(stops[:1] + 0.2 * (stops - stops[:1]), int(rng.choice([1, 3, 5])), rng)


def least_room(robot: SpatialArm, obstacles: dict[int, Obstacle], motion: Trajectory, count: int = 30) -> float:
    """At many times, from obstacles where they are then, less what their margins have grown."""
    times = np.linspace(0.0, motion.duration, count)
    theta, least, apart = motion.at(times), np.inf, replace(robot, self_collision=False)
    for each in obstacles.values():
        grown = each.margin_rate * times if isinstance(each, MovingObstacle) else 0.0
        least = min(least, float(np.min(margins(apart, (each,), theta, times)[0] - grown)))
    return least


@pytest.mark.parametrize("name", ROBOTS)
def test_no_proof_is_false_and_what_is_clear_is_proven(name: str) -> None:
    robot, statuses = robot_of(name), Counter[CertificateStatus]()
    for seed in range(10):
        rng = np.random.default_rng(seed)
        obstacles, motion = moving(rng), motion_of(robot, rng)
        proof = prove_among(robot, obstacles, motion, Separation.FROM_OBSTACLES, 0.1)
        assert proof is not None
        room = least_room(robot, obstacles, motion)
        if proof.status is CertificateStatus.CERTIFIED:
            assert proof.proven - robot.margin <= room + HAIR
            assert proof.smallest - robot.margin == pytest.approx(room, abs=0.1)
        else:
            assert room < 0.05  # samples do not see all of it
        statuses[proof.status] += 1
    assert statuses[CertificateStatus.CERTIFIED] and statuses[CertificateStatus.VIOLATED]


@settings(max_examples=80)
@given(
    st.floats(-1.0, 1.0), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(0.0, 0.5),
    st.sampled_from([-HAIR, HAIR]),
)  # fmt: skip
def test_a_floor_that_follows_a_ball(start: float, speed: float, rising: float, rate: float, wanted: float) -> None:
    """The room is a line in time, so that it is least at one end of the motion."""
    radius, closing = 0.125, rising + rate - speed
    aside = 0.4  # more than how fast the floor slides along itself
    assume(abs(closing) > 0.2 * (abs(speed) + abs(rising) + rate + aside))  # else cells as short as the room prove it
    height = start - radius - max(closing, 0.0) - wanted
    floor = MovingObstacle(
        HalfSpace(center=(0.0, 0.0, 0.0)), ConstantVelocity((0.3, 0.1, rising), (0.0, 0.0, height)), rate
    )
    motion = Trajectory(np.array([0.0, 1.0]), np.array([[[speed]], [[start]]]))
    proof = prove_among(slider(radius), {1: floor}, motion, Separation.FROM_OBSTACLES, 1.0)
    assert proof is not None
    assert (proof.status is CertificateStatus.CERTIFIED) == (wanted > 0.0)
    assert proof.where == "ball, obstacle 1"


def test_the_core_knows_straight_lines_alone() -> None:
    class Curved(ConstantVelocity):
        """Its statement may be another."""

    ball = SHAPES[0]
    straight = MovingObstacle(ball, ConstantVelocity((0.1, 0.2, 0.3), (1.0, 2.0, 3.0)), 0.4)
    table = MovingObstacle(ball, Tabulated.along_lines([0.0, 1.0], np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])))
    curved = MovingObstacle(ball, Curved((0.1, 0.0, 0.0)))
    assert [is_known(each) for each in (ball, straight, table, curved)] == [True, True, False, False]
    found = drifts_of([ball, straight, table, curved])
    assert np.array_equal(found, [[0.0] * 7, [1.0, 2.0, 3.0, 0.1, 0.2, 0.3, 0.4], [0.0] * 7, [0.0] * 7])
