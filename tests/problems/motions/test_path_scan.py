"""The scan of a path: lines timed by hand, linear programs, TOPP-RA, and velocities at the ends."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linprog

from problems import PlanarArm
from problems.base import FloatArray, as_array
from problems.motions import PathSpline, TimedPath

SEEDS = range(3)
AT_REST = (ca.DM(0.0), None)


def spline(speed: Any, acceleration: Any, nodes: Any = (0.0, 0.5, 1.0), steps: int = 10) -> PathSpline:
    return PathSpline(PlanarArm((1.0,) * len(speed), tuple(speed), tuple(acceleration)), tuple(nodes), steps)


def line(motion: PathSpline, way: FloatArray) -> ca.DM:
    return ca.DM(motion.spline.greville[:, None] * way)


def random_path(seed: int) -> tuple[PathSpline, FloatArray]:
    rng = np.random.default_rng(seed)
    k, pieces = int(rng.integers(2, 6)), int(rng.integers(2, 7))
    nodes = np.append(0.0, np.cumsum(rng.uniform(0.5, 1.5, pieces)))
    speed, acceleration = rng.uniform(1.0, 5.0, k), rng.uniform(2.0, 30.0, k)
    motion = spline(speed.tolist(), acceleration.tolist(), (nodes / nodes[-1]).tolist(), int(rng.integers(5, 20)))
    size = motion.spline.size
    return motion, rng.uniform(-1, 1, (size, k)) + np.linspace(0, 1, size)[:, None] * rng.uniform(-2, 2, k)


def slopes(motion: PathSpline, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    first, second = (as_array(motion.spline.sampling_matrix(motion.parameters_u, n)) @ points for n in (1, 2))
    return first, second


# Lines, by hand; switches are at grid points


@pytest.mark.parametrize(
    ("way", "speed", "acceleration", "duration"),
    [
        ([1.0, 0.0], [9.0, 9.0], [4.0, 4.0], 1.0),  # 2 sqrt(1 / 4)
        ([-1.0, 0.5], [9.0, 9.0], [4.0, 2.0], 1.0),  # both joints at their limit
        ([1.0, 1.0], [9.0, 9.0], [4.0, 1.0], 2.0),  # the slower joint decides
        ([1.0, 0.0], [1.0, 1.0], [2.5, 2.5], 1.4),  # 0.2 of ramps at either end, 0.6 in between
    ],
)
def test_least_time_along_a_line(way: Any, speed: Any, acceleration: Any, duration: float) -> None:
    motion = spline(speed, acceleration)
    timed = motion.timed(line(motion, np.array(way)), AT_REST)
    assert float(timed.duration) == pytest.approx(duration, rel=1e-9)
    assert float(timed.gap) == 0.0
    squared = as_array(timed.squared).ravel()
    assert squared == pytest.approx(squared[::-1], abs=1e-9)


@pytest.mark.parametrize(
    ("start", "goal", "duration"),
    [
        (0.5, None, 1.25),  # 0.15 / 0.75 s, 0.65 s at 1 rad/s, 0.4 s
        (0.0, 0.5, 1.25),
        (0.5, 0.5, 1.10),  # 0.2, 0.7, 0.2
        (1.0, 1.0, 1.0),
    ],
)
def test_least_time_between_moving_ends(start: float, goal: float | None, duration: float) -> None:
    motion = spline([1.0, 9.0], [2.5, 9.0])
    rates = ca.DM(start**2), None if goal is None else ca.DM(goal**2)
    timed = motion.timed(line(motion, np.array([1.0, 0.0])), rates)
    assert float(timed.gap) == pytest.approx(0.0, abs=1e-12)
    assert float(timed.duration) == pytest.approx(duration, rel=1e-9)
    trajectory = motion.trajectory(timed)
    ends = trajectory.at(trajectory.breakpoints[[0, -1]], 1)[:, 0]
    assert ends == pytest.approx(np.array([start, goal or 0.0]), abs=1e-7)


@pytest.mark.parametrize(("start", "goal"), [(1.0, None), (0.0, 1.0), (1.2, 0.1)])
def test_ends_too_fast_for_the_way_between_them_leave_a_gap(start: float, goal: float | None) -> None:
    """From 1 to 0 rad/s in 1 rad takes 0.5 rad/s^2, and so does 0 to 1."""
    motion = spline([2.0, 9.0], [0.4, 9.0])
    rates = ca.DM(start**2), None if goal is None else ca.DM(goal**2)
    timed = motion.timed(line(motion, np.array([1.0, 0.0])), rates)
    assert float(timed.gap) > 0.01
    assert np.isfinite(as_array(timed.squared)).all()


def test_a_path_that_stands_still_takes_next_to_no_time() -> None:
    motion = spline([1.0, 1.0], [1.0, 1.0])
    duration = float(motion.timed(ca.DM.ones(motion.spline.size, 2), AT_REST).duration)
    assert 0.0 < duration < 1e-3


# Any path


@pytest.mark.parametrize("seed", SEEDS)
def test_the_scan_solves_the_linear_program_of_each_grid_point(seed: int) -> None:
    motion, points = random_path(seed)
    first, second = slopes(motion, points)
    limits, steps = motion.robot.limits, motion.double_steps
    acceleration = np.array(limits.acceleration)
    most = np.zeros(steps.size + 1)
    rows: list[tuple[FloatArray, FloatArray]] = []
    for i in range(steps.size - 1, -1, -1):
        ends = [(second[i], first[i]), (second[i + 1], first[i + 1] + steps[i] * second[i + 1])]
        block = np.vstack([np.column_stack(end) for end in ends])
        rows.insert(0, (np.vstack([block, -block]), np.tile(acceleration, 4)))
        a = np.vstack([rows[0][0], [[1.0, steps[i]], [-1.0, -steps[i]]]])
        b = np.append(rows[0][1], [most[i + 1], 0.0])
        highest = ((np.array(limits.speed) / np.abs(first[i])) ** 2).min()
        most[i] = linprog([-1.0, 0.0], a, b, bounds=[(0.0, highest), (None, None)]).x[0]
    squared = np.zeros(steps.size + 1)
    for i, step in enumerate(steps):
        a, b = rows[i]
        largest = linprog(
            [-1.0], a[:, 1:], b - a[:, 0] * squared[i], bounds=[(None, (most[i + 1] - squared[i]) / step)]
        )
        squared[i + 1] = squared[i] + step * largest.x[0]
    expected = (steps / (np.sqrt(squared[:-1]) + np.sqrt(np.maximum(squared[1:], 0.0)))).sum()
    assert float(motion.timed(ca.DM(points), AT_REST).duration) == pytest.approx(expected, rel=1e-6)


def test_slower_motions_take_longer_and_no_less_than_asked() -> None:
    motion, points = random_path(0)
    timed = motion.timed(ca.DM(points), AT_REST)
    fast = float(timed.duration)
    for factor, shortest, expected in ((2.0, 0.0, 2.0 * fast), (1.0, 3.0 * fast, 3.0 * fast), (2.0, fast, 2.0 * fast)):
        slow: TimedPath = timed.time_scaled(factor, shortest)
        assert float(slow.duration) == pytest.approx(expected)
        assert motion.trajectory(slow).duration == pytest.approx(expected)
        ratio = as_array(slow.squared)[1:-1] / as_array(timed.squared)[1:-1]
        assert np.sqrt(ratio) == pytest.approx(fast / expected)


# With torques


WEIGHTY = PlanarArm(
    (0.5, 0.5, 0.4),
    (4.0,) * 3,
    (40.0,) * 3,
    link_masses=(2.0, 2.0, 1.0),
    coulomb_friction=(0.5, 0.5, 0.1),
    max_torque=(60.0, 30.0, 9.0),
)


def weighty_path(nodes: tuple[float, ...], steps: int, seed: int) -> tuple[PathSpline, FloatArray]:
    motion = PathSpline(WEIGHTY, nodes, steps)
    noise = np.random.default_rng(seed).uniform(-0.3, 0.3, (motion.spline.size, 3))
    return motion, np.linspace(0, 1, motion.spline.size)[:, None] * [2.0, -1.0, 0.5] + noise


@pytest.mark.parametrize("seed", SEEDS)
def test_with_torques_the_scan_is_that_of_linear_programs(seed: int) -> None:
    """Backward the largest b, forward the largest c, each found by HiGHS from joint torques computed one by one."""
    motion, points = weighty_path((0.0, 0.5, 1.0), 6, seed)
    timed = motion.timed(ca.DM(points), AT_REST)
    theta, first, second = (as_array(motion.spline.sampling_matrix(motion.parameters_u, n)) @ points for n in range(3))
    torque, acceleration, speed = (
        np.array(getattr(WEIGHTY.limits, name)) for name in ("torque", "acceleration", "speed")
    )

    def rows(i: int, ahead: bool, step: float) -> tuple[FloatArray, FloatArray]:
        """A (b, c) <= r at one end of an interval."""
        still, q = np.zeros((1, 3)), theta[[i]]
        held = as_array(WEIGHTY.dynamics.torques(ca.DM(q), ca.DM(1e-12 * first[[i]]), ca.DM(still))).ravel()
        forces = [
            as_array(WEIGHTY.dynamics.torques(ca.DM(q), ca.DM(v), ca.DM(a))).ravel()
            for v, a in ((first[[i]], second[[i]]), (1e-12 * first[[i]], first[[i]]))
        ]
        bend, rate = forces[0] - held, forces[1] - held
        both = np.concatenate([np.column_stack([second[i], first[i]]), np.column_stack([bend, rate])])
        both[:, 1] += step * both[:, 0] if ahead else 0.0
        upper, lower = np.concatenate([acceleration, torque - held]), np.concatenate([acceleration, torque + held])
        return np.concatenate([both, -both]), np.concatenate([upper, lower])

    most, last = np.zeros(len(theta)), len(theta) - 1
    for i in range(last - 1, -1, -1):
        step = motion.double_steps[i]
        (a1, r1), (a2, r2) = rows(i, False, step), rows(i + 1, True, step)
        inner = np.array([[1.0, step], [-1.0, -step]])
        top = ((speed / np.maximum(np.abs(first[i]), 1e-9)) ** 2).min()
        found = linprog(
            [-1.0, 0.0], np.concatenate([a1, a2, inner]), [*r1, *r2, most[i + 1], 0.0], bounds=[(0, top), (None, None)]
        )
        most[i] = found.x[0]
    b = np.zeros(len(theta))
    for i in range(last):
        step = motion.double_steps[i]
        (a1, r1), (a2, r2) = rows(i, False, step), rows(i + 1, True, step)
        a, r = np.concatenate([a1, a2]), np.concatenate([r1, r2]) - np.concatenate([a1, a2])[:, 0] * b[i]
        c = min((r[a[:, 1] > 0] / a[a[:, 1] > 0, 1]).min(), (most[i + 1] - b[i]) / step)
        b[i + 1] = min(most[i + 1], max(0.0, b[i] + step * c))
    np.testing.assert_allclose(as_array(timed.squared).ravel(), b, rtol=1e-6, atol=1e-6 * b.max())
