"""Moves without a path, at rest or moving at their ends, and stops: by hand, against optima, limits kept."""

from __future__ import annotations

from dataclasses import replace
from math import nan, sqrt
from typing import Any

import numpy as np
import pytest
import ruckig
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from benchmarks.peers.moving_ends import RandomMove, end_error, largest_excess, random_move, ruckig_duration
from problems import InvalidProblem, Trajectory
from problems.robots import JointLimits
from problems.timing.free_space import least_durations, least_time_move, rest_to_rest
from problems.timing.from_motion import (
    JERK_RATE,
    STANDING_DURATION,
    MotionState,
    fastest_duration,
    fastest_move,
    fastest_stop,
)
from problems.timing.prepared import peak_ratios


def limits_of(*joints: tuple[float, float, float | None]) -> JointLimits:
    """Of joints given as speed, acceleration, jerk."""
    speed, acceleration, jerk = zip(*joints, strict=True)
    return JointLimits(speed=speed, acceleration=acceleration, jerk=None if None in jerk else jerk)


@pytest.mark.parametrize(
    ("distance", "joint", "duration"),
    [
        (8.0, (2.0, 1.0, None), 6.0),  # 2 s up, 2 s at 2 rad/s, 2 s down: 2 + 4 + 2 rad
        (4.0, (2.0, 1.0, None), 4.0),  # a triangle that just reaches its speed
        (1.0, (2.0, 1.0, None), 2.0),  # a triangle
        (12.0, (3.0, 2.0, 4.0), 6.0),  # speed and acceleration reached: D/v + v/a + a/j = 4 + 1.5 + 0.5
        (4.0, (1.0, 9.0, 1.0), 6.0),  # speed reached before the acceleration: D/v + 2 sqrt(v/j)
        (6.0, (100.0, 1.0, 1.0), 6.0),  # acceleration reached, not the speed: Ta (Ta - Tj) = D/a with Ta = 3, Tj = 1
        (2.0, (100.0, 100.0, 1.0), 4.0),  # jerk alone: 2 j Tj^3 = D with Tj = 1, T = 4 Tj
        (0.0, (1.0, 1.0, 1.0), 0.0),
    ],
)
def test_every_branch_by_hand(distance: float, joint: tuple[float, float, float | None], duration: float) -> None:
    assert least_durations(np.array([distance]), limits_of(joint))[0] == pytest.approx(duration, rel=1e-14)
    assert least_durations(np.array([[-distance], [distance]]), limits_of(joint)).shape == (2, 1)
    if distance:
        trajectory = rest_to_rest(np.array([0.5]), np.array([0.5 - distance]), limits_of(joint))
        assert trajectory.duration == pytest.approx(duration, rel=1e-14)
        assert max(peak_ratios(trajectory, limits_of(joint))) == pytest.approx(1.0, abs=1e-10)


numbers = st.floats(0.01, 100.0)


@settings(max_examples=30, deadline=None)
@example([(6.0, 0.01, 1.0, 4.0)], True)
@example([(6.0, 0.01, 1.0, 12.0)], True)
@given(st.lists(st.tuples(st.floats(-9.0, 9.0), numbers, numbers, numbers), min_size=1, max_size=4), st.booleans())
def test_slowest_joint_touches_a_limit_and_the_others_keep_theirs(
    joints: list[tuple[float, float, float, float]], with_jerk: bool
) -> None:
    goal = np.array([joint[0] for joint in joints])
    if np.abs(goal).max() < 1e-6:
        return
    own = limits_of(*((v, a, j if with_jerk else None) for _, v, a, j in joints))
    trajectory = rest_to_rest(np.zeros(goal.size), goal, own)
    assert max(peak_ratios(trajectory, own)) == pytest.approx(1.0, abs=1e-8)
    assert trajectory.duration == pytest.approx(least_durations(goal, own).max(), rel=1e-14)
    times = np.linspace(0.0, trajectory.duration, 101)
    forward, backward = trajectory.at(times), goal - trajectory.at(trajectory.duration - times)
    np.testing.assert_allclose(forward, backward, atol=1e-12 * np.abs(goal).max())
    of_times = 1e-15 * trajectory.duration * max(own.acceleration)
    np.testing.assert_allclose(trajectory.at(times[[0, -1]], 1), 0.0, atol=1e-11 * max(own.speed) + of_times)
    if with_jerk:
        rounded = 1e-16 * trajectory.duration * max(joint[3] for joint in joints)  # times, where q'' changes most
        assert trajectory.largest_jump() < 1e-9 + rounded * trajectory.duration**2  # relative to 1 / T^2


