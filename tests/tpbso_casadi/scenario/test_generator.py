"""Random scenarios: the same ones for the same seed, and each of them can be solved."""

from __future__ import annotations

import numpy as np
import pytest

from solvers import SOLVERS
from tpbso_casadi import parse_scenario
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario.cases import random_scenario, random_scenarios

SOME = random_scenarios(11, 12)


def test_the_same_seed_gives_the_same_scenarios() -> None:
    assert random_scenarios(11, 5) == SOME[:5]
    assert random_scenarios(12, 5) != SOME[:5]
    rng = np.random.default_rng(11)
    assert random_scenario(rng) == SOME[0]


def test_they_are_of_many_kinds() -> None:
    many = random_scenarios(3, 40)
    assert {scenario.task.kind for scenario in many} == {"point-to-point", "path"}
    assert {scenario.task.objective for scenario in many} == {"time", "rotation", "length"}
    assert {scenario.model.formulation for scenario in many} == {"paper", "reduced"}
    assert {len(scenario.arm.link_lengths) for scenario in many} >= {2, 3, 4, 5, 6}
    assert any(scenario.obstacles for scenario in many)


@pytest.mark.parametrize(
    "number", [n if n % 3 == 0 else pytest.param(n, marks=pytest.mark.slow) for n in range(len(SOME))]
)
def test_each_can_be_solved(number: int) -> None:
    content = SOME[number].model_dump()
    content["solver"] |= {"name": "abso", "evaluations": 6000}
    assert plan(parse_scenario(content)).feasible


@pytest.mark.parametrize("solver", SOLVERS)
def test_every_solver_takes_them(solver: str) -> None:
    content = SOME[0].model_dump()
    content["solver"] |= {"name": solver, "evaluations": 300}
    assert plan(parse_scenario(content)).search.evaluations == 300
