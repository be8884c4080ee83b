"""Motions: jumps, relative to what moves but never to so much that a visible one is small; parts, cut and joined."""

from __future__ import annotations

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest
from helpers.cases import builtin
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import CertificateStatus, PlanarArm, Trajectory
from problems.certify import limit_verdicts
from problems.families.two_segments import Quantities
from problems.families.two_segments.motion import middle_acceleration
from problems.limits.joint_limits import JerkLimit
from solvers import SearchBox

ALLOWED = 1e-9  # what an audit accepts
REST = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])  # from rest to rest through 1 rad in 1 s, lowest power first


def pieces(*steps: tuple[float, float]) -> Trajectory:
    """From rest to rest: for each step the angle at which it begins and how far it goes."""
    coefficients = [np.column_stack([start * (np.arange(6) == 0) + way * REST]) for start, way in steps]
    return Trajectory.from_pieces(np.ones(len(steps)), coefficients)


def beside_a_fast_piece(order: int) -> Trajectory:
    """A last piece that begins with 0.5 rad/s or 1 rad/s^2 where all before ended at rest."""
    fast, jump = 1e9 * REST, np.zeros(6)
    jump[order] = 0.5 * 2.0 ** (order - 1)
    last = jump - 0.5 * np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0])
    parts = (fast, -fast + 1e9 * (np.arange(6) == 0), last)
    return Trajectory.from_pieces(np.ones(3), [np.column_stack([part]) for part in parts])


TURNS = [2.0 * np.pi * turns for turns in (0.1, 1.0, 1e4, 1e8, 1e12)]
JUMPS: list[tuple[Trajectory, float, float]] = [  # the largest jump: at least, at most
    *((pieces((0.3, way), (0.3 + way, -way)), 0.0, 1e-10) for way in (1e-5, 1.0, 100.0)),
    (pieces((0.3, 0.0), (0.3, 0.0)), 0.0, 0.0),  # it stands still
    (pieces((2.5, 1e-17), (2.5, -1e-17)), 0.0, ALLOWED),
    *((pieces((0.0, way), (way + 0.5, -way)), 0.49, np.inf) for way in TURNS),  # no turn hides half a radian
    *((pieces((0.0, way), (way * 1.01, -way)), 0.0099, np.inf) for way in (1.0, 1e-3, 1e-6)),  # nor a part of itself
    *((beside_a_fast_piece(order), 1e-3, np.inf) for order in (1, 2)),
]


@pytest.mark.parametrize(("motion", "least", "most"), JUMPS)
def test_what_joins_has_no_jump_and_nothing_hides_one(motion: Trajectory, least: float, most: float) -> None:
    assert least <= motion.largest_jump() <= most


def test_a_start_or_an_end_in_motion_counts() -> None:
    moving = Trajectory.from_pieces(np.ones(1), [np.array([[0.0], [1.0]])])
    assert moving.largest_jump() == pytest.approx(1.0)


@pytest.mark.parametrize("number", [np.inf, np.nan, 1e308, -1e308, 1e300, 1e160])
def test_what_is_no_motion_is_no_smooth_one(number: float) -> None:
    coefficients = np.zeros((6, 2, 1))
    coefficients[:, 0, 0] = number
    with np.errstate(over="raise"):
        assert Trajectory(np.array([0.0, 1.0, 2.0]), coefficients).largest_jump() > ALLOWED


@pytest.mark.parametrize("name", ["time-2", "obstacle-5", "pentagram-time", "closed-curve-rotation"])
def test_the_motions_of_the_paper_join_at_any_speed(name: str) -> None:
    for formulation in ("paper", "reduced"):
        problem = builtin(name, formulation)
        for x in SearchBox(*problem.bounds).sample(np.random.default_rng(0), 10):
            motion = problem.trajectory(x)
            assert all(motion.time_scaled(seconds).largest_jump() < 0.1 * ALLOWED for seconds in (1e-4, 1.0, 1e5))


# What a motion promises: velocities of its own at the ends, accelerations that may jump


