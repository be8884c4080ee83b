"""Tracking errors: the least one that bounds measured rows, and what is left of an arm whose joints are off."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.space import small_arm

from problems import InvalidProblem, PlanarArm
from problems.robots import TrackingError, least_tracking_error

ROUNDED = 1.0 + 1e-9  # what a linear program leaves


def test_no_smaller_bound_has_the_same_mean() -> None:
    rng = np.random.default_rng(4)
    errors, speed, acceleration = (rng.uniform(0.0, part, (400, 1)) for part in (0.01, 1.0, 5.0))
    found = least_tracking_error(errors, speed, acceleration)
    mean = found.at(speed, acceleration).mean()
    assert (errors <= found.at(speed, acceleration) * ROUNDED).all()
    for _ in range(200):  # any other bound of the same rows has a larger mean
        shares = rng.uniform(0.0, [0.01, 0.01, 0.002])
        rows = np.column_stack([np.ones(400), speed, acceleration]) @ shares
        scale = (errors[:, 0] / rows).max()
        assert scale * rows.mean() >= mean * (1.0 - 1e-6)


def test_noise_of_several_joints_is_within_the_bound() -> None:
    rng = np.random.default_rng(1)
    times = np.linspace(0.0, 2.0, 600)
    rates = [np.column_stack([c * np.cos(2.0 * times), -c * np.sin(3.0 * times)]) for c in (2.0, 4.0)]
    errors = rng.normal(0.0, 0.002, rates[0].shape)
    assert (np.abs(errors) <= least_tracking_error(errors, *rates).at(*rates) * ROUNDED).all()


def test_errors_of_an_arm_add_up_and_leave_less_of_its_ranges() -> None:
    own = TrackingError((0.01,) * 4, (0.1,) * 4, (0.0,) * 4)
    once, twice = (arm.within((0.002,) * 4) for arm in (small_arm(4), small_arm(4, tracking=own)))
    assert once.joint_errors == (0.002,) * 4
    assert small_arm(4).at_any_speed.joint_errors is None
    np.testing.assert_allclose(twice.at_any_speed.tracking.numbers, [[0.212] * 4, [0.0] * 4, [0.0] * 4])
    np.testing.assert_allclose(twice.joint_errors, [0.01 + 0.1 * 2.0 + 0.002] * 4)
    assert once.limits.position == ((-2.798, 2.798),) * 4
    with pytest.raises(InvalidProblem, match="PlanarArm has no tracking error"):
        PlanarArm((1.0, 1.0), (1.0, 1.0), (1.0, 1.0)).within((0.1, 0.1))
