"""Balls of covers that the polish keeps apart, against the covers themselves."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from helpers.meshed import covered_arm

from problems import CertificateStatus
from problems.families.splines import move
from problems.limits import CoverClearance, cover_limits
from problems.robots import SpatialArm
from problems.scene.solids import Box
from problems.sequential.cover_pairs import CoverPairs
from problems.tasks import Joints, Move
from problems.timing.free_space import rest_to_rest

BOXES = (Box(center=(0.5, 0.1, 0.6), size=(0.1, 0.2, 0.3)), Box(center=(-0.3, 0.4, 0.9), size=(0.2, 0.1, 0.1)))
START, GOAL = (0.0, 2.8, 1.4), (0.0, 1.8, 2.5)  # the upper link folds back to the lower one


@pytest.fixture(scope="module")
def arm() -> SpatialArm:
    return covered_arm()


def postures(seed: int, count: int = 200) -> tuple[np.ndarray, np.ndarray]:
    return np.random.default_rng(seed).uniform(-2.5, 2.5, (count, 3)), np.zeros(count)


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


@pytest.mark.slow  # other pairs are led past each other in test_polish.py
def test_own_links_that_touch_on_the_way_are_led_past_each_other(arm: SpatialArm) -> None:
    problem = move(Move(arm, Joints(START), (Joints(GOAL),)), pieces=4)
    line = rest_to_rest(np.array(START), np.array(GOAL), arm.limits)
    (limit,) = cover_limits(arm, ())
    assert not isinstance(limit, CoverClearance)
    times = line.times(50)
    assert limit.nearest(line.at(times), times).clearance.min() < -0.005
    slowed = (motion.time_scaled(problem.criteria.safe_time_scale(motion)) for motion in problem.direct.polished(line))
    proven = [
        all(v.status is CertificateStatus.CERTIFIED for v in problem.criteria.verify(motion))
        for motion in islice(slowed, 2)
    ]
    assert proven == [False, True]
