"""Motions that deviate from the direct one: what their rows say is what they do."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.motions import JointPath, Trajectory
from problems.polish import Deviations
from problems.polish.deviation import smoothed
from problems.robots import JointLimits
from problems.timing import retime

LIMITS = {
    "jerk": JointLimits(speed=(2.0, 1.0, 3.0), acceleration=(10.0, 5.0, 8.0), jerk=(100.0, 80.0, 300.0)),
    "no jerk": JointLimits(speed=(2.0, 1.0, 3.0), acceleration=(10.0, 5.0, 8.0)),
}
START, GOAL = np.array([0.0, 0.5, 1.0]), np.array([2.0, 0.6, 1.0])  # the last joint is not needed


@pytest.fixture(params=LIMITS)
def motions(request: pytest.FixtureRequest) -> Deviations:
    return Deviations(START, GOAL, LIMITS[request.param])


def deviation(motions: Deviations, seed: int, size: float = 0.3) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, size, (motions.free, motions.dof))


@given(seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_it_keeps_the_limits_of_its_joints_and_reaches_one(seed: int) -> None:
    for limits in LIMITS.values():
        motions = Deviations(START, GOAL, limits)
        x = deviation(motions, seed)
        found = motions.trajectory(x, motions.time_scale(motions.padded(x)))
        peaks = [
            np.abs(found.at(found.extreme_times(order), order)).max(axis=0) / bound
            for order, bound in enumerate(limits.by_order, start=1)
        ]
        assert 1.0 - 1e-3 <= max(map(np.max, peaks)) <= 1.0 + 1e-9
        ends = found.breakpoints[[0, -1]]
        np.testing.assert_allclose(found.at(ends), [START, GOAL], atol=1e-12)
        np.testing.assert_allclose(found.at(ends, 1), 0.0, atol=1e-9)


def test_postures_are_those_of_the_motion(motions: Deviations) -> None:
    x, u = deviation(motions, 1), motions.parameters()
    found = motions.trajectory(x, 3.0)
    for order in range(3):
        expected = found.at(u * found.duration, order) * found.duration**order
        np.testing.assert_allclose(motions.postures(u, order).values(motions.padded(x)), expected, atol=1e-8)


def test_a_way_is_followed(motions: Deviations) -> None:
    way = np.array([START, [1.0, 1.5, 1.3], [2.0, 1.5, 0.8], GOAL])
    theta = motions.postures(motions.parameters()).values(motions.padded(motions.fitted(way)))
    for corner in way[1:-1]:
        assert np.abs(theta - corner).max(axis=1).min() < 0.1


def test_gentler_limits_change_the_beginning_and_not_the_bound() -> None:
    limits = LIMITS["jerk"]
    gentler = JointLimits(speed=limits.speed, acceleration=(2.0, 1.0, 2.0), jerk=(20.0, 10.0, 20.0))
    usual, other = Deviations(START, GOAL, limits), Deviations(START, GOAL, limits, gentler=gentler)
    assert other.bound == usual.bound
    still = np.zeros((other.free, other.dof))
    assert other.direct.duration > usual.bound
    assert usual.bound < other.time_scale(other.padded(still)) < other.direct.duration


BENT = np.array([START, [1.2, 0.9, 1.3], [1.5, 0.2, 0.8], GOAL])


def peaks(trajectory: Trajectory, order: int) -> np.ndarray:
    return np.asarray(np.abs(trajectory.at(trajectory.extreme_times(order), order)).max(axis=0))


@pytest.mark.parametrize("limits", LIMITS.values(), ids=LIMITS.keys())
def test_a_smoothed_motion_keeps_the_limits_and_is_nowhere_far(limits: JointLimits) -> None:
    known = retime(JointPath.through(BENT), limits)
    found, step = smoothed(known, 240), known.duration / 240
    assert found.duration == pytest.approx(known.duration + 2.0 * step)
    for order, bound in enumerate(limits.by_order, start=1):
        assert (peaks(found, order) <= bound * (1.0 + 1e-8)).all()
    ends = found.breakpoints[[0, -1]]
    np.testing.assert_allclose(found.at(ends), [START, GOAL], atol=1e-12)
    np.testing.assert_allclose([found.at(ends, order) for order in (1, 2)], 0.0, atol=1e-6)
    times = found.times(2001)
    away = found.at(times) - known.at(np.clip(times - step, 0.0, known.duration))
    assert (np.abs(away) <= peaks(known, 1) * step).all()


@pytest.mark.parametrize("limits", LIMITS.values(), ids=LIMITS.keys())
def test_motions_may_deviate_from_one_that_is_known(limits: JointLimits) -> None:
    known = retime(JointPath.through(BENT), limits)
    motions = Deviations(START, GOAL, limits, around=known)
    still = np.zeros((motions.free, motions.dof))
    least = motions.least_duration(still, motions.direct.duration)
    assert motions.bound < least <= motions.direct.duration * (1.0 + 1e-6)
    same = motions.trajectory(still, motions.direct.duration)
    shares = np.linspace(0.0, 1.0, 101)
    np.testing.assert_allclose(
        same.at(shares * same.duration), motions.direct.at(shares * motions.direct.duration), atol=1e-9
    )
    other = motions.trajectory(deviation(motions, 1), motions.direct.duration)
    for order, bound in enumerate(limits.by_order, start=1):
        assert (peaks(other, order) <= bound * (1.0 + 1e-6)).all()