def uniform(*speeds: float) -> Trajectory:
    """One joint in steps of 1 s, from one speed to the next at constant acceleration."""
    angle, coefficients = 0.0, []
    for before, after in pairwise(speeds):
        coefficients.append(np.array([[angle], [before], [(after - before) / 2.0]]))
        angle += (before + after) / 2.0
    return Trajectory.from_pieces(np.ones(len(coefficients)), coefficients)


def test_velocities_of_the_task_at_the_ends_are_no_jumps() -> None:
    motion = uniform(0.5, 1.0, 0.25)
    assert motion.largest_jump(np.array([[0.5], [0.25]]), smooth_orders=2) < 1e-15
    assert motion.largest_jump(np.array([[0.5], [0.0]]), smooth_orders=2) == pytest.approx(0.25)
    assert motion.largest_jump(smooth_orders=2) == pytest.approx(0.5)


def test_accelerations_count_where_they_have_to_be_continuous() -> None:
    motion = uniform(0.0, 1.0, 0.0)
    assert motion.largest_jump(smooth_orders=2) < 1e-15
    assert motion.largest_jump() == pytest.approx(2.0)


def test_an_acceleration_just_before_its_jump_is_among_the_extremes() -> None:
    motion = uniform(0.0, 0.5, 3.0, 2.75)  # 0.5, 2.5, -0.25 rad/s^2
    assert np.abs(motion.at(motion.extreme_times(2), 2)).max() == pytest.approx(2.5)
    backwards = uniform(0.0, 3.0, 3.5)
    assert np.abs(backwards.at(backwards.extreme_times(2), 2)).max() == pytest.approx(3.0)
    ramp = Trajectory.from_pieces(np.ones(2), [np.array([[0.0], [0.0], [0.0], [1.0]]), np.array([[1.0], [3.0]])])
    assert np.abs(ramp.at(ramp.extreme_times(2), 2)).max() == pytest.approx(6.0)  # up to 6, then 0


def test_where_a_derivative_jumps_is_known() -> None:
    assert uniform(0.0, 1.0, 0.5).jump_time(1) is None
    assert uniform(0.0, 1.0, -1.0, 0.0).jump_time(2) == pytest.approx(1.0)
    assert pieces((0.0, 1.0), (1.0, -1.0)).jump_time(2) is None


def test_no_jerk_limit_holds_where_the_acceleration_jumps() -> None:
    robot = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0), max_jerk=(1e6, 1e6))
    jumping, smooth = (
        Trajectory(motion.breakpoints, np.repeat(motion.coefficients, 2, axis=2))
        for motion in (uniform(0.0, 1.0, 0.0), pieces((0.0, 1.0), (1.0, -1.0)))
    )
    [verdict] = limit_verdicts([JerkLimit(robot)], jumping)
    assert verdict.status is CertificateStatus.VIOLATED
    assert verdict.worst == np.inf
    assert limit_verdicts([JerkLimit(robot)], smooth)[0].satisfied


def test_a_moving_end_may_not_be_accelerated() -> None:
    circle = np.array([[1.0, 0.0], [0.0, 0.5], [-0.5, 0.0]])[::-1]  # velocity (0, 0.5), acceleration (-1, 0) at t = 0
    braking = Trajectory(np.array([0.0, 0.1]), (circle - np.array([[0.0, 0.25], [0.0, 0.0], [0.0, 0.0]]))[:, None])
    assert braking.jump_time(2) == 0.0


def test_an_acceleration_that_is_given_at_the_start_is_no_jump() -> None:
    ramp = Trajectory(np.array([0.0, 1.0]), np.array([[-1.0], [1.5], [0.0], [0.0]])[:, None])  # a = 3 - 6 t
    outside = np.array([[3.0], [-3.0]])
    assert ramp.jump_time(2) == 0.0
    assert ramp.jump_time(2, outside) is None
    assert ramp.jump_time(2, outside * [[1.0], [0.0]]) == 1.0
    rates = np.array([[0.0], [0.0]])
    assert ramp.largest_jump(rates, end_accelerations=outside) < 1e-12
    assert ramp.largest_jump(rates) == pytest.approx(3.0)  # relative to 1 rad / s^2, the most that counts


