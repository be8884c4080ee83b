"""Among balls, obstacles of one make share code: the cost is that of every pair written out, another scene compiles."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.evaluation import needs_compiler, same_bits
from helpers.searching import source
from helpers.space import small_arm

from problems import Ball, Box, Cylinder, HalfSpace, Joints, Move, MoveProblem, Obstacle, move
from problems.evaluation import EvaluationOptions
from problems.limits import SAMPLING_MARGIN
from problems.robots import SpatialArm, Sphere

pytestmark = pytest.mark.usefixtures("cache_folder")
TURNED = (0.0, 0.0, 0.6, 0.8)
SCENE: tuple[Obstacle, ...] = (
    Box(center=(0.5, 0.3, 0.5), size=(0.2, 0.2, 0.2), quaternion=TURNED),
    Box(center=(-0.4, 0.5, 0.7), size=(0.3, 0.1, 0.2), quaternion=TURNED),
    Ball(center=(0.3, -0.5, 0.6), radius=0.15),
    HalfSpace(center=(0.0, 0.0, -0.1)),
)
START, GOAL = (-0.3, 0.4, 0.0, 1.0, 0.0, 0.5, 0.0), (1.2, 0.7, 0.2, 0.8, 0.0, 0.4, 0.3)


def arm(**changes: Any) -> SpatialArm:
    """With four balls on each of two links, ten on a third and one that nothing moves."""
    spheres = [Sphere(0, (0.0, 0.0, 0.0), 0.05, "base")]
    spheres += [Sphere(2, (0.0, 0.0, 0.1 * k), 0.05, "upper arm") for k in range(4)]
    spheres += [Sphere(4, (0.0, 0.0, 0.1 * k), 0.05, "forearm") for k in range(4)]
    spheres += [Sphere(7, (0.03 * (k % 2), 0.0, 0.02 * k), 0.03, "hand") for k in range(10)]
    near = [one for one, sphere in enumerate(spheres) if sphere.link == 2]
    far = [two for two, sphere in enumerate(spheres) if sphere.link == 7]
    pairs = [(one, two) for one in near for two in far]
    return small_arm(spheres=tuple(spheres), margin=0.01, self_collision=True, kept_pairs=tuple(pairs), **changes)


def problem_of(obstacles: tuple[Obstacle, ...], robot: SpatialArm | None = None) -> MoveProblem:
    return move(Move(robot or arm(), Joints(START), (Joints(GOAL),), obstacles=obstacles), samples=24)


def candidates(problem: MoveProblem, count: int = 40) -> np.ndarray:
    return np.random.default_rng(0).uniform(*problem.bounds, (count, len(problem.variables)))


def excess(problem: MoveProblem, x: np.ndarray) -> float:
    """By how much one candidate breaks its limits, every pair written out in numbers."""
    samples = problem.motion.samples(problem.decoded(ca.DM(x)).parameters)
    penalised = problem.encoding.penalised(problem.criteria.limits)
    constraints = [constraint for limit in penalised for constraint in limit.constraints_at(samples, SAMPLING_MARGIN)]
    values = [(np.array(c.expression), c.bounds[0], c.scales) for c in constraints if c.name.endswith("clearance")]
    assert len(values) == 2
    return sum(float((np.maximum(0.0, lower - value) / scale).sum()) for value, lower, scale in values)


@pytest.mark.slow
@needs_compiler
def test_the_cost_is_that_of_every_pair_written_out() -> None:
    problem = problem_of(SCENE)
    x = 0.4 * candidates(problem)
    costs = problem.evaluator(EvaluationOptions("native"))(x)
    found = np.array([excess(problem, row) for row in x])
    assert 5 < (found > 0.0).sum() < 40
    broken = found > 0.0
    assert costs[broken] - problem.weights.objective_upper_bound == pytest.approx(found[broken], rel=1e-9)
    assert (costs[~broken] < problem.weights.objective_upper_bound).all()


@pytest.mark.slow
@needs_compiler
def test_bits_are_those_of_the_virtual_machine() -> None:
    problem = problem_of(SCENE)
    x = candidates(problem)
    native, interpreted = (problem.evaluator(EvaluationOptions(backend)) for backend in ("native", "vm"))
    assert same_bits(native(x), interpreted(x))
    assert native.backend == "native"


@pytest.mark.slow
def test_another_number_of_obstacles_of_the_same_make_compiles_nothing() -> None:
    first = source(problem_of(SCENE))
    more = (*SCENE, Box(center=(0.1, 0.9, 0.4), size=(0.1, 0.2, 0.3), quaternion=TURNED))
    assert source(problem_of(more)) == first
    cylinder = Cylinder(center=(0.1, 0.9, 0.4), radius=0.1, length=0.2)
    assert source(problem_of((*SCENE, cylinder))) != first
