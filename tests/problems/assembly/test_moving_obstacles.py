"""Costs among obstacles that move, of every formulation: what they call clear is clear at its times, by NumPy alone."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.cases import equal_links, following, moving
from helpers.moving_scenes import CROSSED
from helpers.searching import VM, sampled

from problems import Ellipse, Problem, move
from problems.base import FloatArray, as_array
from problems.motions import Trajectory
from problems.robots import PlanarArm
from problems.scene.moving import ConstantVelocity, MovingObstacle
from problems.tasks import Path

ARM = equal_links(3)
OVAL = Ellipse((1.8, 0.2), (0.15, 0.25))
PASSING = MovingObstacle(OVAL, ConstantVelocity((-0.6, 0.5)))
LINE = Path(((1.0, 0.5), (1.1, 0.6), (1.2, 0.6)))
KINDS = ("segments, paper", "segments, reduced", "knots, paper", "knots, reduced", "spline")


@cache
def problem_of(kind: str, obstacle: MovingObstacle = PASSING) -> Problem[Any]:
    if kind == "spline":
        return move(CROSSED if obstacle is PASSING else replace(CROSSED, obstacles=(obstacle,)), samples=30)
    shape, formulation = kind.split(", ")
    make, ends = {"segments": (moving, ((1.0, 0.0), (0.5, 1.5))), "knots": (following, (LINE, 0.1))}[shape]
    return make(ARM, *ends, "time", "up", formulation, samples=12, obstacles=(obstacle,))  # type: ignore[operator]


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


@pytest.mark.parametrize("kind", KINDS)
def test_what_costs_no_more_than_the_bound_is_clear_at_its_times(kind: str) -> None:
    problem = problem_of(kind)
    (obstacle,), robot = problem.criteria.obstacles, problem.criteria.robot
    assert isinstance(obstacle, MovingObstacle)
    assert isinstance(robot, PlanarArm)
    x = sampled(problem, 60)
    feasible = problem.evaluator(VM)(x) <= problem.objective_upper_bound
    inside = []
    for row in x:
        parameters = problem.parameters_of(row)
        samples, motion = problem.motion.samples(parameters), problem.motion.trajectory(parameters)
        assert samples.times is not None
        times = as_array(samples.times).ravel()
        np.testing.assert_allclose(as_array(samples.theta), motion.at(times), atol=1e-6)
        inside.append(bool((depth(robot, obstacle, motion, times) < 1.0).any()))
    assert 3 < sum(inside) < 57
    assert not (feasible & np.array(inside)).any()


@pytest.mark.parametrize("kind", [kind for kind in KINDS if "paper" not in kind])
def test_the_same_obstacle_out_of_the_way_is_no_hindrance(kind: str) -> None:
    """What is hit in a scene is feasible with the obstacle elsewhere, unless something else forbids it."""
    away = MovingObstacle(Ellipse((1.9, -1.9), (0.1, 0.1)), ConstantVelocity((2.0, -2.0)))
    x = sampled(problem_of(kind), 200, 1)
    hit, unhindered = (
        p.evaluator(VM)(x) <= p.objective_upper_bound for p in (problem_of(kind), problem_of(kind, away))
    )
    assert (unhindered | ~hit).all()
    assert unhindered.sum() > hit.sum()