def test_as_fast_as_ruckig_from_rest_to_rest() -> None:
    pytest.importorskip("ruckig")
    from benchmarks.peers.rest_moves import move  # noqa: PLC0415 - an extra

    for one in map(move, range(20)):
        assert one.ratio == pytest.approx(1.0, abs=1e-9)
        assert (one.excess, one.certified) == (0.0, True)


@pytest.mark.parametrize(
    ("start", "goal", "message"),
    [
        ([0.0, 1.0], [0.0, 1.0], "goal: the same posture as the start: there is nothing to time"),
        ([0.0], [0.0, 1.0], "start: 1 joint angles for 2 joints"),
        ([0.0, 1.0], [0.0, np.nan], "goal: a joint angle is not a number"),
    ],
)
def test_what_cannot_be_timed(start: list[float], goal: list[float], message: str) -> None:
    with pytest.raises(InvalidProblem, match=f"^{message}$"):
        rest_to_rest(np.array(start), np.array(goal), limits_of((1.0, 1.0, None), (1.0, 1.0, None)))


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


@pytest.mark.parametrize("jerk", [True, False])
def test_limits_and_ends_are_kept(jerk: bool) -> None:
    rng = np.random.default_rng(3)
    for _ in range(12):
        move = random_move(rng)
        check_kept(move if jerk else replace(move, limits=replace(move.limits, jerk=None)))


def check_kept(move: RandomMove) -> None:
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


@pytest.mark.parametrize("count", [30, pytest.param(1000, marks=pytest.mark.slow)])
def test_as_fast_as_ruckig(count: int) -> None:
    pytest.importorskip("ruckig")
    rng = np.random.default_rng(5)
    for _ in range(count):
        move = random_move(rng)
        assert move.planned().duration == pytest.approx(ruckig_duration(move), rel=1e-7)


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


TWO_JOINTS = JointLimits(speed=(2.0, 1.0), acceleration=(10.0, 4.0), jerk=(100.0, 80.0))
JERKY = replace(TWO_JOINTS, jerk=None)


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
    assert stop.duration == pytest.approx(max(seconds, STANDING_DURATION), rel=1e-5)
    assert stop.value_at_end() == pytest.approx([1.0 + way], abs=1e-6)


def test_without_a_jerk_it_is_twenty_times_the_acceleration_a_second() -> None:
    """4 rad/s with 20 rad/s^2 and 400 rad/s^3: 0.05 s, 0.15 s, 0.05 s."""
    assert JERK_RATE == 20.0
    stop = fastest_stop(state_of((0.0, 4.0, 0.0)), JointLimits(speed=(4.0,), acceleration=(20.0,)))
    assert stop.duration == pytest.approx(0.25, rel=1e-5)


def test_a_joint_that_stands_first_stays_where_it_is() -> None:
    stop = fastest_stop(state_of((0.0, 2.0, 0.0), (0.5, 0.2, 0.0)), TWO_JOINTS)
    alone = fastest_stop(state_of((0.5, 0.2, 0.0)), JointLimits(speed=(1.0,), acceleration=(4.0,), jerk=(80.0,)))
    assert alone.duration < stop.duration
    later = np.linspace(alone.duration, stop.duration, 7)
    assert stop.at(later)[:, 1] == pytest.approx(alone.value_at_end()[0], abs=1e-12)
    assert stop.at(later, 1)[:, 1] == pytest.approx(0.0, abs=1e-12)


def test_from_rest_a_move_is_as_fast_as_can_be() -> None:
    start, goal, rest = np.zeros(2), np.array([1.0, -0.7]), np.zeros(2)
    optimum = least_time_move(start, goal, rest, rest, TWO_JOINTS)
    found = fastest_move(MotionState.at_rest(start), MotionState.at_rest(goal), TWO_JOINTS)
    assert found.duration == pytest.approx(optimum.duration, rel=1e-5)


