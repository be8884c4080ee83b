"""How long a campaign may take, before it starts: from what one candidate costs on this machine."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np

from problems.evaluation import EvaluationOptions
from solvers import AnySolver, Box, Budget
from tpbso_casadi.campaign.run import Run, problem_of
from tpbso_casadi.scenario.scenario import Scenario, SolverSection, parse_scenario

POPULATION = BATCH = 32  # candidates; where a solver chooses its population itself, too
DESCENT_CANDIDATES = 4_000  # as many as a descent by IPOPT takes the time of: measured 2,100 to 8,900 on seven cases
SOLVER_SECONDS = 5e-6  # that a solver itself takes for a candidate
ITERATION_CANDIDATES = 3  # of each member of a population, at most: a beetle has two antennae


def campaign_seconds(runs: Sequence[Run], workers: int, backend: str | None = None) -> float:
    """About how many seconds runs take on so many workers; fewer, if code is not compiled yet but will be.

    Args:
        runs: to be done.
        workers: processes.
        backend: evaluates populations; None for that of the environment.

    Raises:
        Exception: whatever a plug-in raises.
    """
    return sum(run_seconds(run, backend) for run in runs) / max(1, min(workers, len(runs)))


def run_seconds(run: Run, backend: str | None = None) -> float:
    """About how many seconds one run takes."""
    section = run.scenario.solver
    solver, budget = section.build(), section.budget()
    if section.within is not None:
        return section.within
    descent = candidate_seconds(run.scenario, "vm") * DESCENT_CANDIDATES
    if solver.solves_program:
        seconds = np.inf if budget.iterations is None else budget.iterations * descent
    else:
        seconds = _candidates(solver, budget) * (SOLVER_SECONDS + candidate_seconds(run.scenario, backend))
    return float(min(seconds, budget.seconds or np.inf)) + section.polish_starts * descent


def _candidates(solver: AnySolver, budget: Budget) -> float:
    """How many candidates a budget allows a metaheuristic; inf where only the time is limited."""
    population = getattr(solver, "population", None) or POPULATION
    by_iterations = (budget.iterations or np.inf) * ITERATION_CANDIDATES * population
    return float(min(budget.evaluations or np.inf, by_iterations))


def candidate_seconds(scenario: Scenario, backend: str | None) -> float:
    """Seconds that a candidate of a scenario takes in a batch."""
    return _candidate_seconds(scenario.model_copy(update={"solver": SolverSection()}).model_dump_json(), backend)


@lru_cache(maxsize=64)
def _candidate_seconds(scenario: str, backend: str | None) -> float:
    problem = problem_of(parse_scenario(json.loads(scenario)))
    candidates = Box(*problem.bounds).sample(np.random.default_rng(0), BATCH)
    evaluate = problem.evaluator(EvaluationOptions() if backend is None else EvaluationOptions(backend))
    return min(_seconds_of(lambda: evaluate(candidates)) for _ in range(3)) / BATCH


def _seconds_of(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began
