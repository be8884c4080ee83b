"""Rows of a motion as pieces: against SciPy, and as the joint trajectory controller of ROS joins them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicHermiteSpline

from problems import InvalidProblem
from problems.motions import MotionRows

TIMES = np.array([0.5, 0.8, 1.6, 1.7])
POSITIONS, VELOCITIES, ACCELERATIONS = np.random.default_rng(3).normal(size=(3, 4, 2))


def with_gaps(values: np.ndarray, *rows: int) -> np.ndarray:
    changed = values.copy()
    changed[list(rows)] = np.nan
    return changed


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(2, 12), st.floats(1e-3, 10.0))
def test_pieces_are_those_of_scipy(seed: int, count: int, longest: float) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.1, 1.0, count)) * longest
    q, v, a = rng.normal(size=(3, count, 2))
    at = np.linspace(0.0, times[-1] - times[0], 301)
    expected = {
        "quintic": BPoly.from_derivatives(times, np.stack([q, v / longest, a / longest**2], axis=1)),
        "cubic": CubicHermiteSpline(times, q, v / longest),
    }
    for kind, curve in expected.items():
        motion = MotionRows(times, q, v / longest, a / longest**2, kind).trajectory
        for order in range(3):
            reached = curve.derivative(order)(at[:-1] + times[0]) if order else curve(at[:-1] + times[0])
            np.testing.assert_allclose(motion.at(at[:-1], order) * longest**order, reached * longest**order, atol=1e-9)
    linear = MotionRows(times, q).trajectory.at(at)
    np.testing.assert_allclose(linear[:, 1], np.interp(at + times[0], times, q[:, 1]), atol=1e-12)


def test_each_two_rows_are_joined_by_what_both_state() -> None:
    rows = MotionRows(TIMES, POSITIONS, with_gaps(VELOCITIES, 3), with_gaps(ACCELERATIONS, 2, 3))
    assert rows.derivatives.tolist() == [2, 1, 0]
    assert rows.said == "1 linear and 1 cubic and 1 quintic of 3 pieces"
    quintic = MotionRows(TIMES[:2], POSITIONS[:2], VELOCITIES[:2], ACCELERATIONS[:2]).trajectory
    cubic = MotionRows(TIMES[1:3], POSITIONS[1:3], VELOCITIES[1:3]).trajectory
    motion = rows.trajectory
    np.testing.assert_array_equal(motion.at(np.array([0.1])), quintic.at(np.array([0.1])))
    np.testing.assert_allclose(motion.at(np.array([0.7])), cubic.at(np.array([0.4])), atol=1e-15)
    middle = (POSITIONS[2] + POSITIONS[3]) / 2.0
    np.testing.assert_allclose(motion.at(np.array([1.15]))[0], middle, atol=1e-15)
    np.testing.assert_allclose(motion.breakpoints, TIMES - TIMES[0])


def test_the_clock_starts_with_the_first_row_and_ends_are_met() -> None:
    motion = MotionRows(TIMES, POSITIONS, VELOCITIES, ACCELERATIONS).trajectory
    ends = motion.breakpoints[[0, -1]]
    assert ends[0] == 0.0
    for order, states in enumerate((POSITIONS, VELOCITIES, ACCELERATIONS)):
        np.testing.assert_allclose(motion.at(ends, order), states[[0, -1]], atol=1e-9)
    assert MotionRows(TIMES, POSITIONS).said == "linear between 4 rows"
    assert MotionRows(TIMES, POSITIONS, VELOCITIES, interpolation="linear").trajectory.coefficients.shape == (2, 3, 2)


WRONG = [
    ({"times": np.array([0.0])}, "times: two rows at least are needed, not 1"),
    ({"times": np.array([0.0, 0.5, 0.5, 1.0])}, "times: have to increase; row 3 is at 0.5 s, the row before at 0.5 s"),
    ({"times": np.array([0.0, 0.5, np.nan, 1.0])}, "times: row 3 has a number that is none"),
    ({"positions": POSITIONS[:3]}, "positions: 4 rows of joints are needed, not an array (3, 2)"),
    ({"positions": with_gaps(POSITIONS, 1)}, "positions: row 2 has a number that is none"),
    ({"velocities": VELOCITIES[:, :1]}, "velocities: rows (4, 2) are needed, not (4, 1)"),
    ({"velocities": None, "accelerations": ACCELERATIONS}, "velocities: row 1 states accelerations without velocities"),
    ({"interpolation": "cubic", "velocities": None}, "velocities: row 1 states none; cubic pieces need them in every"),
    (
        {"interpolation": "quintic", "accelerations": with_gaps(ACCELERATIONS, 2)},
        "accelerations: row 3 states none; quintic",
    ),
    ({"interpolation": "septic"}, "interpolation: 'septic' is not one of auto, linear, cubic, quintic"),
]


@pytest.mark.parametrize(("changes", "reason"), WRONG)
def test_what_is_no_motion_is_refused(changes: dict[str, object], reason: str) -> None:
    rows = {"times": TIMES, "positions": POSITIONS, "velocities": VELOCITIES, "accelerations": None} | changes
    with pytest.raises(InvalidProblem) as caught:
        MotionRows(**rows)  # type: ignore[arg-type]
    assert str(caught.value).startswith(reason)
