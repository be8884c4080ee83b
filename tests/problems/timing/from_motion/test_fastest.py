"""Stops and moves from a moving state: by hand, against limits and optima, whatever the state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import InvalidProblem, Trajectory
from problems.base import FloatArray
from problems.robots import JointLimits
from problems.timing.free_space import least_time_move
from problems.timing.from_motion import JERK_RATE, MOMENT, MotionState, fastest_move, fastest_stop

SMOOTH = JointLimits(speed=(2.0, 1.0), acceleration=(10.0, 4.0), jerk=(100.0, 80.0))
JERKY = replace(SMOOTH, jerk=None)


def state_of(*joints: tuple[float, float, float]) -> MotionState:
    """Angle, velocity and acceleration of each joint."""
    return MotionState(*np.array(joints).T)


@pytest.mark.parametrize(
    ("velocity", "acceleration", "seconds", "way"),
    [
        # 2 rad/s with 10 rad/s^2 and 100 rad/s^3: 0.1 s to -10, 0.1 s level, 0.1 s back; symmetric, so the mean is 1
        (2.0, 0.0, 0.3, 0.3),
        (-2.0, 0.0, 0.3, -0.3),
        # 0.25 rad/s: no level part, 2 sqrt(v / j)
        (0.25, 0.0, 0.1, 0.0125),
        # 1 rad/s, and already braking with 10 rad/s^2: 0.05 s level, 0.1 s back, in which 0.5 rad/s become 0
        (1.0, -10.0, 0.15, 0.05 * 0.75 + 0.1 * 0.5 / 3.0),
        # it stands: for a moment it goes on to
        (0.0, 0.0, 0.0, 0.0),
    ],
)
def test_stops_by_hand(velocity: float, acceleration: float, seconds: float, way: float) -> None:
    limits = JointLimits(speed=(2.0,), acceleration=(10.0,), jerk=(100.0,))
    stop = fastest_stop(state_of((1.0, velocity, acceleration)), limits)
    assert stop.duration == pytest.approx(max(seconds, MOMENT), rel=1e-5)
    assert stop.value_at_end() == pytest.approx([1.0 + way], abs=1e-6)


def test_without_a_jerk_it_is_twenty_times_the_acceleration_a_second() -> None:
    """4 rad/s with 20 rad/s^2 and 400 rad/s^3: 0.05 s, 0.15 s, 0.05 s."""
    assert JERK_RATE == 20.0
    stop = fastest_stop(state_of((0.0, 4.0, 0.0)), JointLimits(speed=(4.0,), acceleration=(20.0,)))
    assert stop.duration == pytest.approx(0.25, rel=1e-5)


def test_a_joint_that_stands_first_stays_where_it_is() -> None:
    stop = fastest_stop(state_of((0.0, 2.0, 0.0), (0.5, 0.2, 0.0)), SMOOTH)
    alone = fastest_stop(state_of((0.5, 0.2, 0.0)), JointLimits(speed=(1.0,), acceleration=(4.0,), jerk=(80.0,)))
    assert alone.duration < stop.duration
    later = np.linspace(alone.duration, stop.duration, 7)
    assert stop.at(later)[:, 1] == pytest.approx(alone.value_at_end()[0], abs=1e-12)
    assert stop.at(later, 1)[:, 1] == pytest.approx(0.0, abs=1e-12)


def test_from_rest_a_move_is_as_fast_as_can_be() -> None:
    start, goal, rest = np.zeros(2), np.array([1.0, -0.7]), np.zeros(2)
    optimum = least_time_move(start, goal, rest, rest, SMOOTH)
    found = fastest_move(MotionState(start, rest, rest), goal, SMOOTH)
    assert found.duration == pytest.approx(optimum.duration, rel=1e-5)


def assert_sound(motion: Trajectory, state: MotionState, limits: JointLimits) -> None:
    """It begins with the state, ends at rest, is smooth, and where the state does, it keeps the limits."""
    for order, value in enumerate((state.angles, state.velocity, state.acceleration)):
        assert motion.at(np.zeros(1), order)[0] == pytest.approx(value, abs=1e-12)
        assert not motion.jumps_inside(order)
    assert motion.value_at_end(1) == pytest.approx(0.0, abs=1e-10)
    assert motion.value_at_end(2) == pytest.approx(0.0, abs=1e-9)
    times = np.linspace(0.0, motion.duration, 1000)
    jerk = limits.jerk or tuple(JERK_RATE * most for most in limits.acceleration)
    for order, bounds in enumerate((limits.speed, limits.acceleration, jerk), start=1):
        assert (np.abs(motion.at(times, order)) <= np.array(bounds) * (1.0 + 1e-9)).all(), order


@st.composite
def states(draw: st.DrawFn) -> MotionState:
    """Of two joints that can stay within their limits: a speed that the acceleration does not carry too far."""
    share = st.floats(-1.0, 1.0, allow_subnormal=False)
    angles, velocities, accelerations = (np.array([draw(share), draw(share)]) for _ in range(3))
    top, most, jerk = np.array(SMOOTH.speed), np.array(SMOOTH.acceleration), np.array(SMOOTH.jerk)
    accelerations = accelerations * np.minimum(most, np.sqrt(2.0 * jerk * 0.5 * top))
    room = 0.999 * top - accelerations**2 / (2.0 * jerk)  # a little is left for rounding
    return MotionState(3.0 * angles, velocities * room, accelerations)


@settings(max_examples=60, deadline=None)
@given(state=states(), limits=st.sampled_from([SMOOTH, replace(SMOOTH, jerk=(200.0, 80.0)), JERKY]))
def test_stops_keep_limits_from_any_state(state: MotionState, limits: JointLimits) -> None:
    assert_sound(fastest_stop(state, limits), state, limits)


@settings(max_examples=60, deadline=None)
@given(state=states(), goal=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)))
def test_moves_keep_limits_from_any_state_and_arrive(state: MotionState, goal: tuple[float, float]) -> None:
    move = fastest_move(state, np.array(goal), SMOOTH)
    assert_sound(move, state, SMOOTH)
    assert move.value_at_end() == pytest.approx(goal, abs=1e-9)


def test_a_state_beyond_a_limit_is_brought_back() -> None:
    stop = fastest_stop(state_of((0.0, 2.5, 3.0), (0.0, 0.0, 0.0)), SMOOTH)
    assert stop.value_at_end(1) == pytest.approx(0.0, abs=1e-10)
    after = np.linspace(0.2, stop.duration, 100)
    assert (np.abs(stop.at(after, 1)) <= np.array(SMOOTH.speed)).all()


@pytest.mark.parametrize(
    ("goal", "message"),
    [(np.zeros(3), "goal: 2 joint angles"), (np.array([np.nan, 0.0]), "goal: 2 joint angles")],
)
def test_goals_that_are_none(goal: FloatArray, message: str) -> None:
    with pytest.raises(InvalidProblem, match=message):
        fastest_move(state_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), goal, SMOOTH)


def test_states_that_are_none() -> None:
    with pytest.raises(InvalidProblem, match="state: 1 joints where the limits have 2"):
        fastest_stop(state_of((0.0, 0.0, 0.0)), SMOOTH)
    with pytest.raises(InvalidProblem, match="velocity: as many finite numbers"):
        MotionState(np.zeros(2), np.zeros(3), np.zeros(2))
    with pytest.raises(InvalidProblem, match="acceleration: as many finite numbers"):
        MotionState(np.zeros(2), np.zeros(2), np.array([np.inf, 0.0]))
