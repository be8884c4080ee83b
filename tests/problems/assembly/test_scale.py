"""An arm of any size: the same plan up to scaling, and the same verdicts."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.cases import following, moving
from helpers.searching import VM, sampled

from problems import Ellipse, Path, PlanarArm, Problem, pentagram
from problems.base import FloatArray
from solvers import BSO, IPOPT, Budget, Descent, SearchBox, minimize

STAR = pentagram((0.0, 0.0), 0.9, count=21)


def arm(scale: float) -> PlanarArm:
    return PlanarArm((0.7 * scale, 0.6 * scale, 0.7 * scale), (4.0,) * 3, (20.0,) * 3)


def move(scale: float, objective: str, formulation: str) -> Problem[Any]:
    oval = Ellipse((0.8 * scale, 0.8 * scale), (0.15 * scale, 0.25 * scale))
    start, goal = (scale, 0.0), (0.5 * scale, 1.5 * scale)
    return moving(arm(scale), start, goal, objective, "up", formulation, obstacles=(oval,))


def trace(scale: float, objective: str, formulation: str) -> Problem[Any]:
    path = Path(tuple((x * scale, y * scale) for x, y in STAR.points), STAR.corners)
    return following(arm(scale), path, 0.2 * scale, objective, "up", formulation)


CASES = [(move, "length", "paper"), (move, "length", "reduced"), (trace, "rotation", "reduced")]


@cache
def searched(make: Any, objective: str, formulation: str, scale: float = 1.0) -> FloatArray:
    problem = make(scale, objective, formulation)
    return minimize(problem.evaluator(VM), SearchBox(*problem.bounds), BSO(), Budget(400), 1).x


@pytest.mark.parametrize(("make", "objective", "formulation"), CASES)
@pytest.mark.parametrize("exponent", [-30, 23])
def test_a_power_of_two_changes_no_bit_of_a_search(make: Any, objective: str, formulation: str, exponent: int) -> None:
    other = searched(make, objective, formulation, 2.0**exponent)
    assert (other == searched(make, objective, formulation)).all()


@pytest.mark.parametrize("scale", [1e-9, 1e7])
@pytest.mark.parametrize("make", [move, trace])
def test_verdicts_do_not_depend_on_the_size(make: Any, scale: float) -> None:
    one, other = make(1.0, "length", "reduced"), make(scale, "length", "reduced")
    for x in sampled(one, 6, 2):
        verdicts, again = (problem.criteria.verify(problem.trajectory(x)) for problem in (one, other))
        assert [(v.name, v.status) for v in verdicts] == [(v.name, v.status) for v in again]
        values = [problem.criteria.objective_value(problem.trajectory(x), np.array([0.0])) for problem in (one, other)]
        assert values[1] == pytest.approx(scale * values[0], rel=1e-9)


@cache
def descended(make: Any, objective: str, scale: float = 1.0) -> float:
    """The objective of the optimum, at which all is kept that a descent alone keeps."""
    problem = make(scale, objective, "paper")
    program = problem.nlp()
    solution = Descent(program, IPOPT())(next(program.starts(np.random.default_rng(3))))
    motion = program.trajectory(solution.x)
    assert {v.name for v in problem.criteria.verify(motion) if not v.satisfied} <= {"clearance"}
    return float(problem.criteria.objective_value(motion, np.array([0.0])))


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-9, 1e7])
def test_ipopt_plans_for_any_size(scale: float) -> None:
    for make, objective in ((move, "length"), (trace, "rotation")):
        unit = scale if objective == "length" else 1.0
        assert descended(make, objective, scale) == pytest.approx(unit * descended(make, objective), rel=1e-3)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e7])
def test_a_miss_of_a_part_of_the_reach_is_seen(scale: float) -> None:
    problem = moving(arm(scale), (scale, 0.0), (0.5 * scale, 1.5 * scale), "time", "up", "reduced")
    motion = problem.trajectory(np.mean(problem.bounds, axis=0))
    assert all(v.satisfied for v in problem.criteria.verify(motion))
    for miss in (0.1, 1e-6):
        beside = moving(arm(scale), (scale * (1.0 + miss), 0.0), (0.5 * scale, 1.5 * scale), "time", "up", "reduced")
        assert [v.name for v in beside.criteria.verify(motion) if not v.satisfied] == ["start"]
