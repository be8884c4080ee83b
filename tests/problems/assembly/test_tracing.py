"""Tracing a path: the search's cost, the timing at corners, the program that rounds them, judged by dense samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from helpers.slow import slow_except

from problems import Ellipse, InvalidProblem, Path, PlanarArm, Trajectory
from problems.base import FloatArray
from problems.families.traced import tracing
from problems.families.traced.problem import TracingProblem
from problems.families.traced.proofs import distance_from_segments
from problems.tasks import PathTracing, knots_of
from solvers import IPOPT
from tpbso_casadi.planning.finishing import Refinement

SQUARE = np.array([[0.5, 0.1], [0.8, 0.1], [0.8, 0.4], [0.5, 0.4], [0.5, 0.1]])
ARM = PlanarArm((0.5, 0.4, 0.3), (3.0,) * 3, (20.0,) * 3)
TASKS = {
    "three links": PathTracing(ARM, Path.through(SQUARE), 0.01),
    "two links": PathTracing(PlanarArm((0.6, 0.5), (3.0,) * 2, (20.0,) * 2), Path.through(SQUARE), 0.01, elbow="up"),
    "jerk": PathTracing(replace(ARM, max_jerk=(300.0,) * 3), Path.through(SQUARE[:3]), 0.01, elbow="up"),
    "obstacle": PathTracing(ARM, Path.through(SQUARE[:3]), 0.01, obstacles=(Ellipse((0.3, 0.3), (0.08, 0.05)),)),
}


@cache
def problem_of(name: str) -> TracingProblem:
    return tracing(TASKS[name])


def best(problem: TracingProblem, count: int = 200) -> FloatArray:
    x = np.random.default_rng(4).uniform(*problem.bounds, (count, len(problem.variables)))
    return np.asarray(x[int(np.argmin(problem.cost(x)))])


@pytest.mark.parametrize("name", ["two links", "jerk"])
def test_the_cost_of_a_feasible_candidate_is_about_its_duration(name: str) -> None:
    problem = tracing(TASKS[name], samples=400)
    x = best(problem, 100)
    cost = float(problem.cost(x[None])[0])
    assert cost <= problem.objective_upper_bound
    without_jerk = replace(problem, motion=replace(problem.motion, robot=replace(problem.motion.robot, max_jerk=None)))
    assert cost == pytest.approx(without_jerk.trajectory(x).duration, rel=0.02)


@pytest.mark.parametrize("name", slow_except(TASKS, ["obstacle"]))
def test_a_candidate_and_the_program_from_it_are_certified_and_dense_samples_agree(name: str) -> None:
    problem = problem_of(name)
    x, refinement = best(problem), Refinement(problem, IPOPT())
    searched, refined = problem.trajectory(x), refinement.motion(refinement(refinement.program.from_search(x)).x)
    assert refined.trajectory.duration < searched.duration
    for trajectory in (searched, refined.trajectory):
        check(problem, trajectory)


def check(problem: TracingProblem, trajectory: Trajectory) -> None:
    """All verdicts hold; limits, ends and distances at 20,000 times, by NumPy alone."""
    assert all(verdict.satisfied for verdict in problem.criteria.verify(trajectory))
    times, robot = np.linspace(0.0, trajectory.duration, 20_000), problem.criteria.robot
    for order, bounds in ((1, robot.limits.speed), (2, robot.limits.acceleration), (3, robot.limits.jerk)):
        if bounds is not None:
            assert (np.abs(trajectory.at(times, order)) <= np.array(bounds) * (1.0 + 1e-9)).all()
    tool, points = robot.skeleton(trajectory.at(times))[:, -1], problem.criteria.task.path.array
    lines = [distance_from_segments(tool, *np.broadcast_arrays(tool, a, b)[1:]) for a, b in pairwise(points)]
    assert np.min(lines, axis=0).max() <= problem.criteria.task.accuracy
    assert np.abs(tool[[0, -1]] - points[[0, -1]]).max() < 1e-9
    assert all(np.hypot(*(tool - point).T).min() <= problem.criteria.task.accuracy for point in points)


def test_the_motion_stops_at_corners() -> None:
    problem = problem_of("three links")
    assert len(problem.knots.corners) == 3
    x = best(problem)
    squared = np.asarray(problem.parameters_of(x).squared).ravel()
    stops = np.array(problem.motion.stops)
    assert (squared[[*stops, *(stops + 1), 0, -1]] == 0.0).all()
    assert (np.delete(squared, [*stops, *(stops + 1), 0, squared.size - 1]) > 0.0).all()


def test_gentle_bends_are_no_corners() -> None:
    turn = np.linspace(0.0, np.pi, 25)
    arc = Path.through(np.column_stack([0.7 + 0.2 * np.cos(turn), 0.2 * np.sin(turn)]))
    assert knots_of(arc, 0.01, 1.2).corners == ()
    assert knots_of(arc, 1e-5, 1.2).corners != ()


def test_what_cannot_be_traced_is_named() -> None:
    with pytest.raises(InvalidProblem, match="out of reach"):
        PathTracing(ARM, Path.through([[0.5, 0.0], [1.3, 0.0]]), 0.01)
    with pytest.raises(InvalidProblem, match="redundancy_values"):
        tracing(TASKS["three links"], redundancy_values=1)
