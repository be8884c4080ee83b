"""The checker that motions are judged with: against hand-computed distances, against itself, against the model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from benchmarks.motion_bench_maker.collision import Checker
from benchmarks.motion_bench_maker.planner_collision import PlannerCollision
from benchmarks.motion_bench_maker.problem_file import MotionProblem, Obstacle, read_problems
from benchmarks.motion_bench_maker.setting import Setting
from problems.base import FloatArray
from problems.evaluation.compiler import NativeUnavailable, find_compiler
from problems.robots import read_spheres, read_urdf

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
ASIDE = (float(np.sqrt(0.5)), 0.0, 0.0, float(np.sqrt(0.5)))  # z becomes -y


def scene(rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """Boxes and cylinders where the small robot moves."""
    obstacles = []
    for shape in ("box", "cylinder") * 3:
        quaternion = rng.normal(size=4)
        sizes = rng.uniform(0.2, 0.8, 3)
        sizes[1] = sizes[0] if shape == "cylinder" else sizes[1]
        unit = quaternion / np.linalg.norm(quaternion)
        obstacles.append(Obstacle(shape, tuple(rng.uniform(-2.0, 2.0, 3)), tuple(unit), tuple(sizes)))
    return tuple(obstacles)


def checker(setting: Setting, folder: Path, obstacles: tuple[Obstacle, ...]) -> Checker:
    (problem,) = read_problems(folder / "small.jsonl")
    return setting.checker(replace(problem, obstacles=obstacles))


@pytest.mark.parametrize(
    ("shape", "quaternion", "point", "distance"),
    [
        ("box", UPRIGHT, (2.0, 0.5, 0.5), 1.0),  # a face
        ("box", UPRIGHT, (4.0, 6.0, 0.0), 5.0),  # an edge
        ("box", UPRIGHT, (2.0, 4.0, 6.0), np.sqrt(1.0 + 4.0 + 9.0)),  # a corner
        ("box", UPRIGHT, (0.75, 0.0, 0.0), -0.25),  # inside
        ("box", ASIDE, (0.0, 5.0, 0.0), 2.0),
        ("cylinder", UPRIGHT, (3.0, 4.0, 0.0), 4.0),  # its side
        ("cylinder", UPRIGHT, (0.6, 0.0, 5.0), 2.0),  # its end
        ("cylinder", UPRIGHT, (0.0, 4.0, 7.0), 5.0),  # its rim
        ("cylinder", UPRIGHT, (0.0, 0.75, 0.0), -0.25),
        ("cylinder", ASIDE, (0.0, 5.0, 0.5), 2.0),
    ],
)
def test_distances_are_those_computed_by_hand(
    setting: Setting, folder: Path, shape: str, quaternion: tuple[float, ...], point: tuple[float, ...], distance: float
) -> None:
    size = (2.0, 4.0, 6.0) if shape == "box" else (2.0, 2.0, 6.0)
    one = checker(setting, folder, (Obstacle(shape, (0.0, 0.0, 0.0), quaternion, size),))
    centers = np.broadcast_to(point, (1, 3, 3)).astype(float)
    found = one.obstacle_distances(centers)[0] + setting.spheres.radii
    assert found == pytest.approx(distance, abs=1e-12)


def test_own_pairs_are_three_joints_apart_and_clear_at_both_ends(setting: Setting, folder: Path) -> None:
    one = checker(setting, folder, ())
    assert one.own.tolist() == [[0, 1], [0, 2]]
    folded = MotionProblem("x", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), ())
    large = replace(setting.spheres, radii=np.array([2.0, 2.0, 0.1]))
    assert Checker.of(setting.kinematics, large, folded).own.tolist() == [[0, 2]]


def test_the_least_clearance_of_a_motion_is_that_of_all_pairs_at_all_times(setting: Setting, folder: Path) -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        one = checker(setting, folder, scene(rng))
        start, way = rng.uniform(-1.0, 1.0, 3), rng.uniform(-2.0, 2.0, 3)

        def at(times: FloatArray, start: FloatArray = start, way: FloatArray = way) -> FloatArray:
            return np.asarray(start + np.sin(times)[:, None] * way)

        every = one.clearance(at(np.linspace(0.0, 3.0, 3001))).min()
        assert one.least_clearance(at, 3.0, 3001) == every


def test_frames_and_distances_are_the_models(setting: Setting, folder: Path) -> None:
    description = read_urdf((folder / "small.urdf").read_text(), None, "tool0")
    spheres = read_spheres((folder / "small.toml").read_text(), description.links)
    arm = description.arm(max_acceleration=5.0, spheres=spheres)
    theta = np.random.default_rng(1).uniform(-2.0, 2.0, (20, 3))
    points = arm.positions(ca.DM(theta))
    ours = np.stack([np.array(points[body.start]) for body in arm.bodies.each], axis=1)
    assert checker(setting, folder, ()).centers(theta) == pytest.approx(ours, abs=1e-12)


def test_the_compiled_check_agrees(setting: Setting, folder: Path) -> None:
    try:
        find_compiler()
    except NativeUnavailable:
        pytest.skip("no C++ compiler")
    rng = np.random.default_rng(2)
    one = checker(setting, folder, scene(rng))
    theta = rng.uniform(-2.0, 2.0, (500, 3))
    clearances = one.clearance(theta)
    assert 0.2 < (clearances > 0.0).mean() < 0.99
    for margin in (0.0, 0.05):
        compiled = PlannerCollision(one, margin)
        assert [compiled.all_free(row[None]) for row in theta] == (clearances > margin).tolist()
        assert compiled.all_free(theta[clearances > margin])
        assert not compiled.all_free(theta)
