"""The bound of the time along a path is below every motion's, and close to the fastest without a jerk limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing import least_along, least_along_points, least_durations, retime

SEEDS = st.integers(0, 2**31)


def path_and_limits(seed: int) -> tuple[JointPath, JointLimits]:
    """A smooth path of a few postures, some joints of which stand still."""
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(1, 6))
    steps = rng.normal(size=(int(rng.integers(1, 7)), joints)) * (rng.random(joints) < 0.8) + 1e-3
    path = JointPath.through(np.concatenate([np.zeros((1, joints)), np.cumsum(steps, axis=0)]))
    speed, acceleration = rng.uniform(0.5, 4.0, joints), rng.uniform(2.0, 20.0, joints)
    return path, JointLimits(speed=tuple(speed), acceleration=tuple(acceleration))


@settings(max_examples=20)
@given(SEEDS, st.sampled_from([None, 10.0, 100.0]))
def test_no_motion_along_a_path_is_faster(seed: int, jerk: float | None) -> None:
    path, limits = path_and_limits(seed)
    if jerk is not None:
        limits = replace(limits, jerk=tuple(jerk * most for most in limits.acceleration))
    assert least_along(path, limits) <= retime(path, limits).duration


@pytest.mark.parametrize("goal", [0.02, 1.0, 9.0])
@pytest.mark.parametrize("jerk", [None, (1e3, 1e3)])
def test_along_a_line_it_is_the_least_time(goal: float, jerk: tuple[float, float] | None) -> None:
    limits = JointLimits(speed=(1.5, 0.5), acceleration=(10.0, 3.0), jerk=jerk)
    path = JointPath.through(np.array([[0.0, 0.0], [goal, 0.2 * goal]]))
    least = least_durations(np.array([goal, 0.2 * goal]), limits).max()
    assert least_along(path, limits) == pytest.approx(least, rel=1e-8 if jerk is None else 0.02)


def test_it_is_close_to_the_fastest_motion_along_a_curve() -> None:
    path = JointPath.through(np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3)))
    limits = JointLimits(speed=(2.0, 3.0, 2.5), acceleration=(10.0, 5.0, 8.0))
    assert least_along(path, limits) >= 0.95 * retime(path, limits).duration


def test_a_joint_that_turns_back_needs_its_way_there_and_back() -> None:
    """Its net way is nothing."""
    path = JointPath(np.array([0.0, 1.0]), np.array([[[-4.0, 0.0]], [[4.0, 1e-6]], [[0.0, 0.0]]]))
    limits = JointLimits(speed=(100.0, 100.0), acceleration=(1.0, 1.0))
    assert least_along(path, limits) == pytest.approx(2.0 * least_durations(np.ones(2), limits)[0], rel=1e-6)


@pytest.mark.parametrize("jerk", [None, (50.0, 60.0, 70.0)])
def test_paths_through_points_take_as_long_as_their_splines(jerk: tuple[float, ...] | None) -> None:
    rng = np.random.default_rng(3)
    shares, way, bend = np.linspace(0.0, 1.0, 9)[:, None], *rng.normal(size=(2, 5, 1, 3))
    points = way * shares + 0.3 * bend * np.sin(np.pi * shares)
    limits = JointLimits(speed=(1.0, 3.0, 2.5), acceleration=(10.0, 5.0, 8.0), jerk=jerk)
    alone = [least_along(JointPath.through(each, np.linspace(0.0, 1.0, 9)), limits) for each in points]
    together = least_along_points(points, limits)
    assert together == pytest.approx(alone, rel=0.01)
    assert together == pytest.approx([least_along_points(each[None], limits)[0] for each in points], rel=1e-12)


def test_a_slow_tool_takes_as_long_as_its_way_at_that_speed() -> None:
    """Its speed is not limited in how it changes."""
    points = np.linspace([0.0, 0.0], [0.3, 0.1], 9)[None]
    limits = JointLimits(speed=(2.0, 2.0), acceleration=(1e6, 1e6))
    assert least_along_points(points, limits, 0.5, 0.1)[0] == pytest.approx(5.0, rel=1e-3)
    assert least_along_points(points, limits, 0.5, 100.0) == pytest.approx(least_along_points(points, limits))
