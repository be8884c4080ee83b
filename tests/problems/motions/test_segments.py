"""The polynomial segments (3)-(6): boundary conditions, continuity, coefficients, sampling, exact trajectories."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from problems import PlanarArm, Trajectory
from problems.certify import exact_time_scale
from problems.families.two_segments import Quantities
from problems.families.two_segments.motion import QUARTIC, QUINTIC, middle_acceleration, sampling_matrix
from problems.limits.joint_limits import AccelerationLimit, SpeedLimit

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


def test_coefficients_are_those_printed_in_the_paper() -> None:
    s, m, v, f, t1, t2 = 0.3, -0.8, 1.7, 2.1, 0.6, 1.3
    a = QUARTIC @ [s, m - s, v * t1] / t1 ** np.arange(5)
    assert a == pytest.approx([s, 0.0, 0.0, (4 * (m - s) - v * t1) / t1**3, (v * t1 - 3 * (m - s)) / t1**4])
    bend = 2 * 3 * a[3] * t1 + 3 * 4 * a[4] * t1**2
    b = QUINTIC @ [m, f - m, v * t2, bend * t2**2] / t2 ** np.arange(6)
    printed = [
        m,
        v,
        bend / 2,
        (20 * f - 20 * m - 12 * v * t2 - 3 * bend * t2**2) / (2 * t2**3),
        (30 * m - 30 * f + 16 * v * t2 + 3 * bend * t2**2) / (2 * t2**4),
        (12 * f - 12 * m - 6 * v * t2 - bend * t2**2) / (2 * t2**5),
    ]
    assert b == pytest.approx(printed)


@pytest.mark.parametrize("derivative", range(4))
@pytest.mark.parametrize("coefficients", [QUARTIC, QUINTIC], ids=["quartic", "quintic"])
def test_sampling_matrix_is_the_polynomial_itself(coefficients: np.ndarray, derivative: int) -> None:
    data = np.random.default_rng(1).normal(size=coefficients.shape[1])
    tau = np.linspace(0.0, 1.0, 9)
    polynomial = np.polynomial.Polynomial(coefficients @ data).deriv(derivative)
    values = np.asarray(ca.mtimes(sampling_matrix(coefficients, tau, derivative), ca.DM(data))).ravel()
    assert values == pytest.approx(polynomial(tau))


def some_motion() -> Trajectory:
    return quantities(0.2, 1.4, 2.5, -0.7, 0.5, 0.8).trajectory()


def test_derivatives_are_derivatives() -> None:
    motion, h = some_motion(), 1e-5
    t = np.linspace(0.01, motion.duration - 0.01, 50)
    before, at, after = (motion.samples(t + shift) for shift in (-h, 0.0, h))
    assert np.asarray(after.theta - before.theta) / (2 * h) == pytest.approx(np.asarray(at.speed), abs=1e-6)
    assert np.asarray(after.speed - before.speed) / (2 * h) == pytest.approx(np.asarray(at.acceleration), abs=1e-5)


@pytest.mark.parametrize(("derivative", "part"), [(0, "theta"), (1, "speed"), (2, "acceleration")])
def test_extremes_are_those_of_a_dense_sampling(derivative: int, part: str) -> None:
    motion = some_motion()
    exact = np.asarray(getattr(motion.samples(motion.extreme_times(derivative)), part))
    dense = np.asarray(getattr(motion.samples(np.linspace(0.0, motion.duration, 200_001)), part))
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


def test_least_stretch_just_keeps_the_limits() -> None:
    arm, motion = PlanarArm((1.0, 1.0), (2.0, 3.0), (10.0, 30.0)), some_motion()
    limits = [SpeedLimit(arm), AccelerationLimit(arm)]
    for factor, broken in ((1.0 + 1e-9, False), (1.0 - 1e-6, True)):
        slower = motion.time_scaled(exact_time_scale(limits, motion) * factor)
        t = np.linspace(0.0, slower.duration, 400_001)
        motion_at = slower.samples(t)
        too_fast = np.abs(np.asarray(motion_at.speed)) > arm.max_speed
        too_sharp = np.abs(np.asarray(motion_at.acceleration)) > arm.max_acceleration
        assert (too_fast.any() or too_sharp.any()) == broken
    assert slower.samples(np.array([0.0])).theta[0] == motion.samples(np.array([0.0])).theta[0]
