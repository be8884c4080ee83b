"""The least tracking error that bounds measured rows: it holds for all of them, and no smaller one does."""

from __future__ import annotations

import numpy as np

from problems.robots import least_tracking_error

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
