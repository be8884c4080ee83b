"""Splines against SciPy's own: clamped, with corners, between rests, over time; exact pieces, local bases, ends."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, BSpline, CubicSpline, make_interp_spline

from problems.base import FloatArray, as_array
from problems.families.knots.motion import RestSpline
from problems.families.time_splines import FIXED, TimeSpline
from problems.families.traced.encoding import CornerSpline
from problems.motions import Trajectory
from problems.motions.splines import ClampedSpline, SplineShape

UNEVEN = np.array([0.0, 0.1, 0.15, 0.5, 0.9, 1.0])
SPLINE = ClampedSpline(UNEVEN)
POINTS = np.random.default_rng(0).normal(size=(SPLINE.size, 2))
U = np.linspace(0.0, 1.0, 41)


@pytest.mark.parametrize("order", range(4))
def test_all_forms_are_the_same_spline(order: int) -> None:
    knots = np.concatenate([[0.0] * 3, UNEVEN, [1.0] * 3])
    inside = U[:-1]
    expected = BSpline(knots, POINTS, 3)(inside, order)
    scale = 1e-12 * np.abs(expected).max()
    assert as_array(SPLINE.sampling_matrix(inside, order)) @ POINTS == pytest.approx(expected, abs=scale)
    assert SPLINE.curve(POINTS)(inside, order) == pytest.approx(expected, abs=scale)
    basis, first = SPLINE.local_basis(inside, order)
    local = np.einsum("ni,nik->nk", basis, POINTS[first[:, None] + np.arange(4)])
    assert local == pytest.approx(expected, abs=scale)


# With corners: natural between them

CORNERED = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.62, 0.8, 0.9, 1.0])
each_corners = pytest.mark.parametrize("corners", [(), (3,), (3, 4), (1, 7)], ids=str)


def angles_at(knots: FloatArray, seed: int = 0) -> FloatArray:
    return np.random.default_rng(seed).normal(size=(knots.size, 3))


@each_corners
def test_each_stretch_is_the_natural_spline(corners: tuple[int, ...]) -> None:
    spline, given = CornerSpline(CORNERED, corners), angles_at(CORNERED)
    curve = spline.curve(np.asarray(spline.coefficients(ca.DM(given))))
    for first, last in spline.stretches:
        expected = CubicSpline(CORNERED[first : last + 1], given[first : last + 1], bc_type="natural")
        inside = np.linspace(CORNERED[first], CORNERED[last], 50)[1:-1]
        for order in range(4):
            scale = 1.0 + np.abs(expected(inside, order)).max()
            assert np.abs(curve(inside, order) - expected(inside, order)).max() <= 1e-10 * scale


# Between rests: knots met, C2, rest, exact extremes

KNOTS = [
    np.array([0.0, 1.0]),
    np.array([0.0, 0.4, 1.0]),
    np.linspace(0.0, 1.0, 26),
    np.array([0.0, 0.02, 0.06, 0.1, 0.5, 0.52, 0.9, 0.98, 1.0]),
]


def exact(spline: RestSpline, angles: FloatArray) -> Trajectory:
    shape = np.asarray(spline.coefficients(ca.DM(angles)))
    return Trajectory.from_pieces(np.diff(spline.nodes), spline.pieces(shape))


@pytest.mark.parametrize("knots", KNOTS, ids=len)
def test_agrees_with_scipy_interpolation(knots: FloatArray) -> None:
    spline, angles = RestSpline(knots), angles_at(knots)
    rest = [(1, np.zeros(3)), (2, np.zeros(3))]
    oracle = make_interp_spline(knots, angles, k=3, t=spline.basis.t, bc_type=(rest, rest))
    u = np.linspace(0.0, 1.0, 333)
    for derivative in range(3):
        expected = oracle.derivative(derivative)(u) if derivative else oracle(u)
        values = np.asarray(ca.mtimes(spline.sampling_matrix(u, derivative), spline.coefficients(ca.DM(angles))))
        assert values == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())
        assert spline.operator(u, derivative) @ angles == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@settings(max_examples=15, deadline=None)
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


# Over time: the quintic between two states, ends that control points fix

ROBOT = equal_links(2)
pieces = st.integers(1, 8)
seconds = st.floats(0.2, 20.0)
seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=25)
@given(pieces, seeds)
def test_any_number_of_pieces_gives_the_same_quintic(count: int, seed: int) -> None:
    states = np.random.default_rng(seed).normal(size=6)
    motion = TimeSpline(ROBOT, count, 4)
    curve = motion.spline.curve(motion.quintic @ states[:, None])
    oracle = BPoly.from_derivatives([0.0, 1.0], states.reshape(2, 3))
    u = np.linspace(0.0, 1.0, 41)
    assert curve(u)[:, 0] == pytest.approx(oracle(u), abs=1e-12)


@settings(max_examples=25)
@given(pieces, seconds, seeds)
def test_inner_control_points_change_nothing_at_the_ends(count: int, duration: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    states, by_u = rng.normal(size=(2, 3, 2)), duration ** np.arange(3)[:, None]
    motion = TimeSpline(ROBOT, count, 6)
    points = motion.quintic @ (states * by_u).reshape(6, 2)
    points[FIXED:-FIXED] += rng.normal(size=(motion.inner, 2))
    trajectory = motion.trajectory(SplineShape(ca.DM(points), ca.DM(duration)))
    start, end = (np.array([trajectory.at(t, n)[0] for n in range(3)]) for t in ([0.0], [trajectory.duration]))
    assert trajectory.duration == pytest.approx(duration)
    assert start == pytest.approx(states[0], abs=1e-7)
    assert end == pytest.approx(states[1], abs=1e-7)
    assert motion.inner == count - 1
