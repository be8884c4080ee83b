"""Profiles keep the limits, and no more than that."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import OBJECTIVES, PlanarArm, PointToPoint
from problems.certify import exact_time_scale
from problems.families.two_segments.starts import PROFILES, SYMMETRIC, Ends, PointToPointStarts, Profile
from problems.limits import limits_of


@pytest.mark.parametrize("profile", PROFILES)
def test_peaks_are_those_of_a_fine_grid(profile: Profile) -> None:
    arm = PlanarArm((1.0, 1.0), (1e3, 1e3), (1e6, 1e6))
    starts = PointToPointStarts(PointToPoint(arm, (1.0, 0.0), (0.0, 1.0)), OBJECTIVES["time"])
    motion = starts.along(Ends(np.zeros(2), np.ones(2), 0.0), profile).trajectory()
    at = motion.samples(np.linspace(0.0, motion.duration, 100_001))
    scale = motion.duration
    peak_values = [float(np.abs(np.asarray(v)).max()) for v in (at.speed * scale, at.acceleration * scale**2)]
    assert profile.peaks == pytest.approx(peak_values, rel=1e-6)


def test_the_symmetric_one_by_hand() -> None:
    """t1 = 1/2, theta_m = 1/2, dtheta_m = 3/2: a quartic of zero jerk at its end, then (6)."""
    speed, _ = SYMMETRIC.peaks
    assert speed == pytest.approx(1.7361111, abs=1e-6)
    assert SYMMETRIC.duration(np.array([-2.0, 0.1]), np.array([1.0, 1.0]), np.array([1e9, 1e9]), 0.0) == pytest.approx(
        2.0 * speed
    )
    assert SYMMETRIC.duration(np.zeros(2), np.ones(2), np.ones(2), 0.3) == pytest.approx(0.6)


POSITIVE = st.floats(0.1, 10.0)


@settings(max_examples=40, deadline=None)
@given(
    profile=st.sampled_from(PROFILES),
    way=st.lists(st.floats(-4.0, 4.0), min_size=3, max_size=3),
    speed=st.tuples(POSITIVE, POSITIVE, POSITIVE),
    acceleration=st.tuples(POSITIVE, POSITIVE, POSITIVE),
)
def test_a_motion_along_a_profile_keeps_its_limits_and_is_as_fast_as_they_allow(
    profile: Profile, way: list[float], speed: tuple[float, ...], acceleration: tuple[float, ...]
) -> None:
    arm = PlanarArm((0.7, 0.7, 0.6), speed, acceleration)
    task = PointToPoint(arm, (1.0, 0.0), (0.5, 1.5))
    quantities = PointToPointStarts(task, OBJECTIVES["time"]).along(Ends(np.zeros(3), np.array(way), 0.0), profile)
    shortest = min(float(quantities.t1), float(quantities.t2))
    used = exact_time_scale(limits_of(arm, ()), quantities.trajectory())
    assert used <= 1.0 + 1e-9
    assert shortest >= task.time_box[0] - 1e-12
    assert max(used, task.time_box[0] / shortest) == pytest.approx(1.0, abs=1e-9)
