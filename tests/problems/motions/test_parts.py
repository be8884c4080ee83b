"""Motions that are cut and joined: exact, and as smooth as they were."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import Trajectory


def smooth_motion(pieces: int, joints: int = 2, seed: int = 8) -> Trajectory:
    """Cubic pieces with continuous accelerations."""
    rng = np.random.default_rng(seed)
    durations, state, coefficients = rng.uniform(0.05, 0.5, pieces), rng.normal(size=(3, joints)), []
    for h in durations:
        jerk = 10.0 * rng.normal(size=joints)
        q, v, a = state
        coefficients.append([jerk / 6.0, a / 2.0, v, q])
        state = np.array([q + h * v + h**2 * a / 2.0 + h**3 * jerk / 6.0, v + h * a + h**2 * jerk / 2.0, a + h * jerk])
    return Trajectory(np.concatenate([[0.0], np.cumsum(durations)]), np.array(coefficients).transpose(1, 0, 2))


def test_a_part_by_hand() -> None:
    """t^3 from 1 to 2: (1 + s)^3 = 1 + 3 s + 3 s^2 + s^3."""
    cubic = Trajectory(np.array([0.0, 3.0]), np.array([1.0, 0.0, 0.0, 0.0])[:, None, None])
    part = cubic.part(1.0, 2.0)
    assert part.coefficients.ravel() == pytest.approx([1.0, 3.0, 3.0, 1.0])
    assert part.breakpoints == pytest.approx([0.0, 1.0])


@settings(max_examples=50, deadline=None)
@given(cuts=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), seed=st.integers(0, 5))
def test_parts_joined_are_the_motion_itself(cuts: tuple[float, float], seed: int) -> None:
    motion = smooth_motion(4, seed=seed)
    first, last = sorted(cut * motion.duration for cut in cuts)
    edges = [0.0, first, last, motion.duration]
    parts = [motion.part(a, b) for a, b in pairwise(edges) if b > a]
    whole = parts[0]
    for part in parts[1:]:
        whole = whole.followed_by(part)
    assert whole.duration == pytest.approx(motion.duration, abs=1e-12)
    times = np.linspace(0.0, motion.duration, 101)
    for order in range(3):
        assert whole.at(times, order) == pytest.approx(motion.at(times, order), abs=1e-9)
        before, after = whole._sides(order)
        assert np.abs(after[1:] - before[:-1]).max(initial=0.0) < 1e-9
        assert not whole.jumps_inside(order)


def test_a_cut_next_to_a_breakpoint_leaves_no_sliver() -> None:
    motion = smooth_motion(3)
    node = float(motion.breakpoints[1])
    part = motion.part(np.nextafter(node, 0.0), motion.duration)
    assert part.breakpoints.size == 3
    assert part.at(np.zeros(1), 1) == pytest.approx(motion.at(np.array([node]), 1), abs=1e-12)


def test_at_a_jump_the_end_is_what_comes_before_it() -> None:
    bang = Trajectory(np.array([0.0, 1.0, 2.0]), np.array([[1.0, -1.0], [0.0, 2.0], [0.0, 1.0]])[:, :, None])
    assert bang.part(0.0, 1.0).value_at_end(2) == pytest.approx([2.0])
    assert bang.jumps_inside(2)
    assert not bang.jumps_inside(1)


def test_motions_of_different_order_are_joined() -> None:
    motion = smooth_motion(1)
    rest = Trajectory.standing(motion.value_at_end(), 0.5)
    joined = motion.followed_by(rest)
    assert joined.duration == pytest.approx(motion.duration + 0.5)
    assert joined.at(np.array([joined.duration]))[0] == pytest.approx(motion.value_at_end())
    assert rest.followed_by(motion).at(np.array([0.5]))[0] == pytest.approx(motion.at(np.zeros(1))[0])


@pytest.mark.parametrize(("first", "last"), [(-0.1, 0.1), (0.2, 0.2), (0.3, 0.1), (0.0, 1e3), (np.nan, 0.1)])
def test_what_is_no_part(first: float, last: float) -> None:
    with pytest.raises(ValueError, match="is no part of 0 to"):
        smooth_motion(2).part(first, last)


@pytest.mark.parametrize("order", [-1, 99])
def test_a_derivative_that_there_is_not_is_refused(order: int) -> None:
    standing = Trajectory.standing(np.array([0.1, 0.2]), 1.0)
    np.testing.assert_array_equal(standing(0.5), [0.1, 0.2])
    with pytest.raises(ValueError, match=f"^derivative: {order} is none; there are those from 0 to "):
        standing(0.5, order)