# Motions that are cut and joined: exact, and as smooth as they were


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


@settings(max_examples=15, deadline=None)
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


def test_what_is_no_part_and_no_derivative() -> None:
    for first, last in ((-0.1, 0.1), (0.2, 0.2), (0.3, 0.1), (0.0, 1e3), (np.nan, 0.1)):
        with pytest.raises(ValueError, match="is no part of 0 to"):
            smooth_motion(2).part(first, last)
    standing = Trajectory.standing(np.array([0.1, 0.2]), 1.0)
    np.testing.assert_array_equal(standing(0.5), [0.1, 0.2])
    for order in (-1, 99):
        with pytest.raises(ValueError, match=f"^derivative: {order} is none; there are those from 0 to "):
            standing(0.5, order)


# The polynomial segments (3)-(6) of two-segment motions

angles = st.floats(-6.0, 6.0)
times = st.floats(0.1, 4.0)


def quantities(start: float, middle: float, speed: float, end: float, t1: float, t2: float) -> Quantities:
    return Quantities(*(ca.DM([[value, 2.0 * value]]) for value in (start, middle, speed, end)), ca.DM(t1), ca.DM(t2))


@given(angles, angles, angles, angles, times, times)
def test_boundary_conditions_and_continuity(
    start: float, middle: float, speed: float, end: float, t1: float, t2: float
) -> None:
    trajectory = quantities(start, middle, speed, end, t1, t2).trajectory()
    scale = (1.0 + max(map(abs, (start, middle, end))) + abs(speed) * (t1 + t2)) * max(1.0, t2 / t1) ** 2
    at = trajectory.samples(np.array([0.0, t1, t1 + t2]))
    theta, v, a = (np.asarray(part)[:, 0] for part in (at.theta, at.speed, at.acceleration))
    assert theta == pytest.approx([start, middle, end], abs=1e-9 * scale)
    assert v == pytest.approx([0.0, speed, 0.0], abs=1e-9 * scale / t2)
    assert a[[0, 2]] == pytest.approx(0.0, abs=1e-8 * scale / t2**2)
    expected = float(middle_acceleration(ca.DM(start), ca.DM(middle), ca.DM(speed), ca.DM(t1)))
    assert a[1] == pytest.approx(expected, abs=1e-9 * scale / min(t1, t2) ** 2)
    before = trajectory.samples(np.array([t1 * (1.0 - 1e-9)]))
    assert float(before.acceleration[0]) == pytest.approx(expected, abs=1e-6 * scale / min(t1, t2) ** 2)
    assert np.asarray(at.theta)[:, 1] == pytest.approx(2.0 * theta, abs=1e-9 * scale)


def some_motion() -> Trajectory:
    return quantities(0.2, 1.4, 2.5, -0.7, 0.5, 0.8).trajectory()


@pytest.mark.parametrize(("derivative", "part"), [(0, "theta"), (1, "speed"), (2, "acceleration")])
def test_extremes_are_those_of_a_dense_sampling(derivative: int, part: str) -> None:
    motion = some_motion()
    exact = np.asarray(getattr(motion.samples(motion.extreme_times(derivative)), part))
    dense = np.asarray(getattr(motion.samples(np.linspace(0.0, motion.duration, 20_001)), part))
    assert exact.max(axis=0) == pytest.approx(dense.max(axis=0), rel=1e-7)
    assert exact.min(axis=0) == pytest.approx(dense.min(axis=0), rel=1e-7)
    assert (exact.max(axis=0) >= dense.max(axis=0) - 1e-12).all()


def test_times_hold_every_breakpoint_and_are_even_in_each_piece() -> None:
    motion = some_motion()
    t = motion.times(201)
    assert t.size >= 201
    assert set(motion.breakpoints) <= set(t)
    for low, high in zip(motion.breakpoints[:-1], motion.breakpoints[1:], strict=True):
        steps = np.diff(t[(t >= low) & (t <= high)])
        assert steps == pytest.approx(steps[0])
