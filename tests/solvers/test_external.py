"""Libraries that call a cost function, as generators that receive costs; and what external solvers leave behind.

The adapters of nevergrad and mealpy in short: what test_solvers.py shows at length when slow tests run.
"""

from __future__ import annotations

import logging
import random
import subprocess
import sys
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from helpers.named_solvers import LIBRARIES_OF_MANY, WITHOUT_CHANCE, named_solver

from solvers import EXTERNAL, Budget, Result, SearchBox, StopReason, minimize
from solvers.external.callbacks import LARGEST_COST, Cost, callback_to_generator


def three_calls(cost: Cost) -> None:
    for number in range(3):
        assert cost(np.full((2, 1), float(number))).tolist() == [number, number]


def endless(cost: Cost) -> None:
    while True:
        cost(np.zeros((1, 1)))


def counted(turns: list[int]) -> Iterator[float]:
    while True:
        turns.append(1)
        yield 0.5


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


# The libraries

BOX = SearchBox(np.array([-3.0, 1.0, 2.0]), np.array([4.0, 1.0, 6.0]))  # flat in one coordinate
CENTRE = np.array([0.5, 1.0, 3.0])
CHOICES: dict[str, list[dict[str, str]]] = {
    "nevergrad": [{"optimizer": "CMA"}, {"optimizer": "RecombiningPortfolioDiscreteOnePlusOne"}],
    "mealpy": [{"algorithm": "SHADE.L_SHADE"}],
    "minion": [{"algorithm": "jSO"}, {"algorithm": "CMAES"}],
    "pygmo": [{"algorithm": "de1220"}, {"algorithm": "cmaes"}, {"algorithm": "gaco"}],
    "pymoo": [{"algorithm": "nsga2"}],
}


def sphere(x: np.ndarray) -> np.ndarray:
    return ((x - CENTRE) ** 2).sum(axis=1)


def search(name: str, seed: int = 1, evaluations: int = 150, **settings: Any) -> Result:
    return minimize(sphere, BOX, named_solver(name)(**settings), Budget(evaluations), seed)


@pytest.mark.parametrize("algorithm", ["ARRDE", "CMAES", "RCMAES", "BIPOP_aCMAES"])
def test_minion_begins_with_known_candidates_whatever_the_algorithm(algorithm: str) -> None:
    seen: list[np.ndarray] = []

    def recorded(x: np.ndarray) -> np.ndarray:
        seen.append(x.copy())
        return sphere(x)

    known = np.array([[1.0, 1.0, 4.0], [2.0, 1.0, 5.0]])
    minimize(recorded, BOX, named_solver("minion")(algorithm=algorithm), Budget(60), 1, known=known)
    assert np.concatenate(seen)[:2] == pytest.approx(known, abs=1e-12)


@pytest.mark.parametrize("name", LIBRARIES_OF_MANY)
def test_known_candidates_come_first_and_holes_count_as_worst(name: str) -> None:
    seen: list[np.ndarray] = []

    def holes(x: np.ndarray) -> np.ndarray:
        seen.append(x.copy())
        assert ((x >= BOX.lower) & (x <= BOX.upper)).all()
        return np.where(x[:, 0] < 0.0, np.nan, sphere(x))

    known = np.array([[1.0, 1.0, 4.0], [2.0, 1.0, 5.0]])
    result = minimize(holes, BOX, named_solver(name)(), Budget(500), 1, known=known)
    assert np.concatenate(seen)[:2] == pytest.approx(known, abs=1e-12)
    assert (result.evaluations, result.stop_reason) == (500, StopReason.EVALUATIONS)
    assert result.cost < 0.3 < sphere(known).min()


@pytest.mark.parametrize(
    ("name", "settings"), [(name, choice) for name in EXTERNAL for choice in [{}, *CHOICES.get(name, [])]]
)
def test_same_seed_same_result_and_nothing_global_is_left_changed(
    name: str, settings: dict[str, str], capfd: pytest.CaptureFixture[str]
) -> None:
    named_solver(name)  # imports the library
    handlers = logging.getLogger().handlers[:]
    random.seed(7)
    np.random.seed(7)  # noqa: NPY002 (this is about it)
    first = search(name, **settings)
    assert random.random() == random.Random(7).random()
    assert np.random.random() == np.random.RandomState(7).random()  # noqa: NPY002
    again, other = search(name, **settings), search(name, seed=2, **settings)
    assert first.history.cost.tolist() == again.history.cost.tolist()
    assert first.x.tolist() == again.x.tolist()
    assert (first.x.tolist() != other.x.tolist()) == (name not in WITHOUT_CHANCE)
    assert logging.getLogger().handlers == handlers
    assert capfd.readouterr() == ("", "")


def test_an_optimizer_that_works_alone() -> None:
    result = search("nevergrad", optimizer="OnePlusOne", population=1, evaluations=100)
    assert result.iterations == 99
    assert result.cost < 1.0


@pytest.mark.process
def test_importing_a_library_leaves_the_global_generators_alone() -> None:
    pytest.importorskip("nevergrad")
    program = (
        "import random, numpy as np\n"
        "before = random.getstate(), str(np.random.get_state())\n"
        "import solvers.external.nevergrad_solvers\n"
        "assert before == (random.getstate(), str(np.random.get_state()))\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True)
