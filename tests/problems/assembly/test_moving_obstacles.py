"""Costs among obstacles that move, of every formulation: what they call clear is clear at its times, by NumPy alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.cases import equal_links, following, moving
from helpers.moving_scenes import CROSSED

from problems import Ellipse, Problem, move
from problems.base import FloatArray, as_array
from problems.evaluation import EvaluationOptions
from problems.motions import Trajectory
from problems.robots import PlanarArm
from problems.scene.moving import ConstantVelocity, MovingObstacle
from problems.tasks import Path
from solvers import Box

VM = EvaluationOptions("vm")
ARM = equal_links(3)
VELOCITY = (-0.6, 0.5)
OVAL = Ellipse((1.8, 0.2), (0.15, 0.25))
PASSING = (MovingObstacle(OVAL, ConstantVelocity(VELOCITY)),)
LINE = Path(((1.0, 0.5), (1.1, 0.6), (1.2, 0.6)))
PROBLEMS: dict[str, Problem[Any]] = {
    **{f"segments, {form}": moving(ARM, (1.0, 0.0), (0.5, 1.5), "time", "up", form, samples=12, obstacles=PASSING)
       for form in ("paper", "reduced")},
    **{f"knots, {form}": following(ARM, LINE, 0.1, "time", "up", form, samples=12, obstacles=PASSING)
       for form in ("paper", "reduced")},
    "spline": move(CROSSED, samples=30),
}  # fmt: skip


def depth(robot: PlanarArm, obstacle: MovingObstacle, trajectory: Trajectory, times: FloatArray) -> FloatArray:
    """The least of many points' squared distances from the centre, in semi-axes: below 1 inside; at each time."""
    (x, y), oval = obstacle.motion.velocity, obstacle.still  # type: ignore[attr-defined]
    theta = np.cumsum(trajectory.at(times), axis=1)
    ends = np.cumsum(np.array(robot.link_lengths)[:, None] * np.stack([np.cos(theta), np.sin(theta)], axis=2), axis=1)
    begins = np.concatenate([np.zeros_like(ends[:, :1]), ends[:, :-1]], axis=1)
    shares = np.linspace(0.0, 1.0, 60)[:, None, None, None]
    centers = np.array(oval.center) + times[:, None] * np.array([x, y])  # type: ignore[attr-defined]
    points = (begins + shares * (ends - begins) - centers[:, None]) / oval.semi_axes  # type: ignore[attr-defined]
    return np.asarray(np.square(points).sum(axis=-1).min(axis=(0, 2)))


@pytest.mark.parametrize("problem", PROBLEMS.values(), ids=PROBLEMS)
def test_what_costs_no_more_than_the_bound_is_clear_at_its_times(problem: Problem[Any]) -> None:
    (obstacle,), robot = problem.obstacles, problem.robot
    assert isinstance(obstacle, MovingObstacle)
    assert isinstance(robot, PlanarArm)
    x = Box(*problem.bounds).sample(np.random.default_rng(0), 150)
    feasible = problem.evaluator(VM)(x) <= problem.objective_upper_bound
    inside = []
    for row in x:
        parameters = problem.parameters_of(row)
        samples, motion = problem.motion.samples(parameters), problem.motion.trajectory(parameters)
        assert samples.times is not None
        times = as_array(samples.times).ravel()
        np.testing.assert_allclose(as_array(samples.theta), motion.at(times), atol=1e-6)
        inside.append(bool((depth(robot, obstacle, motion, times) < 1.0).any()))
    assert 5 < sum(inside) < 145
    assert not (feasible & np.array(inside)).any()


@pytest.mark.parametrize("name", [name for name in PROBLEMS if "paper" not in name])
def test_the_same_obstacle_out_of_the_way_is_no_hindrance(name: str) -> None:
    """What is hit in a scene is feasible with the obstacle elsewhere, unless something else forbids it."""
    problem = PROBLEMS[name]
    (obstacle,) = problem.obstacles
    assert isinstance(obstacle, MovingObstacle)
    x = Box(*problem.bounds).sample(np.random.default_rng(1), 200)
    away = MovingObstacle(Ellipse((1.9, -1.9), (0.1, 0.1)), ConstantVelocity((2.0, -2.0)))
    tasks = {"segments": moving, "knots": following}
    if name == "spline":
        free: Problem[Any] = move(replace(CROSSED, obstacles=(away,)), samples=30)
    else:
        make: Any = tasks[name.split(",", maxsplit=1)[0]]
        ends: Any = ((1.0, 0.0), (0.5, 1.5)) if make is moving else (LINE, 0.1)
        free = make(ARM, *ends, "time", "up", "reduced", samples=12, obstacles=(away,))
    hit, unhindered = (p.evaluator(VM)(x) <= p.objective_upper_bound for p in (problem, free))
    assert (unhindered | ~hit).all()
    assert unhindered.sum() > hit.sum()