@pytest.mark.parametrize("backward", [False, True])
def test_a_move_from_rest_into_an_acceleration_by_hand(backward: bool) -> None:
    """The jerk is 100 rad/s^3 for 0.1 s, -100 for 0.05 s, 100 for 0.05 s, which two switches make optimal.

    After these there are 10, 5 and 10 rad/s^2, 0.5, 0.875 and 1.25 rad/s, 4 / 240, 12.5 / 240 and 25 / 240 rad.
    """
    limits = JointLimits(speed=(2.0,), acceleration=(20.0,), jerk=(100.0,))
    rest, moving = state_of((0.0, 0.0, 0.0)), state_of((25.0 / 240.0, -1.25 if backward else 1.25, 10.0))
    move = fastest_move(*((moving, rest) if backward else (rest, moving)), limits)
    assert move.duration == pytest.approx(0.2, rel=1e-5)
    assert move.value_at_end(2) == pytest.approx(0.0 if backward else 10.0, abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_between_states_a_move_is_as_fast_as_ruckig_says_and_as_its_reverse(seed: int) -> None:
    rng, k = np.random.default_rng(seed), 1 + seed % 7
    speed = rng.uniform(0.5, 3.0, k)
    acceleration = speed * rng.uniform(2.0, 10.0, k)
    jerk = acceleration * rng.uniform(2.0, 30.0, k)
    limits = JointLimits(speed=tuple(speed), acceleration=tuple(acceleration), jerk=tuple(jerk))
    most = np.array([np.full(k, 2.0), 0.6 * speed, np.minimum(acceleration, np.sqrt(0.7 * speed * jerk))])
    one, other = rng.uniform(-1.0, 1.0, (2, 3, k)) * most
    wanted, found = ruckig.InputParameter(k), ruckig.Trajectory(k)
    wanted.current_position, wanted.current_velocity, wanted.current_acceleration = one.tolist()
    wanted.target_position, wanted.target_velocity, wanted.target_acceleration = other.tolist()
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = speed, acceleration, jerk
    assert ruckig.Ruckig(k).calculate(wanted, found) == ruckig.Result.Working
    move = fastest_move(MotionState(*one), MotionState(*other), limits)
    assert move.duration == pytest.approx(found.duration, rel=2e-6)
    for order, value in enumerate(other):
        assert move.value_at_end(order) == pytest.approx(value, abs=1e-8)
    reverse = np.array([[1.0], [-1.0], [1.0]])
    back = fastest_move(MotionState(*(reverse * other)), MotionState(*(reverse * one)), limits)
    assert back.duration == pytest.approx(move.duration, rel=1e-6)


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
    top, most, jerk = np.array(TWO_JOINTS.speed), np.array(TWO_JOINTS.acceleration), np.array(TWO_JOINTS.jerk)
    accelerations = accelerations * np.minimum(most, np.sqrt(2.0 * jerk * 0.5 * top))
    room = 0.999 * top - accelerations**2 / (2.0 * jerk)  # a little is left for rounding
    return MotionState(3.0 * angles, velocities * room, accelerations)


@settings(max_examples=30, deadline=None)
@given(state=states(), limits=st.sampled_from([TWO_JOINTS, replace(TWO_JOINTS, jerk=(200.0, 80.0)), JERKY]))
def test_stops_keep_limits_from_any_state(state: MotionState, limits: JointLimits) -> None:
    assert_sound(fastest_stop(state, limits), state, limits)


@settings(max_examples=30, deadline=None)
@given(state=states(), goal=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)))
def test_moves_keep_limits_from_any_state_and_arrive(state: MotionState, goal: tuple[float, float]) -> None:
    end = MotionState.at_rest(np.array(goal))
    move = fastest_move(state, end, TWO_JOINTS)
    assert_sound(move, state, TWO_JOINTS)
    assert move.value_at_end() == pytest.approx(goal, abs=1e-9)
    assert move.duration == pytest.approx(fastest_duration(state, end, TWO_JOINTS), rel=1e-9)


def test_a_state_beyond_a_limit_is_brought_back() -> None:
    stop = fastest_stop(state_of((0.0, 2.5, 3.0), (0.0, 0.0, 0.0)), TWO_JOINTS)
    assert stop.value_at_end(1) == pytest.approx(0.0, abs=1e-10)
    after = np.linspace(0.2, stop.duration, 100)
    assert (np.abs(stop.at(after, 1)) <= np.array(TWO_JOINTS.speed)).all()


def test_states_and_goals_that_are_none() -> None:
    with pytest.raises(InvalidProblem, match="goal: 2 joint angles"):
        fastest_move(MotionState.at_rest(np.zeros(2)), MotionState.at_rest(np.zeros(3)), TWO_JOINTS)
    with pytest.raises(InvalidProblem, match="state: 1 joints where the limits have 2"):
        fastest_stop(state_of((0.0, 0.0, 0.0)), TWO_JOINTS)
    with pytest.raises(InvalidProblem, match="velocity: as many finite numbers"):
        MotionState(np.zeros(2), np.zeros(3), np.zeros(2))
    with pytest.raises(InvalidProblem, match="acceleration: as many finite numbers"):
        MotionState(np.zeros(2), np.zeros(2), np.array([np.inf, 0.0]))
