"""Solvers of a user's own that are none, and what is kept where something raises."""

from __future__ import annotations

import pickle
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from helpers.descents import solution_at
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import tpbso_casadi as tp
from solvers import (
    Budget,
    Iterations,
    Search,
    SearchBox,
    Solver,
    Status,
    StopReason,
    best_so_far,
    checked_candidates,
    keep_best,
    minimize,
)
from solvers import descend as descend_from
from solvers.ipopt import Stop

BOX = SearchBox(np.array([-1.0, 0.0, 2.0]), np.array([1.0, 0.5, 3.0]))
BOUNDS = [(-1.0, 1.0), (0.0, 0.5), (2.0, 3.0)]


def sphere(x: np.ndarray) -> np.ndarray:
    return np.asarray((x**2).sum(axis=1))


@dataclass(frozen=True)
class Says(Solver):
    """Yields two good batches before another one, or that at once."""

    then: Any = None
    at_once: bool = False

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        if not self.at_once:
            yield box.sample(rng, 4)
            for _ in iterations:
                yield box.sample(rng, 4)
                break
        yield self.then
        while True:
            yield box.sample(rng, 4)


GOOD = np.array([[0.5, 0.1, 2.5], [0.0, 0.5, 3.0]])


def changed(row: int, column: int, value: float) -> np.ndarray:
    candidates = GOOD.copy()
    candidates[row, column] = value
    return candidates


NEEDED = "an array of numbers (m, 3) is needed"
BAD: dict[str, tuple[Any, type[Exception], str]] = {
    "nothing": (None, TypeError, f"Says yielded an object of type NoneType; {NEEDED}"),
    "a list": (GOOD.tolist(), TypeError, f"Says yielded an object of type list; {NEEDED}"),
    "words": (GOOD.astype(str), TypeError, f"Says yielded an array of type <U32; {NEEDED}"),
    "complex numbers": (GOOD + 0j, TypeError, f"Says yielded an array of type complex128; {NEEDED}"),
    "one candidate": (GOOD[0], ValueError, f"Says yielded an array of shape (3,); {NEEDED}"),
    "a column too few": (GOOD[:, :2], ValueError, f"Says yielded an array of shape (2, 2); {NEEDED}"),
    "no candidate": (GOOD[:0], ValueError, f"Says yielded no candidate; {NEEDED}, m > 0"),
    "NaN": (changed(1, 0, np.nan), ValueError, "Says yielded nan for variable 0 of candidate 1; finite numbers are"),
    "infinity": (changed(0, 2, -np.inf), ValueError, "Says yielded -inf for variable 2 of candidate 0; finite"),
    "outside": (
        changed(0, 1, np.nextafter(0.5, 1.0)),
        ValueError,
        "Says left its box: variable 1 of candidate 0 is 0.5000000000000001, not from 0.0 to 0.5",
    ),
}
each_bad = pytest.mark.parametrize(("yielded", "kind", "reason"), BAD.values(), ids=BAD)


@each_bad
@pytest.mark.parametrize("vectorized", [False, True])
def test_candidates_that_are_none(yielded: Any, kind: type[Exception], reason: str, vectorized: bool) -> None:
    cost = sphere if vectorized else lambda x: float(x @ x)
    with pytest.raises(kind, match=re.escape(reason)) as caught:
        tp.minimize(cost, BOUNDS, Says(yielded, at_once=True), 100, vectorized=vectorized)
    assert "\n" not in str(caught.value)
    assert best_so_far(caught.value, tp.Result) is None
    with pytest.raises(kind, match=re.escape(reason)) as caught:
        tp.minimize(cost, BOUNDS, Says(yielded), 100, vectorized=vectorized)
    result = best_so_far(caught.value, tp.Result)
    assert result is not None
    assert (result.evaluations, result.stop_reason, result.cost) == (8, StopReason.ERROR, sphere(result.x[None])[0])
    assert result.history.evaluations.tolist() == [4, 8]


@each_bad
def test_ask_and_tell_end_with_the_best_that_was_told(yielded: Any, kind: type[Exception], reason: str) -> None:
    with pytest.raises(kind, match=re.escape(reason)):
        tp.AskTell(Says(yielded, at_once=True), BOUNDS)
    search = tp.AskTell(Says(yielded), BOUNDS, budget=100)
    candidates = search.ask()
    search.tell(candidates, sphere(candidates))
    candidates = search.ask()
    with pytest.raises(kind, match=re.escape(reason)):
        search.tell(candidates, sphere(candidates))
    assert search.done and search.result.evaluations == 8 and search.stop_reason is StopReason.ERROR


def test_whole_numbers_and_short_ones_are_numbers() -> None:
    whole = np.array([[0, 0, 3], [1, 0, 2]])
    for candidates in (whole, whole.astype(np.float32), whole.astype(np.uint8)):
        found = checked_candidates(candidates, BOX, Says())
        assert (found.dtype, found.tolist()) == (np.float64, whole.tolist())
    assert checked_candidates(GOOD, BOX, Says()) is GOOD


