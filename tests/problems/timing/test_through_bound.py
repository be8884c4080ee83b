"""The lower bound of motions through postures: below all that is found, and exact where the least is known."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.slow import slow_except
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from benchmarks.through import published
from problems.base import FloatArray
from problems.robots import JointLimits
from problems.timing import fastest_through, least_through, rest_to_rest
from problems.timing.joint_segments import JointSegments, Ramps

CASES = {case.name: (case, gap) for case, gap in zip(published(), (0.06, 0.03, 0.11), strict=True)}


def limits(rng: np.random.Generator, joints: int, with_jerk: bool) -> JointLimits:
    speed = rng.uniform(0.5, 3.0, joints)
    acceleration = speed * 10.0 ** rng.uniform(-0.5, 1.2, joints)
    jerk = tuple(acceleration * 10.0 ** rng.uniform(-0.5, 1.5, joints)) if with_jerk else None
    return JointLimits(speed=tuple(speed), acceleration=tuple(acceleration), jerk=jerk)


@pytest.mark.slow
@given(seed=st.integers(0, 100_000), with_jerk=st.booleans(), moving=st.booleans())
@settings(max_examples=15, deadline=None)
def test_no_motion_that_is_found_is_faster(seed: int, with_jerk: bool, moving: bool) -> None:
    rng = np.random.default_rng(seed)
    joints, count = int(rng.integers(1, 6)), int(rng.integers(2, 7))
    postures = rng.uniform(-1.0, 1.0, (count, joints)) * 10.0 ** rng.uniform(-2.0, 0.5)
    bounds = limits(rng, joints, with_jerk)
    velocities = rng.uniform(-0.5, 0.5, (2, joints)) * np.array(bounds.speed) if moving else np.zeros((2, joints))
    found = fastest_through(postures, bounds, np.stack([velocities, 0.0 * velocities], axis=1))
    least = least_through(postures, bounds, velocities)
    assert least > 0.0 and (found is None or least <= found.duration)
    assert found is not None or moving


@pytest.mark.parametrize("name", slow_except(CASES, "Piazzi and Visioli, after [2]"))
def test_published_cases_are_bounded(name: str) -> None:
    case, gap = CASES[name]
    found, bound = fastest_through(case.postures, case.limits), least_through(case.postures, case.limits)
    assert found is not None and bound <= found.duration <= (1.0 + gap) * bound


@given(seed=st.integers(0, 10_000), with_jerk=st.booleans())
@settings(max_examples=12, deadline=None)
def test_postures_on_a_straight_way_take_what_the_way_takes(seed: int, with_jerk: bool) -> None:
    rng = np.random.default_rng(seed)
    scale = rng.uniform(0.2, 1.0, 2)
    one = limits(rng, 1, with_jerk)
    bounds = JointLimits(
        **{name: tuple(getattr(one, name)[0] * scale) for name in ("speed", "acceleration")},
        jerk=None if one.jerk is None else tuple(one.jerk[0] * scale),
    )
    shares = np.concatenate([[0.0], np.sort(rng.uniform(0.0, 2.0, rng.integers(1, 5))), [2.0]])
    postures = shares[:, None] * scale * [1.0, -1.0]
    least = rest_to_rest(postures[0], postures[-1], bounds).duration
    assert 0.85 * least <= least_through(postures, bounds) <= least
    assert least_through(postures[[0, 0, -1]], bounds) == pytest.approx(least, rel=2e-9)
    assert least_through(postures[[0, 0]], bounds) == 0.0


def by_linear_program(segment: JointSegments, time: float, cells: int = 120) -> float:
    """The largest distance with jerks that are constant in cells, and velocities within their limit where cells end."""
    ends = np.arange(cells + 1) * time / cells
    later = np.maximum(ends[:, None] - ends[None, :-1], 0.0)
    sooner = np.maximum(ends[:, None] - ends[None, 1:], 0.0)
    steps = [(later**n - sooner**n) / np.prod(np.arange(1, n + 1)) for n in (1, 2, 3)]
    one, none = np.ones(cells + 1), np.zeros(cells + 1)
    acceleration = np.column_stack([steps[0], one, none])
    velocity = np.column_stack([steps[1], ends, one])
    rows: list[FloatArray] = []
    bounds: list[FloatArray] = []
    for matrix, most in ((acceleration, segment.ramps.acceleration), (velocity, segment.ramps.speed)):
        rows += [matrix, -matrix]
        bounds += [np.full(cells + 1, float(most))] * 2
    rows += [velocity[:1], velocity[-1:]]
    bounds += [np.atleast_1d(segment.first[1]), np.atleast_1d(segment.last[1])]
    jerk = float(segment.ramps.jerk)
    free = [(-jerk, jerk)] * cells + [(None, None)] * 2
    gain = -np.concatenate([steps[2][-1], [time**2 / 2.0, time]])
    return -float(linprog(gain, np.vstack(rows), np.concatenate(bounds), bounds=free).fun)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=8, deadline=None)
def test_how_far_a_joint_comes_is_the_optimum_of_a_linear_program(seed: int) -> None:
    rng = np.random.default_rng(seed)
    speed, acceleration = rng.uniform(0.5, 2.0), rng.uniform(0.5, 3.0)
    ramps = Ramps(*map(np.array, (speed, acceleration, acceleration / rng.uniform(0.5, 20.0))))
    start, end = (np.array(each) for each in rng.uniform(-speed, speed, 2))
    segment = JointSegments(ramps, np.array(1.0), (start, start), (end, end))
    time = rng.uniform(0.05, 5.0)
    found, size = float(segment.farthest(np.array(time))), speed * time
    assert found == pytest.approx(by_linear_program(segment, time), abs=2e-4 * size)
