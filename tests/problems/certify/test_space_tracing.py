"""Near a path in space for all t: bounds of the tool's accelerations, and verdicts against dense samples."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from problems import CertificateStatus, Path, Trajectory
from problems.families.traced.proofs import ToolMotion, TracedTool
from problems.robots import SpatialArm
from problems.tasks import SpaceTracing
from tests.helpers.space import sliding_arm, small_arm
from tests.oracles.space import away_from_path, tool_poses

ARM = small_arm()
CERTIFIED, VIOLATED = CertificateStatus.CERTIFIED, CertificateStatus.VIOLATED


def motion(seed: int, robot: SpatialArm = ARM) -> Trajectory:
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, 2.0, 8)
    steps = np.cumsum(rng.normal(scale=0.2, size=(8, robot.dof)), axis=0)
    curve = CubicSpline(times, 0.6 + steps)
    return Trajectory(curve.x, curve.c)


def poses_at(trajectory: Trajectory, times: np.ndarray) -> np.ndarray:
    position, rotation = tool_poses(trajectory.at(times))
    return np.column_stack([position, rotation.as_quat()])


@pytest.mark.parametrize("robot", [ARM, sliding_arm()])
@pytest.mark.parametrize("seed", range(3))
def test_velocities_are_derivatives_and_accelerations_are_bounded(seed: int, robot: SpatialArm) -> None:
    trajectory, h = motion(seed, robot), 1e-5
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
    assert position == pytest.approx(robot.tool_at(trajectory.at(times))[0])


@pytest.mark.parametrize("seed", range(4))
def test_the_verdicts_agree_with_dense_samples(seed: int) -> None:
    trajectory = motion(seed)
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
    trajectory = motion(1)
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
