"""Near a path for all t, in the plane and in space: no false certificate against dense samples, and what breaks it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from problems import CertificateStatus, Path, PlanarArm, Trajectory
from problems.certify import Travel
from problems.families.traced.proofs import ToolMotion, TracedTool, distance_from_segments, prove_tracing
from problems.robots import SpatialArm
from problems.tasks import PathTracing, SpaceTracing
from tests.helpers.space import sliding_arm, small_arm
from tests.oracles.space import away_from_path, tool_poses


def planar_motion(seed: int) -> Trajectory:
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, 2.0, 8)
    curve = CubicSpline(times, np.array([[0.3, 0.8, 0.5]]) + np.cumsum(rng.normal(scale=0.25, size=(8, 3)), axis=0))
    return Trajectory(curve.x, curve.c)


def traced(trajectory: Trajectory, count: int, accuracy: float) -> PathTracing:
    """A task whose path is the tool's own, at ``count`` times."""
    tool = PLANAR.skeleton(trajectory.at(np.linspace(0.0, trajectory.duration, count)))[:, -1]
    return PathTracing(PLANAR, Path.through(tool), accuracy)


def test_distances_from_a_segment_beside_before_and_behind_it() -> None:
    points = np.array([[0.5, 0.3], [-3.0, 4.0], [2.0, 0.0]])
    starts, ends = np.zeros((3, 2)), np.array([[1.0, 0.0]] * 3)
    assert distance_from_segments(points, starts, ends) == pytest.approx([0.3, 5.0, 1.0])


@pytest.mark.parametrize("seed", range(2))
def test_a_cell_bounds_how_far_the_tool_moves(seed: int) -> None:
    trajectory = planar_motion(seed)
    travel, edges = Travel(PLANAR, trajectory), trajectory.times(60)
    cells = np.column_stack([edges[:-1], edges[1:]])
    bound = travel.of_bodies(cells)
    for cell, most in zip(cells, bound, strict=True):
        frames = PLANAR.skeleton(trajectory.at(np.linspace(*cell, 41)))
        moved = np.hypot.reduce(frames - frames[20], axis=2).max(axis=0)[1:]
        assert (moved <= most * (1.0 + 1e-12) + 1e-15).all()


@pytest.mark.parametrize("seed", range(2))
def test_the_verdict_agrees_with_dense_samples(seed: int) -> None:
    trajectory = planar_motion(seed)
    task = traced(trajectory, 24, 0.02)
    times = task.point_times(trajectory)
    dense = np.linspace(0.0, trajectory.duration, 20_001)
    segment = np.clip(np.searchsorted(times, dense, side="right") - 1, 0, len(times) - 2)
    points = task.path.array
    away = distance_from_segments(
        PLANAR.skeleton(trajectory.at(dense))[:, -1], points[segment], points[segment + 1]
    ).max()
    for accuracy, expected in ((1.05 * away, CertificateStatus.CERTIFIED), (0.95 * away, CertificateStatus.VIOLATED)):
        outcome = prove_tracing(PLANAR, points, accuracy, trajectory, times)
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


ARM = small_arm()
PLANAR = PlanarArm((0.6, 0.5, 0.4), (4.0,) * 3, (20.0,) * 3)
CERTIFIED, VIOLATED = CertificateStatus.CERTIFIED, CertificateStatus.VIOLATED


def spatial_motion(seed: int, robot: SpatialArm = ARM) -> Trajectory:
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, 2.0, 8)
    steps = np.cumsum(rng.normal(scale=0.2, size=(8, robot.dof)), axis=0)
    curve = CubicSpline(times, 0.6 + steps)
    return Trajectory(curve.x, curve.c)


def poses_at(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    position, rotation = tool_poses(trajectory.at(times))
    return np.column_stack([position, rotation.as_quat()])


@pytest.mark.parametrize("robot", [ARM, sliding_arm()])
@pytest.mark.parametrize("seed", range(2))
def test_velocities_are_derivatives_and_accelerations_are_bounded(seed: int, robot: SpatialArm) -> None:
    trajectory, h = spatial_motion(seed, robot), 1e-5
    tool = ToolMotion(robot, trajectory)
    times = np.linspace(0.01, trajectory.duration - 0.01, 301)
    position, rotation, velocity, spin = tool.at(times)
    after, before = (tool.at(times + side * h) for side in (1.0, -1.0))
    assert velocity == pytest.approx((after[0] - before[0]) / (2.0 * h), abs=1e-6)
    skew = np.einsum("nij,nkj->nik", (after[1] - before[1]) / (2.0 * h), rotation)
    assert spin == pytest.approx(np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1), abs=1e-6)
    linear, angular = tool.bounds_in(times)
    assert (np.linalg.norm((after[2] - before[2]) / (2.0 * h), axis=1) <= linear * (1.0 + 1e-6)).all()
    assert (np.linalg.norm((after[3] - before[3]) / (2.0 * h), axis=1) <= angular * (1.0 + 1e-6)).all()
    assert position == pytest.approx(robot.tool.at(trajectory.at(times))[0])


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_the_verdicts_agree_with_dense_samples(seed: int) -> None:
    trajectory = spatial_motion(seed)
    given = poses_at(trajectory, np.linspace(0.0, trajectory.duration, 20))
    path = Path.through(given)
    task = SpaceTracing(ARM, path, 0.1, 0.5)
    times = task.point_times(trajectory)
    assert times == pytest.approx(np.linspace(0.0, trajectory.duration, 20), abs=1e-6)
    traced = TracedTool(ToolMotion(ARM, trajectory), path.array, times, path.orientations)
    dense = tool_poses(trajectory.at(np.linspace(0.0, trajectory.duration, 20_001)))
    distance, angle = (part.max() for part in away_from_path(dense, path.array, given[:, 3:]))
    for prove, worst in ((traced.prove_position, distance), (traced.prove_orientation, angle)):
        for share, expected in ((1.05, CERTIFIED), (0.95, VIOLATED)):
            verdict = prove(share * worst)
            assert verdict.status is expected
            assert verdict.worst <= worst * (1.0 + 1e-4)


def test_a_path_run_backwards_or_with_the_tool_turned_is_not_certified() -> None:
    trajectory = spatial_motion(1)
    given = poses_at(trajectory, np.linspace(0.0, trajectory.duration, 20))
    turned = given.copy()
    turned[9, 3:] = (np.roll(np.eye(4), 1, axis=1) @ turned[9, 3:]) if np.ptp(turned[9, 3:]) else turned[9, 3:]
    for points, name in ((given[::-1], "accuracy"), (turned, "angular accuracy")):
        path = Path.through(points)
        times = SpaceTracing(ARM, path, 0.05, 0.05).point_times(trajectory)
        traced = TracedTool(ToolMotion(ARM, trajectory), path.array, times, path.orientations)
        verdict = traced.prove_position(0.05) if name == "accuracy" else traced.prove_orientation(0.05)
        assert verdict.name == name
        assert verdict.status is VIOLATED
