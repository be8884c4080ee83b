"""Libraries that call a cost function, as generators that receive costs; and what external solvers leave behind."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import numpy as np
import pytest
from helpers.named_solvers import named_solver

from solvers import EXTERNAL, Box, Budget, minimize
from solvers.external.callbacks import LARGEST_COST, Cost, callback_to_generator


def three_calls(cost: Cost) -> None:
    for number in range(3):
        assert cost(np.full((2, 1), float(number))).tolist() == [number, number]


def test_calls_become_requests_in_order() -> None:
    search = callback_to_generator(three_calls, iter([0.0] * 9))
    candidates = next(search)
    for number in range(2):
        assert candidates.tolist() == [[number], [number]]
        candidates = search.send(candidates.ravel())
    with pytest.raises(StopIteration):
        search.send(candidates.ravel())


def test_infinite_costs_are_made_finite() -> None:
    costs = []
    search = callback_to_generator(lambda cost: costs.append(cost(np.zeros((1, 1)))), iter([]))
    next(search)
    with pytest.raises(StopIteration):
        search.send(np.array([np.inf]))
    assert costs[0].tolist() == [LARGEST_COST]


def test_errors_of_the_library_come_through() -> None:
    def broken(cost: Cost) -> None:
        cost(np.zeros((1, 1)))
        raise ArithmeticError("no convergence")

    search = callback_to_generator(broken, iter([0.0]))
    next(search)
    with pytest.raises(ArithmeticError, match="no convergence"):
        search.send(np.zeros(1))


def endless(cost: Cost) -> None:
    while True:
        cost(np.zeros((1, 1)))


def counted(turns: list[int]) -> Iterator[float]:
    while True:
        turns.append(1)
        yield 0.5


@pytest.mark.parametrize(("every", "calls", "iterations"), [(1, 5, 4), (3, 8, 3)])
def test_so_many_calls_are_an_iteration(every: int, calls: int, iterations: int) -> None:
    turns: list[int] = []
    search = callback_to_generator(endless, counted(turns), every)
    next(search)
    for _ in range(calls - 1):
        search.send(np.zeros(1))
    search.close()
    assert len(turns) == iterations


def test_a_closed_search_leaves_no_thread() -> None:
    before = threading.active_count()
    search = callback_to_generator(endless, iter([0.0]))
    next(search)
    assert threading.active_count() == before + 1
    search.close()
    assert threading.active_count() == before


@pytest.mark.parametrize("name", EXTERNAL)
def test_the_global_generator_is_left_alone(name: str) -> None:
    solver = named_solver(name)()
    box = Box(np.zeros(4), np.ones(4))
    np.random.seed(7)  # noqa: NPY002 (this is about it)
    expected = np.random.RandomState(7).random()
    minimize(lambda x: (x**2).sum(axis=1), box, solver, Budget(500), 1)
    assert np.random.random() == expected  # noqa: NPY002
