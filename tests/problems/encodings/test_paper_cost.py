"""The cost (15) against an independent implementation, and its order: feasible < breaks a limit < unreachable."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.cases import changed, equal_links, moving
from oracles.planar import PointToPointOracle

from problems import Ellipse, PlanarArm, PointToPointProblem
from solvers import PSO, Box, Budget, minimize

OVAL = Ellipse((0.8, 0.8), (0.15, 0.25))
TILTED = Ellipse((-0.4, 0.9), (0.3, 0.1), 0.7)
SLOWER = 1.0 + 1e-9  # the reduced form stands exactly at its limits
START, GOAL = (1.0, 0.0), (0.5, 1.5)


UNEQUAL = PlanarArm((0.3, 0.9, 0.5, 0.4), (4.0, 3.0, 5.0, 6.0), (20.0, 10.0, 30.0, 40.0))
HOLLOW = PlanarArm((1.5, 0.4, 0.3), (4.0,) * 3, (20.0,) * 3)
LIMITED = equal_links(3, joint_limits=((-2.5, 3.0), (-2.0, 2.5), (-1.0, 5.0)))

CASES = {
    "2 links, time": moving(equal_links(2), START, GOAL, "time", "up"),
    "3 links, time": moving(equal_links(3), START, GOAL, "time", "up"),
    "5 links, rotation, free": moving(equal_links(5), START, GOAL, "rotation", "free"),
    "3 links, oval": moving(equal_links(3), START, GOAL, "length", "up", obstacles=(OVAL,)),
    "4 links, two obstacles": moving(equal_links(4), START, GOAL, "length", "down", obstacles=(OVAL, TILTED)),
    "unequal links": moving(UNEQUAL, START, (-0.5, 1.2), "rotation", "free"),
    "inner hole": moving(HOLLOW, (1.2, 0.0), GOAL, "time", "down"),
    "joint limits": moving(LIMITED, START, GOAL, "time", "free"),
}


LONG = {"4 links, two obstacles", "5 links, rotation, free"}


@pytest.fixture(
    params=[pytest.param(case, marks=[pytest.mark.slow] if name in LONG else []) for name, case in CASES.items()],
    ids=CASES,
)
def problem(request: pytest.FixtureRequest) -> PointToPointProblem:
    case = request.param
    assert isinstance(case, PointToPointProblem)
    return case


def candidates(problem: PointToPointProblem) -> np.ndarray:
    """10,000 of them: all over the box, and around the best of a short search, where the feasible ones are."""
    box, rng = Box(*problem.bounds), np.random.default_rng(3)
    best = minimize(problem.cost, box, PSO(), Budget(6000), 3).x
    near = best + 10.0 ** rng.uniform(-4.0, -0.5, (5000, 1)) * rng.normal(size=(5000, box.dimension))
    return np.concatenate([box.sample(rng, 5000), box.clip(near)])


def test_agrees_with_numpy_and_keeps_the_order(problem: PointToPointProblem) -> None:
    points, oracle = candidates(problem), PointToPointOracle(problem)
    costs, expected = problem.cost(points), oracle.cost(points)
    # A limit met within rounding may count on one side only; that is rare and changes the cost by one jump.
    agrees = np.abs(costs - expected) <= 1e-8 * np.abs(expected)
    assert agrees.mean() > 0.999
    kinds = oracle.kinds(points)[agrees]
    feasible, broken, unreachable = (costs[agrees][kinds == kind] for kind in range(3))
    assert feasible.size > 0
    assert broken.size > 0
    assert feasible.max() <= problem.objective_upper_bound < broken.min()
    if problem.robot.links > 2:
        assert unreachable.size > 0
        assert broken.max() < unreachable.min()


def test_reduced_form_evaluates_the_same_motions(problem: PointToPointProblem) -> None:
    """What the reduced form finds feasible costs the same in the paper form, whose vector is rebuilt from it."""
    reduced, paper = changed(problem, formulation="reduced"), problem
    lower, upper = reduced.bounds  # at the very edge of x_phi the arm is time_scaled, and rounding puts it out of reach
    points = np.clip(candidates(reduced)[5000:5600], lower + 1e-6, upper - 1e-6)
    cost = reduced.cost(points)
    feasible = cost <= reduced.objective_upper_bound
    assert feasible.any()
    for x, value in zip(points[feasible][:40], cost[feasible][:40], strict=True):
        q = reduced.quantities(x)
        phi = [np.cumsum(q[name])[2:] for name in ("theta_s", "theta_f")]
        branch = [np.sin(q[name][1]) for name in ("theta_s", "theta_f")] if problem.task.elbow == "free" else []
        vector = [q["theta_m"], q["dtheta_m"] / SLOWER, *phi, branch, q["t1"] * SLOWER, q["t2"] * SLOWER]
        assert paper.cost(np.concatenate(vector)[None])[0] == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize("objective", ["time", "rotation"])
def test_check_values_of_two_links(objective: str) -> None:
    best = {"time": (0.7015, 0.4908), "rotation": (2.4135, 1.637)}[objective]
    for elbow, value in zip(("up", "free"), best, strict=True):
        problem = moving(equal_links(2), START, GOAL, objective, elbow, "reduced")
        result = minimize(problem.cost, Box(*problem.bounds), PSO(), Budget(15_000), 1)
        assert result.cost == pytest.approx(value, rel=0.02)
        assert result.cost > value * (1.0 - 1e-3)
