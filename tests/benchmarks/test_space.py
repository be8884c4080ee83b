"""What other planners find is turned into motions faithfully."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.motion_bench_maker.limited import within
from benchmarks.motion_bench_maker.problem_file import read_problems
from benchmarks.motion_bench_maker.setting import Setting
from problems.robots import JointLimits

pytest.importorskip("toppra")
from benchmarks.peers.space.timed_paths import _divided, spline_through, timed

LIMITS = JointLimits(speed=(1.0, 2.0), acceleration=(4.0, 3.0))


def test_a_line_takes_as_long_as_a_trapezoid_of_speed() -> None:
    trajectory = timed(spline_through(np.array([[0.0, 0.0], [3.0, 0.0]])), LIMITS)
    assert trajectory is not None
    assert trajectory.duration == pytest.approx(3.0 / 1.0 + 1.0 / 4.0, rel=1e-4)


def test_a_timed_path_is_run_from_end_to_end_within_the_limits() -> None:
    waypoints = np.random.default_rng(4).uniform(-1.0, 1.0, (6, 2))
    spline = spline_through(waypoints)
    trajectory = timed(spline, LIMITS)
    assert trajectory is not None
    times = np.linspace(0.0, trajectory.duration, 5000)
    theta = trajectory.at(times)
    assert theta[[0, -1]] == pytest.approx(waypoints[[0, -1]], abs=1e-9)
    on_path = spline(np.linspace(*spline.x[[0, -1]], 20_000))
    nearest = np.array([np.linalg.norm(on_path - one, axis=1).min() for one in theta[::50]])
    assert nearest.max() < 1e-3
    assert np.abs(trajectory.at(times, 1)).max(axis=0) == pytest.approx([1.0, 2.0], rel=0.3)
    assert (np.abs(trajectory.at(times, 1)) <= 1.01 * np.array(LIMITS.speed)).all()
    assert (np.abs(trajectory.at(times, 2)) <= 1.05 * np.array(LIMITS.acceleration)).all()
    joints = trajectory.at(trajectory.breakpoints[1:-1] + 1e-9) - trajectory.at(trajectory.breakpoints[1:-1] - 1e-9)
    assert np.abs(joints).max() < 1e-7


def test_lines_are_divided_ever_more_and_doubled_waypoints_left_out() -> None:
    first, second, *_ = _divided(np.array([[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]))
    assert first.tolist() == [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]
    assert second.tolist() == [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]


@pytest.mark.process
@pytest.mark.slow
@pytest.mark.parametrize(
    ("planner", "package"),
    [("ompl", "ompl"), ("roboplan", "roboplan"), ("drake", "pydrake"), ("direct", "tpbso_casadi")],
)
def test_a_planner_answers_with_a_motion_that_is_judged(
    planner: str, package: str, setting: Setting, folder: Path
) -> None:
    pytest.importorskip("ruckig")
    pytest.importorskip(package)
    from benchmarks.peers.space.planners import record  # noqa: PLC0415 (extras)

    (problem,) = read_problems(folder / "small.jsonl")
    answer = within(120.0, record, planner, setting, problem, 1, 5.0)
    assert answer.error == ""
    assert answer.certified
    assert answer.clearance is not None
    assert answer.clearance > 0.0
    assert answer.duration is not None
    assert 0.9 * answer.bound < answer.duration < 2.0 * answer.bound
