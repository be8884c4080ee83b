"""Moves between postures at rest: each branch by hand, against Ruckig, and the limits that are touched."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from problems import InvalidProblem
from problems.robots import JointLimits
from problems.timing.free_space import least_durations, rest_to_rest
from problems.timing.prepared import peak_ratios


def limits(*joints: tuple[float, float, float | None]) -> JointLimits:
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
    assert least_durations(np.array([distance]), limits(joint))[0] == pytest.approx(duration, rel=1e-14)
    assert least_durations(np.array([[-distance], [distance]]), limits(joint)).shape == (2, 1)
    if distance:
        trajectory = rest_to_rest(np.array([0.5]), np.array([0.5 - distance]), limits(joint))
        assert trajectory.duration == pytest.approx(duration, rel=1e-14)
        assert max(peak_ratios(trajectory, limits(joint))) == pytest.approx(1.0, abs=1e-10)


numbers = st.floats(0.01, 100.0)


@given(st.lists(st.tuples(st.floats(-9.0, 9.0), numbers, numbers, numbers), min_size=1, max_size=4), st.booleans())
def test_slowest_joint_touches_a_limit_and_the_others_keep_theirs(
    joints: list[tuple[float, float, float, float]], with_jerk: bool
) -> None:
    goal = np.array([joint[0] for joint in joints])
    if np.abs(goal).max() < 1e-6:
        return
    own = limits(*((v, a, j if with_jerk else None) for _, v, a, j in joints))
    trajectory = rest_to_rest(np.zeros(goal.size), goal, own)
    assert max(peak_ratios(trajectory, own)) == pytest.approx(1.0, abs=1e-9)
    assert trajectory.duration == pytest.approx(least_durations(goal, own).max(), rel=1e-14)
    times = np.linspace(0.0, trajectory.duration, 101)
    forward, backward = trajectory.at(times), goal - trajectory.at(trajectory.duration - times)
    np.testing.assert_allclose(forward, backward, atol=1e-12 * np.abs(goal).max())
    np.testing.assert_allclose(trajectory.at(times[[0, -1]], 1), 0.0, atol=1e-11 * max(own.speed))
    if with_jerk:
        assert trajectory.largest_jump() < 1e-9


def test_as_fast_as_ruckig() -> None:
    ruckig = pytest.importorskip("ruckig")
    rng = np.random.default_rng(7)
    for _ in range(100):
        k = int(rng.integers(1, 8))
        start, goal = rng.uniform(-3.0, 3.0, (2, k))
        speed, acceleration, jerk = (
            rng.uniform(0.5, 4.0, k),
            rng.uniform(1.0, 20.0, k),
            10.0 ** rng.uniform(0.0, 3.5, k),
        )
        question, answer = ruckig.InputParameter(k), ruckig.Trajectory(k)
        question.current_position, question.target_position = start.tolist(), goal.tolist()
        question.max_velocity, question.max_acceleration = speed.tolist(), acceleration.tolist()
        question.max_jerk = jerk.tolist()
        ruckig.Ruckig(k).calculate(question, answer)
        ours = rest_to_rest(start, goal, JointLimits(speed=speed, acceleration=acceleration, jerk=jerk))
        assert ours.duration == pytest.approx(answer.duration, rel=1e-12)


def test_a_joint_that_does_not_move_stays() -> None:
    own = limits((1.0, 1.0, 1.0), (1.0, 1.0, 1.0))
    trajectory = rest_to_rest(np.array([0.3, 1.0]), np.array([0.3, 2.0]), own)
    times = np.linspace(0.0, trajectory.duration, 50)
    assert (trajectory.at(times)[:, 0] == 0.3).all()
    np.testing.assert_allclose(trajectory.at(times[[0, -1]])[:, 1], [1.0, 2.0], atol=1e-15)


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
        rest_to_rest(np.array(start), np.array(goal), limits((1.0, 1.0, None), (1.0, 1.0, None)))
