"""Balls of covers that the polish keeps apart, against the covers themselves."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from helpers.meshed import covered_arm

from problems import CertificateStatus
from problems.families.splines import move
from problems.limits import Clearance, CoverClearance, cover_limits
from problems.robots import SpatialArm
from problems.scene.solids import Box
from problems.sequential.cover_pairs import CoverPairs
from problems.sequential.pair_clearances import PairClearances
from problems.tasks import Joints, Move
from problems.timing.free_space import rest_to_rest

BOXES = (Box(center=(0.5, 0.1, 0.6), size=(0.1, 0.2, 0.3)), Box(center=(-0.3, 0.4, 0.9), size=(0.2, 0.1, 0.1)))
START, GOAL = (0.0, 2.8, 1.4), (0.0, 1.8, 2.5)  # the upper link folds back to the lower one


@pytest.fixture(scope="module")
def arm() -> SpatialArm:
    return covered_arm()


def postures(seed: int, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    return np.random.default_rng(seed).uniform(-2.5, 2.5, (count, 3)), np.zeros(count)


def test_nothing_that_is_free_by_the_cover_is_forbidden(arm: SpatialArm) -> None:
    pairs = CoverPairs.of(arm, BOXES).joined(*postures(1), proof_margin=0.01)
    theta, times = postures(2)
    least = np.min([limit.nearest(theta, times).clearance for limit in cover_limits(arm, BOXES)], axis=0)
    near = pairs.nearness.near(theta, times, 0.1)
    assert (near.clearances >= least[near.samples] - 1e-9).all()


def test_where_balls_were_found_clearances_are_those_of_the_cover(arm: SpatialArm) -> None:
    theta, times = postures(1)
    pairs = CoverPairs.of(arm, BOXES).joined(theta, times, proof_margin=0.01)
    least = np.min([limit.nearest(theta, times).clearance for limit in cover_limits(arm, BOXES)], axis=0)
    near, found = pairs.nearness.near(theta, times, 0.1), np.full(len(theta), np.inf)
    np.minimum.at(found, near.samples, near.clearances)
    touching = least < 0.0
    assert touching.sum() > 10
    np.testing.assert_allclose(found[touching], least[touching], atol=1e-9)
    assert pairs.joined(theta, times, proof_margin=0.01).count == pairs.count


def test_own_links_that_touch_on_the_way_are_led_past_each_other(arm: SpatialArm) -> None:
    problem = move(Move(arm, Joints(START), (Joints(GOAL),)), pieces=4)
    line = rest_to_rest(np.array(START), np.array(GOAL), arm.limits)
    (limit,) = cover_limits(arm, ())
    assert not isinstance(limit, CoverClearance)
    times = line.times(50)
    assert limit.nearest(line.at(times), times).clearance.min() < -0.005
    slowed = (motion.time_scaled(problem.safe_time_scale(motion)) for motion in problem.direct.polished(line))
    proven = [
        all(v.status is CertificateStatus.CERTIFIED for v in problem.verify(motion)) for motion in islice(slowed, 2)
    ]
    assert proven == [False, True]


@pytest.mark.slow
def test_a_gap_too_narrow_for_the_spheres_of_a_search_is_passed(arm: SpatialArm) -> None:
    """The links lie level, 30 mm thick on each side; plates leave 42 mm, spheres take 50."""
    level = np.array([[0.0, np.pi / 2.0, 0.0], [1.0, np.pi / 2.0, 0.0]])
    plates = tuple(Box(center=(0.45, 0.25, 0.46 + side * 0.052), size=(0.2, 0.1, 0.02)) for side in (-1.0, 1.0))
    first, last = (Joints(tuple(row)) for row in level.tolist())
    problem, line = move(Move(arm, first, (last,), obstacles=plates), pieces=4), rest_to_rest(*level, arm.limits)
    (spheres,) = (limit for limit in problem.limits if limit.name == "clearance")
    assert isinstance(spheres, Clearance)
    assert PairClearances(arm, (spheres,)).near(line.at(line.times(50)), line.times(50), 0.1).clearances.min() < -0.005
    motion = next(problem.direct.polished(line))
    motion = motion.time_scaled(problem.safe_time_scale(motion))
    assert all(verdict.status is CertificateStatus.CERTIFIED for verdict in problem.verify(motion))
    assert motion.duration < 1.1 * line.duration
