"""The cost of a candidate and its parts: one program gives both, with the same bits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.cases import builtin

from problems import Ellipse, Joints, Move, PlanarArm, Problem, move, time_move
from problems.evaluation import EvaluationOptions, PopulationFunction
from problems.families.via_times import via_times

ARM = PlanarArm((0.5, 0.4, 0.3), (3.0,) * 3, (15.0,) * 3)
MOVE = Move(
    robot=ARM,
    start=Joints((0.2, 0.9, 0.3)),
    goals=(Joints((2.2, -0.4, 0.2)),),
    obstacles=(Ellipse((0.1, 0.75), (0.15, 0.1)),),
)
PASSING = replace(MOVE, vias=(Joints((1.0, 0.1, 0.6)),))
CASES: dict[str, Any] = {
    "paper": lambda: builtin("obstacle-3"),
    "reduced": lambda: builtin("obstacle-3", "reduced"),
    "path": lambda: builtin("pentagram-rotation", "reduced"),
    "spline": lambda: move(MOVE),
    "time-spline": lambda: time_move(MOVE),
    "via times": lambda: via_times(PASSING),
    "paper's via times": lambda: via_times(PASSING, formulation="paper"),
}


@pytest.mark.parametrize("name", CASES)
def test_the_parts_make_the_cost(name: str) -> None:
    problem: Problem[Any] = CASES[name]()
    program, names = problem.parts_program()
    candidates = np.random.default_rng(0).uniform(*problem.bounds, (300, len(problem.variables)))
    options = EvaluationOptions("vm")
    cost, objective, *penalties = PopulationFunction(program, options)(candidates).T
    assert np.array_equal(cost, problem.evaluator(options)(candidates))
    assert len(penalties) == len(names) and len(set(names)) == len(names)
    feasible = (np.array(penalties) == 0.0).all(axis=0)
    assert np.array_equal(feasible, cost <= problem.objective_upper_bound)
    assert np.array_equal(cost[feasible], objective[feasible])
    if "paper" not in name:
        excess = np.zeros(len(cost))
        for penalty in penalties:
            excess = excess + penalty
        np.testing.assert_allclose(cost[~feasible], problem.objective_upper_bound + excess[~feasible], rtol=1e-12)


def test_the_paper_names_its_constraints() -> None:
    _, names = builtin("obstacle-3").parts_program()
    assert names == ("speed", "acceleration", "clearance", "swept clearance", "reach")