@given(
    arrays.arrays(
        st.sampled_from([np.float64, np.float32, np.int64, np.bool_, np.complex128, np.dtype("U2")]),
        arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
    )
)
def test_whatever_an_array_holds_it_is_candidates_of_the_box_or_one_line(yielded: np.ndarray) -> None:
    try:
        candidates = checked_candidates(yielded, BOX, Says())
    except (TypeError, ValueError) as error:
        assert str(error).startswith("Says ") and "\n" not in str(error)
    else:
        assert candidates.ndim == 2 and candidates.shape[1] == 3 and len(candidates)
        assert (BOX.clip(candidates) == candidates).all()


# Classes that are no solvers


class Plain(Solver):
    """No dataclass."""

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        yield box.sample(rng, 3)


@dataclass(frozen=True)
class Unyielding(Solver):
    """No generator."""

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        return [box.sample(rng, 3)]  # type: ignore[return-value]


@dataclass(frozen=True)
class Idle(Solver):
    """Asks for nothing."""

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        return
        yield


@dataclass(frozen=True)
class Alone:
    """Not derived from Solver."""


@dataclass(frozen=True)
class Abstract(Solver):
    """Without a search."""


@pytest.mark.parametrize(
    ("solver", "kind", "reason"),
    [
        (Plain, TypeError, "solver: Plain is no dataclass; put @dataclass(frozen=True) above the class"),
        (f"{__name__}:Plain", TypeError, "solver: Plain is no dataclass"),
        (Unyielding(), TypeError, "Unyielding.search returned an object of type list; it has to yield its candidates"),
        (Idle(), ValueError, "Idle asked for no candidate at all"),
        (Alone, TypeError, "is not a name, a class derived from solvers.Solver, or one's object"),
        (Abstract, TypeError, "Can't instantiate abstract class Abstract"),
    ],
)
def test_classes_that_are_no_solvers(solver: Any, kind: type[Exception], reason: str) -> None:
    for use in (lambda: tp.minimize(lambda x: 0.0, BOUNDS, solver, 50), lambda: tp.AskTell(solver, BOUNDS, budget=50)):
        with pytest.raises(kind, match=re.escape(reason)) as caught:
            use()
        assert "\n" not in str(caught.value)


def test_a_solver_without_a_population() -> None:
    assert tp.minimize(lambda x: float(x @ x), BOUNDS, Says(GOOD), 6).evaluations == 6
    with pytest.raises(TypeError, match="Says has no setting 'population'"):
        tp.minimize(lambda x: 0.0, BOUNDS, Says, 50, population=3)


# The best so far


RAISED = [RuntimeError, SystemExit, KeyboardInterrupt]


@pytest.mark.parametrize("kind", RAISED)
@pytest.mark.parametrize("solver", ["bso", "scipy-de"])
def test_what_raises_ends_a_search_and_keeps_the_best(kind: type[BaseException], solver: str) -> None:
    """The cost raises in the batch with its 60th candidate; those of all batches before count."""
    error = kind("boom")
    calls: list[float] = []

    def cost(x: np.ndarray) -> np.ndarray:
        if len(calls) + len(x) > 60:
            raise error
        calls.extend(sphere(x).tolist())
        return sphere(x)

    with pytest.raises(kind) as caught:
        minimize(cost, BOX, tp.find_solver(solver)(population=8), Budget(1000), 5)  # type: ignore[call-arg, arg-type]
    assert caught.value is error
    result = best_so_far(error, tp.Result)
    assert result is not None
    assert (result.cost, result.evaluations, result.seed) == (min(calls), len(calls), 5)
    assert (result.history.cost[-1], result.stop_reason) == (result.cost, StopReason.ERROR)
    assert "what was found before is its attribute best_so_far" in error.__notes__


@pytest.mark.parametrize("number", [1, 2, 17, 60])
def test_of_a_function_of_one_vector_every_candidate_counts(number: int) -> None:
    """Those of the population in which it raises, too; 1 is the first of all."""
    costs: list[float] = []

    def f(x: np.ndarray) -> float:
        if len(costs) == number - 1:
            raise RuntimeError("boom")
        costs.append(np.nan if len(costs) == 3 else float(x @ x))
        return costs[-1]

    with pytest.raises(RuntimeError, match="boom") as caught:
        tp.minimize(f, BOUNDS, tp.PSO(population=20), 500)
    result = best_so_far(caught.value, tp.Result)
    if number == 1:
        assert result is None and not hasattr(caught.value, "best_so_far") and not hasattr(caught.value, "__notes__")
    else:
        assert result is not None
        assert result.cost == np.nanmin(costs) == sphere(result.x[None])[0]
        assert (result.evaluations, result.stop_reason) == (number - 1, StopReason.ERROR)
        assert result.history.evaluations.tolist() == [n for n in (20, 40) if n < number - 1] + [number - 1]


