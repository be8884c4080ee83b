"""Torques along a path and its speed: slopes against finite differences, the stretch against torques themselves."""

import casadi as ca
import numpy as np
import pytest

from problems.limits import TorqueLimit
from problems.robots.planar import MassiveLinks
from problems.sequential.descent import paced
from problems.sequential.kept_limits import JointTorques, KeptLimits, torque_rows
from problems.sequential.path_speed import RESTING, MotionSpace, PathSpeed

SPACE = MotionSpace(path_pieces=4, speed_pieces=8)
BOUNDS = (60.0, 25.0)


def arm(**changes: object) -> MassiveLinks:
    settings = {
        "link_lengths": (0.6, 0.5),
        "max_speed": (4.0, 4.0),
        "max_acceleration": (40.0, 40.0),
        "max_torque": BOUNDS,
        "link_masses": (4.0, 2.0),
        "viscous_friction": (1.5, 0.5),
        "coulomb_friction": (0.7, 0.2),
    }
    return MassiveLinks(**(settings | changes))  # type: ignore[arg-type]


@pytest.fixture
def torques() -> JointTorques:
    return JointTorques(TorqueLimit(arm()))


@pytest.fixture
def motion() -> PathSpeed:
    rng = np.random.default_rng(3)
    controls = rng.normal(0.0, 0.6, (SPACE.path.size, 2))
    controls[:RESTING], controls[-RESTING:] = controls[0], controls[-1]
    return PathSpeed(SPACE, controls, rng.uniform(0.5, 1.5, SPACE.speed.size))


def shares(motion: PathSpeed, u: np.ndarray) -> np.ndarray:
    """Torques over their limits at parameters, from the robot itself: (n, 2)."""
    grid = SPACE.grid(u)
    velocity, acceleration, _ = motion.derivatives(grid)
    torque = arm().inverse_dynamics(ca.DM(motion.theta(grid)), ca.DM(velocity), ca.DM(acceleration))
    return np.asarray(ca.DM(torque).full()) / BOUNDS


def test_shares_are_torques_over_their_limits(motion: PathSpeed, torques: JointTorques) -> None:
    grid = SPACE.grid(SPACE.even(4))
    assert torques.shares(motion.state(grid)) == pytest.approx(shares(motion, grid.u), rel=1e-12, abs=1e-12)


def test_slopes_of_the_rows_are_finite_differences(motion: PathSpeed, torques: JointTorques) -> None:
    grid = SPACE.grid(SPACE.even(4))
    slopes = torque_rows(motion, grid, 1, torques).slopes(np.eye(motion.controls.size))
    rng = np.random.default_rng(5)
    for _ in range(5):
        d, e = rng.normal(size=motion.controls.shape), rng.normal(size=motion.speeds.size)
        h = 1e-6
        moved = [PathSpeed(SPACE, motion.controls + s * h * d, motion.speeds + s * h * e) for s in (1.0, -1.0)]
        values = [torque_rows(one, grid, 1, torques).values for one in moved]
        expected = (values[0] - values[1]) / (2.0 * h)
        keeps_sign = np.abs(expected) < 1e3  # Coulomb friction jumps where a joint turns back
        assert keeps_sign.sum() > 0.9 * expected.size
        assert (slopes @ np.concatenate([d.ravel(), e]))[keeps_sign] == pytest.approx(
            expected[keeps_sign], rel=1e-5, abs=1e-5 * np.abs(expected[keeps_sign]).max()
        )


def test_a_peak_between_the_samples_of_rows_is_a_row(motion: PathSpeed, torques: JointTorques) -> None:
    grid = SPACE.grid(SPACE.even(16))
    fast = motion.slowed(torques.time_scale(motion.state(grid)))
    rows = torque_rows(fast, grid, 10_000, torques)
    assert rows.values.size < 50
    assert np.abs(rows.values).max() == pytest.approx(1.0)


@pytest.mark.parametrize("pace", [0.2, 1.0, 5.0])
def test_stretch_brings_the_largest_torque_to_its_limit(motion: PathSpeed, torques: JointTorques, pace: float) -> None:
    grid = SPACE.grid(SPACE.even(16))
    given = motion.slowed(pace)
    slowed = given.slowed(torques.time_scale(given.state(grid)))
    assert np.abs(shares(slowed, grid.u)).max() == pytest.approx(1.0)
    assert np.abs(shares(slowed.slowed(1.3), grid.u)).max() < 1.0


def test_the_pace_of_a_path_keeps_torques_and_is_not_even(motion: PathSpeed, torques: JointTorques) -> None:
    grid = SPACE.grid(SPACE.even(16))
    kept = KeptLimits(arm().limits, torques)
    even = motion.slowed(kept.stretch(motion, grid))
    fast = paced(even, kept, kept.linear(even, grid, 4), grid)
    assert fast.duration < 0.98 * even.duration
    assert (fast.controls == even.controls).all()
    assert np.abs(shares(fast, grid.u)).max() <= 1.0 + 1e-9


def test_without_torque_limits_nothing_is_added(motion: PathSpeed) -> None:
    grid = SPACE.grid(SPACE.even(4))
    kept = KeptLimits(arm().limits)
    assert kept.stretch(motion, grid) == motion.stretch(grid, arm().limits)
    assert len(kept.linear(motion, grid, 1).parts) == 1
