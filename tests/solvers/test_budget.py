"""The rules of a budget, alone and through both drivers."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count, repeat
from typing import Any

import numpy as np
import pytest
from helpers.descents import solution_at

from solvers import IPOPT, Budget, Iterations, Result, Search, SearchBox, Solution, Solver, Status, StopReason, Usage
from solvers import descend as descend_from
from solvers import minimize as minimize_over
from solvers.ipopt import Stop

USAGE = Usage(evaluations=60, requested=60, iterations=3, seconds=2.0, cost=0.5, unimproved=1, interrupted=False)
Cost = Callable[[int], float]


CRITERIA: list[tuple[Budget, dict[str, Any], StopReason | None]] = [
    (Budget(60), {}, None),
    (Budget(60), {"requested": 61}, StopReason.EVALUATIONS),
    (Budget(iterations=4), {}, None),
    (Budget(iterations=3), {}, StopReason.ITERATIONS),
    (Budget(seconds=2.1), {}, None),
    (Budget(seconds=2.0), {}, StopReason.SECONDS),
    (Budget(90, target=0.4), {}, None),
    (Budget(90, target=0.5), {}, StopReason.TARGET),
    (Budget(90, stagnation=2), {}, None),
    (Budget(90, stagnation=1), {}, StopReason.STAGNATION),
    (Budget(90), {"interrupted": True}, StopReason.INTERRUPTED),
    (Budget(10, 1, 1.0, 1.0, 1), {"interrupted": True}, StopReason.INTERRUPTED),
    (Budget(10, 1, 1.0, 1.0, 1), {}, StopReason.TARGET),
    (Budget(10, 1, 1.0, 0.1, 1), {}, StopReason.EVALUATIONS),
]
SHARES = [
    (Budget(600), 0.1),
    (Budget(600, 6), 0.5),
    (Budget(600, seconds=2.0), 0.1),  # the clock does not count beside a repeatable limit
    (Budget(seconds=8.0), 0.25),
    (Budget(30), 1.0),
]


def test_criteria_and_the_share_used() -> None:
    for budget, change, reason in CRITERIA:
        assert budget.reached(replace(USAGE, **change)) is reason, (budget, change)
    for budget, share in SHARES:
        assert budget.share_used(USAGE) == pytest.approx(share), budget


def test_iterations_know_the_budget() -> None:
    assert Iterations([]).evaluations is None
    iterations = Iterations([0.0, 0.5], evaluations=70)
    assert (iterations.evaluations, list(iterations)) == (70, [0.0, 0.5])


@dataclass(frozen=True)
class OneByOne(Solver):
    """One candidate an iteration; notes the budget it is told."""

    population: int = 2
    budgets: tuple[list[int | None], ...] = ()

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        for budgets in self.budgets:
            budgets.append(iterations.evaluations)
        yield box.sample(rng, 1)
        for _ in iterations:
            yield box.sample(rng, 1)


def test_the_driver_tells_the_solver_its_budget() -> None:
    for budget in (Budget(40), Budget(40, 3), Budget(iterations=3), Budget(seconds=0.01)):
        told: list[int | None] = []
        minimize_over(lambda x: x[:, 0], SearchBox(np.zeros(1), np.ones(1)), OneByOne(budgets=(told,)), budget, 1)
        assert told == [budget.evaluations]


def minimize(cost: Cost, budget: Budget, callback: Callable[[Status], object] | None = None) -> Result:
    """The metaheuristics' driver; ``cost`` of the number of the evaluation, from 1."""
    numbers = count(1)
    box = SearchBox(np.zeros(1), np.ones(1))
    return minimize_over(lambda x: np.array([cost(next(numbers)) for _ in x]), box, OneByOne(), budget, 1, callback)


