"""Torques of motions as shares of their limits, against the robot's own dynamics and finite differences."""

import casadi as ca
import numpy as np
import pytest

from problems.limits import TorqueLimit
from problems.polish import JointTorques
from problems.robots.planar import MassiveLinks
from problems.timing import rest_to_rest

BOUNDS = (60.0, 25.0)
ARM = MassiveLinks(
    link_lengths=(0.6, 0.5), max_speed=(4.0, 4.0), max_acceleration=(40.0, 40.0), max_torque=BOUNDS,
    link_masses=(4.0, 2.0), viscous_friction=(1.5, 0.5), coulomb_friction=(0.7, 0.2),
)  # fmt: skip
TORQUES = JointTorques(TorqueLimit(ARM))
STATES = np.random.default_rng(1).uniform(-2.0, 2.0, (50, 6))


def shares(state: np.ndarray) -> np.ndarray:
    torque = ARM.dynamics.torques(*(ca.DM(part) for part in np.split(state, 3, axis=1)))
    return np.asarray(ca.DM(torque).full()) / BOUNDS


def test_shares_are_torques_over_their_limits_and_slopes_are_finite_differences() -> None:
    assert TORQUES.shares(STATES) == pytest.approx(shares(STATES), rel=1e-12, abs=1e-12)
    slopes, h = TORQUES.slopes(STATES).reshape(50, 2, 6), 1e-6
    for column, step in enumerate(h * np.eye(6)):
        expected = (shares(STATES + step) - shares(STATES - step)) / (2.0 * h)
        assert slopes[:, :, column] == pytest.approx(expected, abs=1e-6)


def test_a_motion_run_at_the_time_scale_just_keeps_them() -> None:
    motion = rest_to_rest(np.array([-1.0, 0.4]), np.array([0.8, -0.9]), ARM.limits)
    times = motion.times(400)
    scale = TORQUES.time_scale_of(motion, times)
    assert scale > 1.0
    slower = motion.time_scaled(scale)
    state = np.concatenate([slower.at(times * scale, order) for order in range(3)], axis=1)
    assert np.abs(shares(state)).max() == pytest.approx(1.0, rel=1e-9)
