"""Searches of problems of the suite: the same each time, and those for a front."""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import pytest
from helpers.evaluation import needs_compiler

import tpbso_casadi as tp
from tpbso_casadi.judging.grid import parse_solvers, suite_grid
from tpbso_casadi.judging.searches import search_front, suite_text
from tpbso_casadi.suite import Recording

pytestmark = needs_compiler


def test_the_same_search_wherever_it_is_done() -> None:
    [one, *_] = suite_grid([tp.suite()["spline-2@1"]], parse_solvers("ga"), 1, 10)
    first, second = suite_text(one.statement), suite_text(one.statement)
    cut = first.index('"seconds"'), second.index('"seconds"')
    assert first[: cut[0]] == second[: cut[1]]
    assert one.searched == one.case == "arm-motions-1/spline-2@1"
    assert one.least_infeasible_cost > tp.suite()["spline-2@1"].feasible_merit
    assert one.box.dimension == 16 and "constraint" in one.found(first).words


@pytest.mark.parametrize("name", ["lshade", "pymoo(algorithm=nsga2)"])
def test_a_search_for_a_front_finds_one(name: str) -> None:
    """Both ends, and more than the straight line between them; the same each time."""
    if "pymoo" in name:
        pytest.importorskip("pymoo")
    problem = tp.suite()["time-energy-3@1"]
    [spec] = suite_grid([problem], parse_solvers(name), 1, 100)
    first, again = (json.loads(suite_text(spec.statement)) for _ in range(2))
    assert first["evaluations"] == 100 * problem.dimension and first["feasible"]
    assert first["improvements"] == again["improvements"] and first["cost"] == first["improvements"]["cost"][-1]
    assert 0.0 < first["cost"] < 0.9
    assert spec.found(json.dumps(first)).words == "keeps all constraints"
    assert spec.least_infeasible_cost > 2.0


@dataclass(frozen=True)
class Dividing(tp.Solver):
    """Takes several costs, and yields a NaN, at once or later."""

    good: int = 0

    @property
    def takes_several_costs(self) -> bool:
        return True

    def search(self, box: tp.SearchBox, rng: np.random.Generator, iterations: tp.Iterations) -> tp.Search:
        for _ in range(self.good):
            yield box.sample(rng, 3)
        yield np.full((3, box.dimension), np.nan)


@pytest.mark.parametrize("good", [0, 2])
def test_a_search_for_a_front_refuses_candidates_that_are_no_numbers(good: int) -> None:
    recording = Recording(tp.suite()["time-energy-3@1"], "own", 1)
    with pytest.raises(ValueError, match="Dividing yielded nan for variable 0 of candidate 0"):
        search_front(recording, Dividing(good), 100, 1)
    assert recording.done == 3 * good