def descend(cost: Cost, budget: Budget, callback: Callable[[Status], object] | None = None) -> Result:
    """The driver of descents, each of which takes one evaluation."""
    numbers = count(1)

    def solve(start: np.ndarray) -> Solution:
        return solution_at(start, cost(next(numbers)))

    starts = repeat(np.zeros(1))
    return descend_from(solve, Stop(1, 0), starts, lambda solution: solution.objective, budget, callback=callback)


def interrupts_at_third(number: int) -> float:
    if number == 3:
        os.kill(os.getpid(), signal.SIGINT)
    return -float(number)


DRIVERS = pytest.mark.parametrize("driver", [minimize, descend])


@DRIVERS
@pytest.mark.parametrize(
    ("cost", "budget", "reason", "evaluations"),
    [
        (lambda number: -number, Budget(7), StopReason.EVALUATIONS, 7),
        (lambda number: -number, Budget(100, target=-5.0), StopReason.TARGET, 5),
        (lambda number: max(-number, -3), Budget(100, stagnation=4), StopReason.STAGNATION, 7),
        pytest.param(interrupts_at_third, Budget(100), StopReason.INTERRUPTED, 3, marks=pytest.mark.process),
    ],
)
def test_both_drivers_stop_at_the_same_evaluation(
    driver: Callable[..., Result], cost: Cost, budget: Budget, reason: StopReason, evaluations: int
) -> None:
    result = driver(cost, budget)
    assert (result.stop_reason, result.evaluations) == (reason, evaluations)
    assert result.history.evaluations.tolist() == list(range(1, evaluations + 1))


@DRIVERS
def test_both_drivers_report_the_same_progress_and_count_iterations_and_seconds(driver: Callable[..., Result]) -> None:
    statuses: list[Status] = []
    driver(lambda number: -number, Budget(8, seconds=1e6), statuses.append)
    assert [status.progress for status in statuses] == [number / 8 for number in range(1, 9)]
    result = driver(lambda number: -number, Budget(iterations=6))
    assert (result.stop_reason, result.iterations) == (StopReason.ITERATIONS, 6)
    assert driver(lambda number: -number, Budget(seconds=0.02)).stop_reason is StopReason.SECONDS


def test_steps_of_a_history() -> None:
    swarm, descents = (driver(lambda number: -number, Budget(iterations=2)) for driver in (minimize, descend))
    assert (swarm.history.steps.name, swarm.history.numbers.tolist()) == ("iteration", [0.0, 1.0, 2.0])
    assert (descents.history.steps.name, descents.history.numbers.tolist()) == ("start", [1.0, 2.0])
    assert (swarm.history.steps, descents.history.steps) == (Solver.steps, IPOPT.steps)
    assert not swarm.in_program_variables and descents.in_program_variables


def test_what_solvers_state_about_themselves() -> None:
    assert (Solver.default_budget, IPOPT.default_budget) == (Budget(30_000), Budget(iterations=20))
    assert (Solver.has_population, IPOPT.has_population) == (True, False)
    assert (Solver.solves_program, IPOPT.solves_program) == (False, True)


BAD: list[tuple[dict[str, Any], type[Exception], str]] = [
    ({}, ValueError, "budget"),
    ({"evaluations": 0}, ValueError, "a budget of 0 evaluations is not positive"),
    ({"seconds": 0.0}, ValueError, "a budget of 0.0 seconds is not positive"),
    ({"target": 1.0}, ValueError, "budget"),
    ({"evaluations": 1, "stagnation": 0}, ValueError, "a budget of 0 stagnation is not positive"),
    ({"evaluations": 1.5}, TypeError, "a budget of 1.5 evaluations: a whole number is needed"),
    ({"evaluations": True}, TypeError, "a budget of True evaluations: a whole number is needed"),
    ({"evaluations": 5, "seconds": "1"}, TypeError, "a budget of '1' seconds: a number is needed"),
]


def test_budgets_that_are_none() -> None:
    for limits, error, reason in BAD:
        with pytest.raises(error) as caught:
            Budget(**limits)
        assert reason in str(caught.value), limits
