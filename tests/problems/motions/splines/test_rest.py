"""The spline in joint space against SciPy, and what it promises: knots met, C2, rest, exact extremes."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import make_interp_spline

from problems.families.knots.motion import RestSpline
from problems.motions import Trajectory

KNOTS = [
    np.array([0.0, 1.0]),
    np.array([0.0, 0.4, 1.0]),
    np.linspace(0.0, 1.0, 26),
    np.array([0.0, 0.02, 0.06, 0.1, 0.5, 0.52, 0.9, 0.98, 1.0]),
]


def angles_at(knots: np.ndarray, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(knots.size, 3))


def exact(spline: RestSpline, angles: np.ndarray) -> Trajectory:
    shape = np.asarray(spline.coefficients(ca.DM(angles)))
    return Trajectory.from_pieces(np.diff(spline.nodes), spline.pieces(shape))


@pytest.mark.parametrize("knots", KNOTS, ids=len)
def test_agrees_with_scipy_interpolation(knots: np.ndarray) -> None:
    spline, angles = RestSpline(knots), angles_at(knots)
    rest = [(1, np.zeros(3)), (2, np.zeros(3))]
    oracle = make_interp_spline(knots, angles, k=3, t=spline.basis.t, bc_type=(rest, rest))
    u = np.linspace(0.0, 1.0, 333)
    for derivative in range(3):
        expected = oracle.derivative(derivative)(u) if derivative else oracle(u)
        values = np.asarray(ca.mtimes(spline.sampling_matrix(u, derivative), spline.coefficients(ca.DM(angles))))
        assert values == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
        assert spline.operator(u, derivative) @ angles == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("knots", KNOTS, ids=len)
def test_meets_knots_is_c2_and_rests_at_both_ends(knots: np.ndarray) -> None:
    spline, angles = RestSpline(knots), angles_at(knots)
    trajectory = exact(spline, angles)
    ends = trajectory.samples(np.array([0.0, 1.0]))
    scale = np.abs(np.asarray(spline.accelerations(spline.coefficients(ca.DM(angles))))).max()
    assert np.asarray(trajectory.samples(knots).theta) == pytest.approx(angles, abs=1e-9)
    assert np.asarray(ends.speed) == pytest.approx(0.0, abs=1e-9 * scale)
    assert np.asarray(ends.acceleration) == pytest.approx(0.0, abs=1e-9 * scale)
    inner = spline.nodes[1:-1]
    before, after = trajectory.samples(inner - 1e-12), trajectory.samples(inner + 1e-12)
    assert np.asarray(before.acceleration) == pytest.approx(np.asarray(after.acceleration), abs=1e-6 * scale)
    assert np.asarray(before.speed) == pytest.approx(np.asarray(after.speed), abs=1e-6 * scale)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(range(1, len(KNOTS))))
def test_extremes_are_exact(seed: int, which: int) -> None:
    spline = RestSpline(KNOTS[which])
    angles = angles_at(KNOTS[which], seed)
    shape = spline.coefficients(ca.DM(angles))
    trajectory = exact(spline, angles)
    for derivative, values in ((1, spline.extreme_speeds(shape)), (2, spline.accelerations(shape))):
        times = trajectory.extreme_times(derivative)
        motion = trajectory.samples(times)
        oracle = np.asarray(motion.speed if derivative == 1 else motion.acceleration)
        assert np.asarray(values).max(axis=0) == pytest.approx(oracle.max(axis=0), rel=1e-9)
        assert np.asarray(values).min(axis=0) == pytest.approx(oracle.min(axis=0), rel=1e-9)


def test_same_formula_for_symbols_and_numbers() -> None:
    knots = KNOTS[3]
    spline, angles = RestSpline(knots), angles_at(knots)
    symbols = ca.SX.sym("angles", knots.size, 3)
    compiled = ca.Function("shape", [symbols], [spline.coefficients(symbols)])
    assert np.asarray(compiled(angles)) == pytest.approx(np.asarray(spline.coefficients(ca.DM(angles))), abs=1e-12)
