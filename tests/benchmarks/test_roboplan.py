"""What roboplan is asked is what the setting states, and its samples become a motion."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.motion_bench_maker.problem_file import MotionProblem, read_problems
from benchmarks.motion_bench_maker.setting import Setting

pytest.importorskip("roboplan")
from benchmarks.peers.space.roboplan_trajectory import GROUP, Sampled, scene_of


@pytest.fixture
def problem(folder: Path) -> MotionProblem:
    """The small robot's."""
    (only,) = read_problems(folder / "small.jsonl")
    return only


@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_it_sees_collisions_where_the_checker_does(setting: Setting, problem: MotionProblem, margin: float) -> None:
    checker = setting.checker(problem)
    scene = scene_of(setting, problem, checker, margin)
    postures = np.random.default_rng(1).uniform(*np.array(setting.limits.position).T, (3000, 3))
    centers = checker.centers(postures)
    nearest = np.minimum(
        checker.obstacle_distances(centers).min(axis=1) - margin,
        checker.own_distances(centers).min(axis=1, initial=np.inf) - 2.0 * margin,
    )
    touches = [scene.hasCollisions(posture) for posture in postures]
    assert 0.01 < np.mean(touches) < 0.99
    assert touches == (nearest < 0.0).tolist()


def test_it_knows_the_limits(setting: Setting, problem: MotionProblem) -> None:
    scene = scene_of(setting, problem, setting.checker(problem), 0.0)
    assert np.abs(scene.getAccelerationLimitVectors(GROUP)).tolist() == [[5.0] * 3] * 2
    assert np.abs(scene.getVelocityLimitVectors(GROUP)).tolist() == [[2.0, 3.0, 3.0]] * 2
    low, high = scene.getPositionLimitVectors(GROUP)
    assert (low.tolist(), high.tolist()) == ([-3.0, -3.0, -2.0], [3.0, 3.0, 2.0])


def test_samples_become_a_motion_through_them() -> None:
    times = np.array([0.0, 0.1, 0.15])
    angles, speeds, accelerations = np.random.default_rng(2).normal(size=(3, 3, 2))
    motion = Sampled(times, angles, speeds, accelerations, "adaptive").trajectory
    assert motion.duration == pytest.approx(0.15)
    assert motion.at(times) == pytest.approx(angles)
    assert motion.at(times, 1) == pytest.approx(speeds)
