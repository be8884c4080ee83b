"""From the store of a reproduction to its evidence and its illustrations."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from typing import Any, TypeAlias

from tpbso_casadi.campaign import Run, Store
from tpbso_casadi.reproduction.evidence import CostHistory, Evidence, convergence_iteration
from tpbso_casadi.reproduction.experiment import BASES, ITERATIONS, label
from tpbso_casadi.reproduction.pace import Pace
from tpbso_casadi.reproduction.page.case_figures import Illustration, illustrate
from tpbso_casadi.reproduction.paper import NAMES, PATHS
from tpbso_casadi.scenario.cases.builtin import TITLES, builtin
from tpbso_casadi.storage.result import RunResult

CompletedRun: TypeAlias = tuple[Run, RunResult]


def gather(runs: list[Run], store: Store, scaling: dict[str, Any], pace: Pace) -> Evidence:
    """The evidence in a store.

    Args:
        runs: all of the reproduction.
        store: those of them that were done.
        scaling: as measured by :mod:`tpbso_casadi.reproduction.scaling`.
        pace: as measured by :mod:`tpbso_casadi.reproduction.pace`.
    """
    convergence, distances = {}, {}
    histories: dict[tuple[str, str, str], list[CostHistory]] = {}
    for case in TITLES:
        upper_bound = builtin(case).problem().objective_upper_bound
        for basis in BASES:
            for solver in NAMES:
                results = [result for _, result in completed_runs(runs, store, case, label(solver, basis))]
                histories[case, solver, basis] = [result.history.cost for result in results]
                if solver == "bso" and case in PATHS:
                    distances[case, basis] = [largest_distance(result) for result in results]
            iterations = (convergence_iteration(history, upper_bound) for history in histories[case, "bso", basis])
            convergence[case, basis] = [pair for pair in iterations if pair is not None]
    return Evidence(runs, store.records(runs), convergence, distances, histories, scaling, pace)


def completed_runs(runs: Iterable[Run], store: Store, case: str, solver: str) -> list[CompletedRun]:
    """The runs of one solver, by its label, on one case with their whole results; without those that failed."""
    completed = []
    for run in runs:
        if (run.case, run.solver) == (case, solver):
            try:
                completed.append((run, store.result(run)))
            except KeyError:
                continue
    return completed


def largest_distance(result: RunResult) -> float:
    """The largest distance of a plan along a path from a given point, m."""
    worst = next(constraint.worst for constraint in result.constraints if constraint.name == "accuracy")
    return float("inf") if worst is None else worst


def illustrations(runs: list[Run], store: Store, executor: Executor) -> list[Illustration]:
    """The median run of TPBSO at equal iterations on each case, repeated and drawn."""
    futures = []
    for case in TITLES:
        completed = completed_runs(runs, store, case, label("bso", ITERATIONS))
        if not completed:
            continue
        median, _ = median_run(completed)
        histories = [result.history.cost for run, result in completed if run is not median]
        futures.append(executor.submit(illustrate, case, median.task[0], histories))
    return [future.result() for future in futures]


def median_run(completed: list[CompletedRun]) -> CompletedRun:
    """The run in the middle, infeasible ones last; the better one of two in the middle."""

    def rank(one: CompletedRun) -> tuple[bool, float, int]:
        run, result = one
        value = result.objective.value
        return not result.feasible, float("inf") if value is None else value, run.seed

    return sorted(completed, key=rank)[(len(completed) - 1) // 2]
