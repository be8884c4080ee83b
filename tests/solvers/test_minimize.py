"""The front of the driver: functions, bounds, solvers and budgets as users have them, and what each error says."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from helpers.named_solvers import PARAMETERS, named_solver

import tpbso_casadi as tp
from solvers import Budget, SearchBox
from solvers import minimize as drive

BOUNDS = [(-5.0, 5.0), (0.0, 3.0), (-2.0, 1.0)]
BOX = SearchBox(*np.array(BOUNDS).T)
CENTRE = np.array([1.0, 2.0, -1.0])


def of_one(x: np.ndarray) -> float:
    return float(((x - CENTRE) ** 2).sum())


def of_many(x: np.ndarray) -> np.ndarray:
    return np.array([of_one(row) for row in x])


@pytest.mark.parametrize("name", PARAMETERS)
def test_it_is_the_driver_for_every_solver(name: str) -> None:
    named_solver(name)
    expected = drive(of_many, BOX, named_solver(name)(), Budget(80), 3)
    for result in (
        tp.minimize(of_one, BOUNDS, name, 80, 3),
        tp.minimize(of_many, np.array(BOUNDS).T, name, Budget(80), 3, vectorized=True),
    ):
        assert result.x.tolist() == expected.x.tolist()
        assert result.history.cost.tolist() == expected.history.cost.tolist()
        assert (result.evaluations, result.stop_reason) == (80, expected.stop_reason)


@pytest.mark.parametrize(
    "solver",
    ["bso", tp.BSO, tp.BSO(), "solvers.bso:BSO", tp.BSO(c1=9.0)],
    ids=["name", "class", "object", "path", "c1"],
)
def test_a_solver_may_be_stated_in_many_ways(solver: Any) -> None:
    result = tp.minimize(of_one, BOUNDS, solver, 300, c1=1.5)
    assert result.x.tolist() == drive(of_many, BOX, tp.BSO(c1=1.5), Budget(300), 1).x.tolist()


def test_bounds_of_two_variables_are_rows() -> None:
    seen: list[np.ndarray] = []
    tp.minimize(lambda x: seen.append(x) or of_one(np.append(x, 0.0)), [(0, 1), (10, 20)], "pso", 100)
    low, high = np.min(seen, axis=0), np.max(seen, axis=0)
    assert 0.0 <= low[0] < high[0] <= 1.0
    assert 10.0 <= low[1] < high[1] <= 20.0


def test_f_cannot_change_the_search() -> None:
    def spoils(x: np.ndarray) -> float:
        cost = of_one(x)
        x[:] = np.nan
        return cost

    assert tp.minimize(spoils, BOUNDS, "pso", 200).x.tolist() == tp.minimize(of_one, BOUNDS, "pso", 200).x.tolist()


def test_a_result_in_one_line() -> None:
    result = tp.minimize(of_one, BOUNDS, "pso", Budget(400, target=0.5), 7)
    shown = repr(result)
    assert re.fullmatch(
        r"Result\(cost=0\.\d+, x=\[[-\d., e]+\], evaluations=\d+, iterations=\d+, seconds=[\d.e-]+, seed=7, "
        r"stop_reason='target'\)",
        shown,
    )
    wide = tp.minimize(lambda x: float(x @ x), [(-1, 1)] * 40, "pso", 100)
    assert "... 40 numbers]" in repr(wide)
    assert len(repr(wide)) < 250


class NoSolver:
    """Not derived from Solver."""


BAD: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({"bounds": [(1.0, 0.0)] * 3}, ValueError, "bounds: variable 0 from 1 to 0 is swapped; say (low, high)"),
    ({"bounds": [(0, 1, 2)]}, ValueError, "bounds: of shape (1, 3); say one (low, high) a variable"),
    ({"bounds": [(0, 1), (2,)]}, ValueError, "bounds: one (low, high) a variable is needed, not [(0, 1), (2,)]"),
    ({"bounds": np.zeros((2, 0))}, ValueError, "bounds: there is no variable; finite numbers are needed"),
    ({"solver": "bos"}, ValueError, "solver: no solver 'bos'; did you mean 'bso'?"),
    ({"solver": "ipopt"}, ValueError, "solver: ipopt needs the derivatives of a program"),
    ({"solver": "no_such_package:Thing"}, ValueError, "solver: 'no_such_package:Thing' cannot be loaded: No module"),
    ({"solver": NoSolver}, TypeError, "is not a name, a class derived from solvers.Solver, or one's object"),
    ({"solver": "bso", "c9": 1.0}, TypeError, "BSO has no setting 'c9'; did you mean 'c'?"),
    ({"solver": "bso", "eta": 2.0}, ValueError, "eta = 2.0 is not in (0, 1]"),
    ({"seeed": 3}, TypeError, "AdaptiveBeetleSwarm has no setting 'seeed'"),
    ({"budget": 0}, ValueError, "a budget of 0 evaluations is not positive"),
    ({"budget": 1e4}, TypeError, "budget: a number of evaluations or a Budget is needed, not 10000.0"),
    ({"budget": 10, "seed": -1}, ValueError, "seed: a whole number >= 0 or a numpy Generator is needed, not -1"),
    ({"seed": 1.5}, TypeError, "seed: a whole number >= 0 or a numpy Generator is needed, not 1.5"),
    ({"seed": None}, TypeError, "seed: None gives another result every time; say a whole number"),
    ({"callback": 3}, TypeError, "callback: a function is needed, not 3"),
    ({"solver": "bso", "population": "3"}, TypeError, "BSO needs a whole number for its population, not '3'"),
    ({"bounds": [(-1e308, 1e308)]}, ValueError, "bounds: variable 0 from -1e+308 to 1e+308 is wider than"),
    ({"known": "abc"}, ValueError, "known: candidates (m, 3) are needed, not 'abc'"),
    ({"known": [[1.0, 2.0]]}, ValueError, "known candidates of shape (1, 2) where finite (m, 3) are needed"),
    ({"f": 3.0}, TypeError, "f: a function is needed, not 3.0"),
    ({"f": lambda x: x}, ValueError, "f returned shape (3,) for one vector (3,); a function of a whole"),
    ({"f": lambda x: [[1], [1, 2]]}, ValueError, "f returned [[1], [1, 2]]: rows of different lengths"),
    ({"f": lambda x: 1j}, ValueError, "f returned 1j where real numbers are needed"),
    ({"f": lambda x: None}, ValueError, "f returned None where real numbers are needed"),
    ({"f": lambda x: x.sum(), "vectorized": True}, ValueError, "f returned shape () for 58 candidates (58, 3); with"),
]


def test_errors_in_one_line() -> None:
    for arguments, error, reason in BAD:
        with pytest.raises(error) as caught:
            tp.minimize(**({"f": of_one, "bounds": BOUNDS} | arguments))
        assert reason in str(caught.value)
        assert "\n" not in str(caught.value)


def test_a_library_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("solvers.standalone.find_spec", lambda name: None)
    with pytest.raises(ValueError, match=r"cma needs the package cma: pip install 'tpbso-casadi\[cma\]'"):
        tp.minimize(of_one, BOUNDS, "cma")


def test_cma_searches_one_variable() -> None:
    pytest.importorskip("cma")
    for seed in range(1, 4):
        result = tp.minimize(lambda x: float((x[0] - 1.0) ** 2), [(-5, 5)], "cma", 150, seed)
        assert (result.evaluations, result.x[0]) == (150, pytest.approx(1.0, abs=1e-2))
