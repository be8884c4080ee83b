"""How long a search takes: TPBSO, PSO and GA as they run in the campaign, in turn, again and again."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from problems.evaluation import EvaluationOptions, PopulationFunction
from solvers import Box, Budget, Solver, minimize
from tpbso_casadi.reproduction.experiment import BASES, Size, solver_section
from tpbso_casadi.reproduction.paper import NAMES
from tpbso_casadi.scenario.cases.builtin import builtin

Pace: TypeAlias = dict[str, dict[str, dict[str, list[float]]]]  # s by basis, case and solver, one a round

CASES = ("time-3", "rotation-3", "obstacle-3", "pentagram-time")  # one of each kind
ROUNDS = 15
QUICK_ROUNDS = 1
WARM_UP = 3_000  # candidates, after which everything is prepared that is prepared once


def measure_pace(
    size: Size, backend: str | None, rounds: int, progress: Callable[[str], object] = lambda case: None
) -> Pace:
    """Processor time of the searches of the campaign, s: same populations, budgets and backend.

    A round does each solver once, so that whatever slows the machine down slows all of them down; processor time does
    not count what other processes do meanwhile.

    Args:
        size: of the reproduction.
        backend: evaluates populations; None for that of the environment.
        rounds: of each solver on each case and basis.
        progress: called with the case that is measured next.
    """
    options = EvaluationOptions() if backend is None else EvaluationOptions(backend)
    pace: Pace = {basis: {} for basis in BASES}
    for case in CASES:
        progress(case)
        problem = builtin(case).problem()
        cost, box = problem.evaluator(options), Box(*problem.bounds)
        cost(box.sample(np.random.default_rng(0), WARM_UP))
        for basis in BASES:
            searches = {name: _search(name, basis, size) for name in NAMES}
            seconds: dict[str, list[float]] = {name: [] for name in NAMES}
            for seed in range(1, rounds + 1):
                for name, (solver, budget) in searches.items():
                    seconds[name].append(_seconds(cost, box, solver, budget, seed))
            pace[basis][case] = seconds
    return pace


def _search(name: str, basis: str, size: Size) -> tuple[Solver, Budget]:
    section = solver_section(name, basis, size)
    solver = section.build()
    assert isinstance(solver, Solver)
    return solver, section.budget()


def _seconds(cost: PopulationFunction, box: Box, solver: Solver, budget: Budget, seed: int) -> float:
    began = time.process_time()
    minimize(cost, box, solver, budget, seed)
    return time.process_time() - began
