"""When samples are passed: against quadrature, finite differences and motions that stand still first."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from problems.sequential.path_speed import RESTING, Clock, MotionSpace, PathSpeed, TimeShift
from problems.sequential.polish import delayed, timed

SPACE = MotionSpace(path_pieces=4, speed_pieces=8)
WAITS = 5
CLOCK = Clock(SPACE, np.concatenate([np.zeros(WAITS), SPACE.even(3)]), WAITS)


@pytest.fixture
def motion() -> PathSpeed:
    rng = np.random.default_rng(8)
    controls = rng.normal(0.0, 1.0, (SPACE.path.size, 2))
    controls[:RESTING], controls[-RESTING:] = controls[0], controls[-1]
    return PathSpeed(SPACE, controls, rng.uniform(0.5, 1.5, SPACE.speed.size), delay=0.7)


def test_times_are_the_delay_and_the_integral_of_the_slowness(motion: PathSpeed) -> None:
    def slowness(u: float) -> float:
        return 1.0 / float((SPACE.speed.matrix(np.array([u])) @ motion.speeds)[0])

    times = CLOCK.times(motion)
    assert times[: WAITS + 1] == pytest.approx(0.7 * np.arange(WAITS + 1) / WAITS)
    for sample in (WAITS + 1, WAITS + 10, times.size - 1):
        breaks = np.arange(1, 8) / 8.0
        exact = quad(slowness, 0.0, CLOCK.u[sample], points=breaks[breaks < CLOCK.u[sample]], epsabs=1e-12)[0]
        assert times[sample] == pytest.approx(0.7 + exact, rel=1e-9)
    assert motion.duration == pytest.approx(times[-1], rel=1e-6)


def test_slopes_of_times_are_finite_differences(motion: PathSpeed) -> None:
    h, slopes = 1e-6, CLOCK.slopes(motion)
    for number, step in enumerate(np.eye(SPACE.speed.size) * h):
        moved = [CLOCK.times(replace(motion, speeds=motion.speeds + s * step)) for s in (1.0, -1.0)]
        assert slopes[:, number] == pytest.approx((moved[0] - moved[1]) / (2.0 * h), abs=1e-8)
    moved = [CLOCK.times(replace(motion, delay=0.7 + s * h)) for s in (1.0, -1.0)]
    assert slopes[:, -1] == pytest.approx((moved[0] - moved[1]) / (2.0 * h), abs=1e-8)


def test_a_motion_with_a_delay_stands_still_and_then_is_the_same(motion: PathSpeed) -> None:
    whole, moving = timed(motion), timed(replace(motion, delay=0.0))
    assert whole.duration == pytest.approx(motion.duration, rel=1e-6)
    assert whole.at(np.array([0.0, 0.3, 0.7])) == pytest.approx(np.tile(motion.controls[0], (3, 1)))
    assert not whole.at(np.linspace(0.0, 0.69, 5), 1).any()
    times = np.linspace(0.0, moving.duration, 50)
    for order in range(3):
        assert whole.at(times + 0.7, order) == pytest.approx(moving.at(times, order), rel=1e-9, abs=1e-9)
    assert (delayed(moving, 0.7).coefficients == whole.coefficients).all()


def test_standing_still_costs_a_little_less_than_moving(motion: PathSpeed) -> None:
    quicker = motion.slowed(0.9)
    waits = replace(quicker, delay=motion.duration - quicker.duration + quicker.delay)
    assert waits.duration == pytest.approx(motion.duration)
    assert waits.cost < motion.cost < motion.duration
    assert replace(motion, delay=0.0).cost == replace(motion, delay=0.0).duration


def test_rows_of_a_time_shift_bound_it_on_both_sides() -> None:
    rows, bounds = TimeShift(np.array([[-0.5, -0.25, 1.0]]), most=0.1).rows(free=2)
    assert rows.tolist() == [[0.0, 0.0, -5.0, -2.5, 10.0], [0.0, 0.0, 5.0, 2.5, -10.0]]
    assert bounds.tolist() == [1.0, 1.0]


def test_with_more_parts_a_motion_that_all_but_stands_still_takes_as_long_as_its_samples_say(motion: PathSpeed) -> None:
    speeds = motion.speeds.copy()
    speeds[4:7] = 0.005
    slow = replace(motion, space=replace(SPACE, parts=8), speeds=speeds)
    exact = timed(slow, in_piece=64).duration
    assert slow.duration == pytest.approx(exact, rel=1e-4)
    assert CLOCK.times(slow)[-1] == pytest.approx(exact, rel=1e-2)
    h = 1e-7
    for number, step in enumerate(np.eye(SPACE.speed.size) * h):
        moved = [replace(slow, speeds=speeds + s * step).duration for s in (1.0, -1.0)]
        assert slow.duration_slopes[number] == pytest.approx((moved[0] - moved[1]) / (2.0 * h), rel=1e-4, abs=1e-4)
