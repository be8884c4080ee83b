"""Near a path for all t: no false certificate against dense samples, hand-made distances, and what breaks it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from problems import CertificateStatus, Path, PlanarArm, Trajectory
from problems.certify import Travel
from problems.families.traced.proofs import distance_from_segments, prove_tracing
from problems.tasks import PathTracing

ARM = PlanarArm((0.6, 0.5, 0.4), (4.0,) * 3, (20.0,) * 3)


def motion(seed: int) -> Trajectory:
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, 2.0, 8)
    curve = CubicSpline(times, np.array([[0.3, 0.8, 0.5]]) + np.cumsum(rng.normal(scale=0.25, size=(8, 3)), axis=0))
    return Trajectory(curve.x, curve.c)


def traced(trajectory: Trajectory, count: int, accuracy: float) -> PathTracing:
    """A task whose path is the tool's own, at ``count`` times."""
    tool = ARM.skeleton(trajectory.at(np.linspace(0.0, trajectory.duration, count)))[:, -1]
    return PathTracing(ARM, Path.through(tool), accuracy)


def test_distances_from_a_segment_beside_before_and_behind_it() -> None:
    points = np.array([[0.5, 0.3], [-3.0, 4.0], [2.0, 0.0]])
    starts, ends = np.zeros((3, 2)), np.array([[1.0, 0.0]] * 3)
    assert distance_from_segments(points, starts, ends) == pytest.approx([0.3, 5.0, 1.0])


@pytest.mark.parametrize("seed", range(6))
def test_a_cell_bounds_how_far_the_tool_moves(seed: int) -> None:
    trajectory = motion(seed)
    travel, edges = Travel(ARM, trajectory), trajectory.times(60)
    cells = np.column_stack([edges[:-1], edges[1:]])
    bound = travel.of_bodies(cells)
    for cell, most in zip(cells, bound, strict=True):
        frames = ARM.skeleton(trajectory.at(np.linspace(*cell, 41)))
        moved = np.hypot.reduce(frames - frames[20], axis=2).max(axis=0)[1:]
        assert (moved <= most * (1.0 + 1e-12) + 1e-15).all()


@pytest.mark.parametrize("seed", range(6))
def test_the_verdict_agrees_with_dense_samples(seed: int) -> None:
    trajectory = motion(seed)
    task = traced(trajectory, 24, 0.02)
    times = task.point_times(trajectory)
    dense = np.linspace(0.0, trajectory.duration, 100_001)
    segment = np.clip(np.searchsorted(times, dense, side="right") - 1, 0, len(times) - 2)
    points = task.path.array
    away = distance_from_segments(ARM.skeleton(trajectory.at(dense))[:, -1], points[segment], points[segment + 1]).max()
    for accuracy, expected in ((1.05 * away, CertificateStatus.CERTIFIED), (0.95 * away, CertificateStatus.VIOLATED)):
        outcome = prove_tracing(ARM, points, accuracy, trajectory, times)
        assert outcome.status is expected
        assert outcome.worst <= away * (1.0 + 1e-6) + 1e-12


def test_points_are_passed_in_order_even_where_the_path_crosses_itself() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 33)
    eight = np.column_stack([0.8 + 0.2 * np.sin(turn), 0.2 * np.sin(2.0 * turn)])
    arm = PlanarArm((0.6, 0.6), (4.0,) * 2, (20.0,) * 2)
    c = (np.sum(eight**2, axis=1) - 0.72) / 0.72
    theta_2 = np.arccos(c)
    theta_1 = np.arctan2(*eight.T[::-1]) - np.arctan2(0.6 * np.sin(theta_2), 0.6 + 0.6 * np.cos(theta_2))
    curve = CubicSpline(np.linspace(0.0, 1.0, 33), np.column_stack([theta_1, theta_2]))
    trajectory = Trajectory(curve.x, curve.c)
    task = PathTracing(arm, Path.through(eight), 0.02)
    assert task.point_times(trajectory) == pytest.approx(np.linspace(0.0, 1.0, 33), abs=1e-3)
    backwards = PathTracing(arm, Path.through(eight[::-1]), 0.02)
    times = backwards.point_times(trajectory)
    assert prove_tracing(arm, backwards.path.array, 0.02, trajectory, times).status is CertificateStatus.VIOLATED
