"""Moves between two states of motion: known durations, limits, ends, and the least time there is."""

from __future__ import annotations

from dataclasses import replace
from math import nan, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from benchmarks.peers.moving_ends import RandomMove, end_error, largest_excess, random_move, ruckig_duration
from problems import InvalidProblem
from problems.robots import JointLimits
from problems.timing.free_space import JointMove, least_time_move

SLOW = JointLimits(speed=(10.0,), acceleration=(1.0,))
FAST = JointLimits(speed=(2.0,), acceleration=(8.0,))
SMOOTH = JointLimits(speed=(2.0,), acceleration=(8.0,), jerk=(60.0,))


def one_joint(way: float, first: float, last: float, limits: JointLimits) -> float:
    """The least duration of one joint's move, s."""
    start, goal, start_velocity, goal_velocity = (np.array([value]) for value in (0.0, way, first, last))
    return least_time_move(start, goal, start_velocity, goal_velocity, limits).duration


@pytest.mark.parametrize(
    ("move", "limits", "duration"),
    [
        ((0.1, 0.0, 0.0), FAST, 2.0 * sqrt(0.1 / 8.0)),  # bang-bang
        ((3.0, 0.0, 0.0), FAST, 3.0 / 2.0 + 2.0 / 8.0),  # at full speed in between
        ((-0.1, 0.0, 0.0), FAST, 2.0 * sqrt(0.1 / 8.0)),
        ((0.0, 1.0, -1.0), SLOW, 2.0),  # turns round where it is
        ((0.0, 1.0, 0.0), SLOW, 1.0 + sqrt(2.0)),  # too fast to stop: back again, at most at -sqrt(1/2)
        ((0.5, 1.0, 1.0), replace(SLOW, speed=(1.0,)), 0.5),  # at the limit all the time
        ((0.01, 0.0, 0.0), SMOOTH, 4.0 * (0.01 / 120.0) ** (1.0 / 3.0)),  # jerk alone
        ((3.0, 0.0, 0.0), SMOOTH, 3.0 / 2.0 + 2.0 / 8.0 + 8.0 / 60.0),  # jerk, acceleration, speed
        ((0.0, 0.5, -0.5), SMOOTH, 2.0 * sqrt(1.0 / 60.0)),
    ],
)
def test_known_durations(move: tuple[float, float, float], limits: JointLimits, duration: float) -> None:
    assert one_joint(*move, limits) == pytest.approx(duration, rel=1e-8)


def test_a_joint_that_may_not_waste_time_makes_the_others_wait() -> None:
    """From 1 to 1 rad/s over 1/2 rad takes 1/2 to 2 - sqrt(2) s, or 2 + sqrt(2) s and more; the other joint 1 s."""
    limits = JointLimits(speed=(1.0, 1.0), acceleration=(1.0, 1.0))
    velocity = np.array([1.0, 0.0])
    move = least_time_move(np.zeros(2), np.array([0.5, 0.25]), velocity, velocity, limits)
    assert move.duration == pytest.approx(2.0 + sqrt(2.0), rel=1e-8)
    quick = least_time_move(np.zeros(2), np.array([0.5, 0.05]), velocity, velocity, limits)
    assert quick.duration == pytest.approx(0.5, rel=1e-8)  # the other needs 2 sqrt(0.05) = 0.447 s


def kept(move: RandomMove) -> None:
    """Limits at many times, ends, smoothness."""
    motion = move.planned()
    assert largest_excess(motion, move.limits) == 0.0
    assert end_error(motion, move) < 1e-9
    order = 2 if move.limits.jerk is None else 3
    curve = [motion.derivative(n) for n in range(order)]
    before = np.nextafter(motion.breakpoints[1:], 0.0)
    for n in range(order):
        assert curve[n](before) == pytest.approx(np.asarray(curve[n](motion.breakpoints[1:])), abs=1e-8)
    if order == 3:
        assert motion.at(motion.breakpoints[[0, -1]], 2) == pytest.approx(np.zeros((2, move.start.size)), abs=1e-7)


