"""A path and the speed along it: times, quantities in time and torques, against quadrature and finite differences."""

from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad

from problems.base import FloatArray
from problems.limits import TorqueLimit
from problems.robots import JointLimits
from problems.robots.planar import MassiveLinks
from problems.sequential.descent import at_best_speed
from problems.sequential.limit_rows import JointTorques, MotionLimits, derivative_limit_rows, torque_limit_rows
from problems.sequential.path_speed import RESTING, Clock, MotionSpace, PathSpeed
from problems.sequential.polish import with_timing

SPACE = MotionSpace(path_pieces=4, speed_pieces=8)
LIMITS = JointLimits(speed=(2.0, 1.5), acceleration=(10.0, 8.0), jerk=(200.0, 150.0))


def some_motion(seed: int, spread: float = 1.0, delay: float = 0.0) -> PathSpeed:
    rng = np.random.default_rng(seed)
    controls = rng.normal(0.0, spread, (SPACE.path.size, 2))
    controls[:RESTING], controls[-RESTING:] = controls[0], controls[-1]
    return PathSpeed(SPACE, controls, rng.uniform(0.5, 1.5, SPACE.speed.size), delay=delay)


@pytest.fixture
def motion() -> PathSpeed:
    return some_motion(3)


@pytest.fixture
def waiting() -> PathSpeed:
    return some_motion(8, delay=0.7)


@pytest.fixture
def gentle() -> PathSpeed:
    return some_motion(3, spread=0.6)


def test_derivatives_are_those_of_the_motion_in_time(motion: PathSpeed) -> None:
    trajectory = with_timing(motion, in_piece=40)
    grid = SPACE.grid(SPACE.even(40))
    times = trajectory.breakpoints
    for order, expected in enumerate(motion.derivatives(grid)[:2], start=1):
        assert trajectory.at(times, order) == pytest.approx(expected, rel=1e-8, abs=1e-8)
    middle = slice(2, -2)
    jerks = np.gradient(motion.derivatives(grid)[1], times, axis=0)
    assert motion.derivatives(grid)[2][middle] == pytest.approx(jerks[middle], rel=0.1, abs=0.1 * np.abs(jerks).max())


def moved(motion: PathSpeed, make: Callable[[PathSpeed], Any]) -> Iterator[tuple[FloatArray, FloatArray]]:
    """The change of a motion's rows in random directions: by their slopes, by finite differences."""
    slopes, rng, h = make(motion).slopes(np.eye(motion.controls.size)), np.random.default_rng(5), 1e-6
    for _ in range(5):
        d, e = rng.normal(size=motion.controls.shape), rng.normal(size=motion.speeds.size)
        both = (make(PathSpeed(SPACE, motion.controls + s * d, motion.speeds + s * e)).values for s in (h, -h))
        yield slopes @ np.concatenate([d.ravel(), e]), np.subtract(*both) / (2.0 * h)


def test_slopes_of_the_rows_are_finite_differences(motion: PathSpeed) -> None:
    grid = SPACE.grid(SPACE.even(4))
    for found, expected in moved(motion, lambda each: derivative_limit_rows(each, grid, 1, LIMITS)):
        assert found == pytest.approx(expected, rel=1e-5, abs=1e-5 * np.abs(expected).max())


WAITS = 5
CLOCK = Clock(SPACE, np.concatenate([np.zeros(WAITS), SPACE.even(3)]), WAITS)


def test_times_are_the_delay_and_the_integral_of_the_slowness(waiting: PathSpeed) -> None:
    def slowness(u: float) -> float:
        return 1.0 / float((SPACE.speed.matrix(np.array([u])) @ waiting.speeds)[0])

    times = CLOCK.times(waiting)
    assert times[: WAITS + 1] == pytest.approx(0.7 * np.arange(WAITS + 1) / WAITS)
    for sample in (WAITS + 1, WAITS + 10, times.size - 1):
        breaks = np.arange(1, 8) / 8.0
        exact = quad(slowness, 0.0, CLOCK.u[sample], points=breaks[breaks < CLOCK.u[sample]], epsabs=1e-12)[0]
        assert times[sample] == pytest.approx(0.7 + exact, rel=1e-9)
    assert waiting.duration == pytest.approx(times[-1], rel=1e-6)


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


def shares(gentle: PathSpeed, u: np.ndarray) -> np.ndarray:
    """Torques over their limits at parameters, from the robot itself: (n, 2)."""
    grid = SPACE.grid(u)
    velocity, acceleration, _ = gentle.derivatives(grid)
    torque = arm().dynamics.torques(ca.DM(gentle.theta(grid)), ca.DM(velocity), ca.DM(acceleration))
    return np.asarray(ca.DM(torque).full()) / BOUNDS


def test_shares_are_torques_over_their_limits(gentle: PathSpeed, torques: JointTorques) -> None:
    grid = SPACE.grid(SPACE.even(4))
    assert torques.shares(gentle.state(grid)) == pytest.approx(shares(gentle, grid.u), rel=1e-12, abs=1e-12)


def test_slopes_of_the_rows_of_torques_are_finite_differences(gentle: PathSpeed, torques: JointTorques) -> None:
    grid = SPACE.grid(SPACE.even(4))
    for found, expected in moved(gentle, lambda each: torque_limit_rows(each, grid, 1, torques)):
        keeps_sign = np.abs(expected) < 1e3  # Coulomb friction jumps where a joint turns back
        assert keeps_sign.sum() > 0.9 * expected.size
        scale = np.abs(expected[keeps_sign]).max()
        assert found[keeps_sign] == pytest.approx(expected[keeps_sign], rel=1e-5, abs=1e-5 * scale)


def test_the_pace_of_a_path_keeps_torques_and_is_not_even(gentle: PathSpeed, torques: JointTorques) -> None:
    grid = SPACE.grid(SPACE.even(16))
    kept = MotionLimits(arm().limits, torques)
    even = gentle.time_scaled(kept.time_scale(gentle, grid))
    fast = at_best_speed(even, kept, kept.linear(even, grid, 4), grid)
    assert fast.duration < 0.98 * even.duration
    assert (fast.controls == even.controls).all()
    assert np.abs(shares(fast, grid.u)).max() <= 1.0 + 1e-9
