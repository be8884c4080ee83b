"""How long a campaign may take, before it starts: from what one candidate costs on this machine."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from solvers import AnySolver, Budget
from tpbso_casadi.campaign.run import AnyRun

POPULATION = BATCH = 32  # candidates; where a solver chooses its population itself, too
DESCENT_CANDIDATES = 4_000  # as many as a descent by IPOPT takes the time of: measured 2,100 to 8,900 on seven cases
SOLVER_SECONDS = 5e-6  # that a solver itself takes for a candidate
MEASURED: dict[tuple[str, str | None], float] = {}  # seconds of a candidate, by what is searched and the backend
ITERATION_CANDIDATES = 3  # of each member of a population, at most: a beetle has two antennae


def campaign_seconds(runs: Sequence[AnyRun], workers: int, backend: str | None = None) -> float:
    """About how many seconds runs take on so many workers; fewer, if code is not compiled yet but will be.

    Args:
        runs: to be done.
        workers: processes.
        backend: evaluates populations; None for that of the environment.

    Raises:
        Exception: whatever a plug-in raises.
    """
    return sum(run_seconds(run, backend) for run in runs) / max(1, min(workers, len(runs)))


def run_seconds(run: AnyRun, backend: str | None = None) -> float:
    """About how many seconds one run takes."""
    section = run.section
    solver, budget = section.build(), section.budget()
    if section.within is not None:
        return section.within
    descent = candidate_seconds(run, "vm") * DESCENT_CANDIDATES
    if solver.solves_program:
        seconds = np.inf if budget.iterations is None else budget.iterations * descent
    else:
        seconds = _candidates(solver, budget) * (SOLVER_SECONDS + candidate_seconds(run, backend))
    return float(min(seconds, budget.seconds or np.inf)) + section.polish_starts * descent


def _candidates(solver: AnySolver, budget: Budget) -> float:
    """How many candidates a budget allows a metaheuristic; inf where only the time is limited."""
    population = getattr(solver, "population", None) or POPULATION
    by_iterations = (budget.iterations or np.inf) * ITERATION_CANDIDATES * population
    return float(min(budget.evaluations or np.inf, by_iterations))


def candidate_seconds(run: AnyRun, backend: str | None) -> float:
    """Seconds that a candidate of a run takes in a batch; measured once in a process."""
    key = run.searched, backend
    if key not in MEASURED:
        candidates, evaluate = run.box.sample(np.random.default_rng(0), BATCH), run.evaluator(backend)
        MEASURED[key] = min(_seconds_of(lambda: evaluate(candidates)) for _ in range(3)) / BATCH
    return MEASURED[key]


def _seconds_of(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began