def test_a_search_within_a_search_keeps_nothing_for_the_outer_one() -> None:
    def inner(x: np.ndarray) -> float:
        if x[0] > 0.5:
            raise RuntimeError("boom")
        return float(x @ x)

    def outer(x: np.ndarray) -> np.ndarray:
        return np.full(len(x), tp.minimize(inner, BOUNDS, "random", 500).cost)

    with pytest.raises(RuntimeError, match="boom") as caught:
        tp.minimize(inner, BOUNDS, "random", 500)
    assert best_so_far(caught.value, tp.Result) is not None
    with pytest.raises(RuntimeError, match="boom") as caught:
        tp.minimize(outer, BOUNDS, "random", 500, vectorized=True)
    assert best_so_far(caught.value, object) is None


@pytest.mark.parametrize("solver", ["bso", "scipy-de"])
@pytest.mark.parametrize("number", [1, 3])
def test_a_callback_that_raises(solver: str, number: int) -> None:
    seen: list[Status] = []

    def callback(status: Status) -> None:
        seen.append(status)
        if len(seen) == number:
            raise RuntimeError("boom")

    with pytest.raises(RuntimeError, match="boom") as caught:
        tp.minimize(sphere, BOUNDS, solver, 500, vectorized=True, callback=callback)
    result = best_so_far(caught.value, tp.Result)
    assert result is not None and len(seen) == number
    assert (result.evaluations, result.cost) == (seen[-1].evaluations, seen[-1].cost)
    assert result.history.evaluations.tolist() == [status.evaluations for status in seen]


def test_a_kept_result_can_be_pickled_with_its_exception() -> None:
    error = ValueError("boom")
    keep_best(error, tp.minimize(sphere, BOUNDS, "pso", 100, vectorized=True))
    copy = pickle.loads(pickle.dumps(error))
    found, before = best_so_far(copy, tp.Result), best_so_far(error, tp.Result)
    assert found is not None and before is not None and found.x.tolist() == before.x.tolist()


def test_what_is_kept_is_replaced_and_noted_once() -> None:
    error = ValueError("boom")
    for found in (1, "two"):
        keep_best(error, found)
    assert (best_so_far(error, str), best_so_far(error, int), len(error.__notes__)) == ("two", None, 1)


# Nothing yet is no number


@dataclass(frozen=True)
class Late(Solver):
    """Begins to ask within its loop."""

    population: int = 4

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        for _ in iterations:
            yield box.sample(rng, self.population)


def test_a_solver_that_begins_within_its_loop() -> None:
    told: list[int] = []
    result = minimize(sphere, BOX, Late(), Budget(20), 1, lambda status: told.append(status.evaluations))
    assert result.history.evaluations.tolist() == told == [4, 8, 12, 16, 20]
    assert np.isfinite(result.history.best).all()
    assert minimize(sphere, BOX, Late(), Budget(iterations=3), 1).evaluations == 12


def test_where_every_cost_is_nan_the_first_candidate_stays() -> None:
    asked: list[np.ndarray] = []

    def cost(x: np.ndarray) -> np.ndarray:
        asked.append(x.copy())
        return np.full(len(x), np.nan)

    result = minimize(cost, BOX, tp.PSO(population=5), Budget(50), 1)
    assert (result.x == asked[0][0]).all()
    assert np.isinf(result.history.cost).all() and (result.history.best == asked[0][0]).all()


# Descents


def descended(values: list[tuple[float, float]], callback: Callable[[Status], object] | None = None) -> tp.Result:
    found = (solution_at(np.array([x]), objective) for x, objective in values)
    starts = [np.zeros(1)] * len(values)
    budget = Budget(iterations=len(values))
    return descend_from(lambda _: next(found), Stop(1, 0), starts, lambda each: each.objective, budget, None, callback)  # type: ignore[arg-type, return-value]


def test_descents_that_end_at_no_number_count_as_worst() -> None:
    values = [(np.nan, -5.0), (1.0, np.nan), (2.0, 7.0), (np.inf, 1.0), (3.0, -np.inf), (4.0, 6.0)]
    result = descended(values)
    assert (result.x.tolist(), result.cost) == ([4.0], 6.0)
    assert result.history.cost.tolist() == [np.inf, np.inf, 7.0, 7.0, 7.0, 6.0]
    assert descended(values[:2]).cost == np.inf


def test_descents_keep_the_best_too() -> None:
    def callback(status: Status) -> None:
        if status.iterations == 2:
            raise RuntimeError("boom")

    with pytest.raises(RuntimeError, match="boom") as caught:
        descended([(1.0, 3.0), (2.0, 4.0), (3.0, 0.0)], callback)
    result = best_so_far(caught.value, tp.Result)
    assert result is not None
    assert (result.x.tolist(), result.cost, result.iterations, result.stop_reason) == ([1.0], 3.0, 2, StopReason.ERROR)