@pytest.mark.parametrize("jerk", [True, False])
def test_limits_and_ends_are_kept(jerk: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        move = random_move(rng)
        kept(move if jerk else replace(move, limits=replace(move.limits, jerk=None)))


rates = st.floats(1e-3, 1e3)


@settings(max_examples=50, deadline=None)
@given(st.tuples(*[st.floats(-100.0, 100.0)] * 2, *[st.floats(-1.0, 1.0)] * 2, rates, rates, rates))
def test_any_numbers_will_do(values: tuple[float, ...]) -> None:
    start, goal, first, last, speed, acceleration, jerk = values
    limits = JointLimits(speed=(speed,), acceleration=(acceleration,), jerk=(jerk,))
    ends = [np.array([value]) for value in (start, goal, first * speed, last * speed)]
    assume(abs(goal - start) > 1e-9 or abs(last - first) > 1e-9)
    motion = least_time_move(*ends, limits)
    assert largest_excess(motion, limits) <= 1e-9
    reached = motion.at(motion.breakpoints[[0, -1]])[:, 0], motion.at(motion.breakpoints[[0, -1]], 1)[:, 0]
    assert reached[0] == pytest.approx([start, goal], abs=1e-9 * max(1.0, speed * motion.duration))
    rounding = 1e-15 * motion.duration * acceleration  # of breakpoints
    assert reached[1] == pytest.approx([first * speed, last * speed], abs=1e-9 * speed + rounding)


def possible(move: JointMove, duration: float, pieces: int = 120) -> bool:
    """Whether some jerks, constant in equal pieces, make the move in a duration: a linear program."""
    h = duration / pieces
    sums = np.tril(np.ones((pieces, pieces)))
    accelerations = h * sums
    speeds = h * (sums @ accelerations - accelerations / 2.0)
    before = np.vstack([np.zeros((1, pieces)), accelerations[:-1]]), np.vstack([np.zeros((1, pieces)), speeds[:-1]])
    way = (h * before[1] + h**2 * before[0] / 2.0 + h**3 * np.eye(pieces) / 6.0).sum(axis=0)
    ends = np.array([accelerations[-1], speeds[-1], way])
    targets = [0.0, move.last - move.first, move.way - move.first * duration]
    rows = np.vstack([accelerations, -accelerations, speeds, -speeds])
    bounds = np.repeat([move.acceleration] * 2 + [move.speed - move.first, move.speed + move.first], pieces)
    scale = np.abs(ends).max(axis=1)
    jerks = (-move.jerk, move.jerk)
    solution = linprog(np.zeros(pieces), rows, bounds, ends / scale[:, None], targets / scale, jerks, method="highs")
    return bool(solution.status == 0)


@pytest.mark.slow
def test_no_shorter_duration_is_possible() -> None:
    """Every duration that is blocked is impossible for a linear program too, every other one possible."""
    rng = np.random.default_rng(11)
    counts = {True: 0, False: 0}
    for _ in range(12):
        way, first, last = rng.uniform(-0.5, 0.5), *rng.uniform(-1.0, 1.0, 2)
        move = JointMove(way=way, first=first, last=last, speed=1.0, acceleration=2.0, jerk=10.0)
        blocked = [interval for interval in (move.too_short(), move.mirrored.too_short()) if interval is not None]
        for duration in np.linspace(1.1, 8.0, 8) * move.change_time(last - first):
            spare = min(move.highest(duration)[1] - way, move.mirrored.highest(duration)[1] + way)
            if abs(spare) > 0.01:  # the linear program's pieces are not fine enough for less
                within = any(low < duration < high for low, high in blocked)
                assert possible(move, duration) != within
                counts[within] += 1
    assert min(counts.values()) > 20


def compared_with_ruckig(count: int, seed: int) -> None:
    pytest.importorskip("ruckig")
    rng = np.random.default_rng(seed)
    for _ in range(count):
        move = random_move(rng)
        assert move.planned().duration == pytest.approx(ruckig_duration(move), rel=1e-7)


def test_as_fast_as_ruckig() -> None:
    compared_with_ruckig(50, 5)


@pytest.mark.slow
def test_as_fast_as_ruckig_a_thousand_times() -> None:
    compared_with_ruckig(1000, 6)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start_velocity": [0.0, 2.5]}, "start_velocity: joint 2: 2.5 is beyond 2 rad/s"),
        ({"goal_velocity": [0.0, -2.5]}, "goal_velocity: joint 2: -2.5 is beyond 2 rad/s"),
        ({"goal": [0.0]}, "goal: 2 finite numbers are needed, not [0.0]"),
        ({"start": [nan, 0.0]}, "start: 2 finite numbers are needed, not [nan, 0.0]"),
        ({"goal": [0.0, 0.0]}, "goal: the same posture at the same velocity as the start: there is nothing to time"),
    ],
)
def test_impossible_moves_are_refused(changes: dict[str, Any], message: str) -> None:
    limits = JointLimits(speed=(2.0, 2.0), acceleration=(8.0, 8.0))
    ends = {"start": [0.0, 0.0], "goal": [1.0, 1.0], "start_velocity": [0.0, 0.0], "goal_velocity": [0.0, 0.0]}
    with pytest.raises(InvalidProblem) as error:
        least_time_move(**{name: np.array(value) for name, value in (ends | changes).items()}, limits=limits)
    assert str(error.value) == message
