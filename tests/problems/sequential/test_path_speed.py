"""A path and the speed along it: quantities in time against finite differences, and the motion exact in time."""

import numpy as np
import pytest
from scipy.integrate import quad

from problems.robots import JointLimits
from problems.sequential.kept_limits import limit_rows
from problems.sequential.path_speed import RESTING, MotionSpace, PathSpeed
from problems.sequential.polish import fitted, timed
from problems.timing.free_space import rest_to_rest

SPACE = MotionSpace(path_pieces=4, speed_pieces=8)
LIMITS = JointLimits(speed=(2.0, 1.5), acceleration=(10.0, 8.0), jerk=(200.0, 150.0))


@pytest.fixture
def motion() -> PathSpeed:
    rng = np.random.default_rng(3)
    controls = rng.normal(0.0, 1.0, (SPACE.path.size, 2))
    controls[:RESTING], controls[-RESTING:] = controls[0], controls[-1]
    return PathSpeed(SPACE, controls, rng.uniform(0.5, 1.5, SPACE.speed.size))


def test_the_duration_is_the_integral_of_the_slowness(motion: PathSpeed) -> None:
    def slowness(u: float) -> float:
        return 1.0 / float((SPACE.speed.matrix(np.array([u])) @ motion.speeds)[0])

    exact = quad(slowness, 0.0, 1.0, points=np.linspace(0.0, 1.0, 9)[1:-1], epsabs=1e-12)[0]
    assert motion.duration == pytest.approx(exact, rel=1e-6)


def test_slopes_of_the_duration_are_finite_differences(motion: PathSpeed) -> None:
    step = 1e-6 * np.eye(SPACE.speed.size)
    moved = [
        PathSpeed(SPACE, motion.controls, motion.speeds + e).duration
        - PathSpeed(SPACE, motion.controls, motion.speeds - e).duration
        for e in step
    ]
    assert motion.duration_slopes == pytest.approx(np.array(moved) / 2e-6, rel=1e-6)


def test_derivatives_are_those_of_the_motion_in_time(motion: PathSpeed) -> None:
    trajectory = timed(motion, in_piece=40)
    grid = SPACE.grid(SPACE.even(40))
    times = trajectory.breakpoints
    for order, expected in enumerate(motion.derivatives(grid)[:2], start=1):
        assert trajectory.at(times, order) == pytest.approx(expected, rel=1e-8, abs=1e-8)
    middle = slice(2, -2)
    jerks = np.gradient(motion.derivatives(grid)[1], times, axis=0)
    assert motion.derivatives(grid)[2][middle] == pytest.approx(jerks[middle], rel=0.1, abs=0.1 * np.abs(jerks).max())


def test_pieces_in_time_meet_and_rest_at_both_ends(motion: PathSpeed) -> None:
    trajectory = timed(motion)
    times = trajectory.breakpoints
    assert trajectory.duration == pytest.approx(motion.duration, rel=1e-6)
    for order in range(3):
        after = trajectory.at(times[1:-1], order)
        before = trajectory.at(np.nextafter(times[1:-1], 0.0), order)
        assert before == pytest.approx(after, rel=1e-9, abs=1e-9)
    assert trajectory.at(times[[0, -1]]) == pytest.approx(motion.controls[[0, -1]], abs=1e-12)
    for order in (1, 2):
        assert np.abs(trajectory.at(times[[0, -1]], order)).max() < 1e-9


def test_stretch_is_what_brings_the_worst_limit_to_its_bound(motion: PathSpeed) -> None:
    grid = SPACE.grid(SPACE.even(16))
    slowed = motion.slowed(motion.stretch(grid, LIMITS))
    assert slowed.stretch(grid, LIMITS) == pytest.approx(1.0)
    bounds = (LIMITS.speed, LIMITS.acceleration, LIMITS.jerk)
    shares = [np.abs(d) / np.array(b) for d, b in zip(slowed.derivatives(grid), bounds, strict=True) if b is not None]
    assert max(share.max() for share in shares) == pytest.approx(1.0)
    assert slowed.duration == pytest.approx(motion.duration * motion.stretch(grid, LIMITS))


def test_slopes_of_the_rows_are_finite_differences(motion: PathSpeed) -> None:
    grid = SPACE.grid(SPACE.even(4))
    rows = limit_rows(motion, grid, 1, LIMITS)
    moves = np.eye(motion.controls.size)
    slopes = rows.slopes(moves)
    rng = np.random.default_rng(5)
    for _ in range(5):
        d, e = rng.normal(size=motion.controls.shape), rng.normal(size=motion.speeds.size)
        h = 1e-6
        values = [
            limit_rows(PathSpeed(SPACE, motion.controls + s * h * d, motion.speeds + s * h * e), grid, 1, LIMITS).values
            for s in (1.0, -1.0)
        ]
        expected = (values[0] - values[1]) / (2.0 * h)
        assert slopes @ np.concatenate([d.ravel(), e]) == pytest.approx(
            expected, rel=1e-5, abs=1e-5 * np.abs(expected).max()
        )


def test_a_peak_between_the_samples_of_rows_is_a_row(motion: PathSpeed) -> None:
    grid = SPACE.grid(SPACE.even(16))
    fast = motion.slowed(motion.stretch(grid, LIMITS))
    assert np.abs(limit_rows(fast, grid, 10_000, LIMITS).values).max() == pytest.approx(1.0)


def test_a_motion_that_the_splines_hold_is_fitted_closely() -> None:
    space = MotionSpace(path_pieces=12, speed_pieces=24)
    line = rest_to_rest(np.zeros(2), np.array([1.0, -0.5]), LIMITS)
    start = fitted(line, space)
    u = np.linspace(0.0, 1.0, 101)
    assert space.path.matrix(u) @ start.controls == pytest.approx(line.at(u * line.duration), abs=5e-3)
    assert start.duration == pytest.approx(line.duration)
    assert (start.controls[:RESTING] == line.at(np.zeros(1))).all()
