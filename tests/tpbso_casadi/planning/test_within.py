"""Starts that know the structure find the best known plans at once; within a time they take turns with a search."""

from __future__ import annotations

import time
from itertools import count, islice

import numpy as np
import pytest
from helpers.space_scenarios import space_scenario

from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.planning import SearchedMotion, plan
from tpbso_casadi.planning.branches import STRUCTURED, by_turns


@pytest.mark.parametrize(
    ("case", "starts", "best"),
    [
        ("time-3", 1, 0.4618),
        ("time-4", 1, 0.3737),
        ("time-5", 1, 0.3220),
        ("rotation-4", 1, 1.6284),
        ("rotation-5", 1, 1.4322),
        ("pentagram-rotation", 1, 12.1405),
        ("closed-curve-rotation", 1, 17.5680),
        ("pentagram-time", 8, 0.5465),
        ("closed-curve-time", 8, 0.7397),
    ],
)
def test_ipopt_finds_the_best_known_from_few_starts(case: str, starts: int, best: float) -> None:
    content = builtin(case).model_dump()
    content["solver"] |= {"name": "ipopt", "iterations": starts}
    found = plan(parse_scenario(content))
    assert found.feasible
    assert found.objective <= best * (1.0 + 1e-3)


@pytest.mark.parametrize(("case", "best"), [("time-2", 0.4909), ("time-4", 0.3449), ("rotation-5", 1.2751)])
def test_elbows_that_are_free_are_tried_both_ways(case: str, best: float) -> None:
    content = builtin(case).model_dump()
    content["task"]["elbow"] = "free"
    content["solver"] |= {"name": "ipopt", "iterations": 2}
    assert plan(parse_scenario(content)).objective <= best * (1.0 + 1e-3)


def test_candidates_and_starts_take_turns() -> None:
    structured = (np.array([float(i)]) for i in count())
    taken = list(islice(by_turns(structured, [np.array([-1.0]), np.array([-2.0])]), 100))
    first = [float(i) for i in range(STRUCTURED)]
    assert [float(x[0]) for x in taken] == [-1.0, *first, -2.0, *(STRUCTURED + i for i in first)]


def test_seconds_are_kept() -> None:
    content = builtin("rotation-4").model_dump()
    content["solver"] |= {"name": "abso", "within": 1.5, "evaluations": 2000}
    began = time.process_time()
    found = plan(parse_scenario(content))
    assert time.process_time() - began < 4.0  # a busy machine gives less time, not more
    assert found.feasible
    assert found.polish is not None
    assert found.objective <= found.polish.before.objective


@pytest.mark.parametrize("asked", [{"within": 0.5}, {"polish_starts": 2}])
def test_in_space_sequential_programs_refine_and_no_descent(asked: dict[str, float]) -> None:
    goal = {"goal": {"joints": [1.2, 0.3, 1.0]}}
    found = plan(parse_scenario(space_scenario(task=goal, solver={"evaluations": 600} | asked)))
    assert isinstance(found, SearchedMotion)
    assert found.feasible
    assert found.polish is None
    assert found.retiming is not None
    assert found.objective <= found.retiming.before.merit
