"""Joints that use the time that the slowest one leaves them: durations, limits, ends, waits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.robots import JointLimits
from problems.timing import Phasing, least_durations, rest_to_rest

JERKY = JointLimits(speed=(2.0, 1.0, 3.0), acceleration=(8.0, 5.0, 10.0))
SMOOTH = JointLimits(speed=(2.0, 1.0, 3.0), acceleration=(8.0, 5.0, 10.0), jerk=(60.0, 40.0, 100.0))
START, GOAL = np.array([0.0, 0.2, -0.5]), np.array([0.4, -1.0, 0.1])


@pytest.mark.parametrize("limits", [JERKY, SMOOTH], ids=["trapezoids", "double-S"])
@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(0.0, 1.0), min_size=6, max_size=6))
def test_it_takes_as_long_and_keeps_all_limits(limits: JointLimits, shares: list[float]) -> None:
    phasing = Phasing(np.array(shares[:3]), np.array(shares[3:]))
    motion, usual = rest_to_rest(START, GOAL, limits, phasing), rest_to_rest(START, GOAL, limits)
    assert motion.duration == pytest.approx(usual.duration, rel=1e-12)
    times = np.linspace(0.0, motion.duration, 2001)
    np.testing.assert_allclose(motion.at(times[[0, -1]]), [START, GOAL], atol=1e-9)
    for order, bound in enumerate(limits.by_order, start=1):
        assert (np.abs(motion.at(times, order)) <= bound * (1.0 + 1e-6)).all()
    np.testing.assert_allclose(motion.at(times[[0, -1]], 1), 0.0, atol=1e-9)
    own = least_durations(GOAL - START, limits)
    lengths = own + phasing.stretches * (motion.duration - own)
    waits = phasing.waits * (motion.duration - lengths)
    for joint in range(3):
        before, after = times < waits[joint] - 1e-9, times > waits[joint] + lengths[joint] + 1e-9
        np.testing.assert_allclose(motion.at(times[before])[:, joint], START[joint], atol=1e-9)
        np.testing.assert_allclose(motion.at(times[after])[:, joint], GOAL[joint], atol=1e-9)


def test_all_of_the_time_is_the_usual_motion() -> None:
    same = rest_to_rest(START, GOAL, SMOOTH, Phasing(np.ones(3), np.zeros(3)))
    times = np.linspace(0.0, same.duration, 101)
    np.testing.assert_allclose(same.at(times), rest_to_rest(START, GOAL, SMOOTH).at(times), atol=1e-9)


def test_a_joint_that_does_not_move_waits_for_ever() -> None:
    limits = JointLimits(speed=(2.0, 2.0), acceleration=(10.0, 10.0))
    motion = rest_to_rest(np.zeros(2), np.array([0.0, 1.0]), limits, Phasing(np.zeros(2), np.array([0.3, 0.3])))
    assert not motion.at(np.linspace(0.0, motion.duration, 50))[:, 0].any()
