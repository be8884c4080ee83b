"""From the store of a reproduction to its evidence and its illustrations."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from typing import Any, TypeAlias

from tpbso_casadi.campaign import Run, Store
from tpbso_casadi.reproduction.case_figures import Illustration, illustrate
from tpbso_casadi.reproduction.evidence import Evidence, settled_after
from tpbso_casadi.reproduction.experiment import BASES, ITERATIONS, label
from tpbso_casadi.reproduction.paper import PATHS
from tpbso_casadi.scenario.builtin import TITLES, builtin

Found: TypeAlias = tuple[Run, dict[str, Any]]


def gather(runs: list[Run], store: Store, growth: dict[str, Any]) -> Evidence:
    """The evidence of what is kept."""
    settled, accuracy = {}, {}
    for case in TITLES:
        objective_upper_bound = builtin(case).problem().objective_upper_bound
        for basis in BASES:
            results = [result for _, result in results_of(runs, store, case, label("bso", basis))]
            after = (settled_after(result, objective_upper_bound) for result in results)
            settled[case, basis] = [pair for pair in after if pair is not None]
            if case in PATHS:
                accuracy[case, basis] = max((largest_distance(result) for result in results), default=float("nan"))
    return Evidence(runs, store.records(runs), settled, accuracy, growth)


def results_of(runs: Iterable[Run], store: Store, case: str, arm: str) -> list[Found]:
    """The whole results of one arm on one case; runs that failed are left out."""
    found = []
    for run in runs:
        if (run.case, run.solver) == (case, arm):
            try:
                found.append((run, store.result(run)))
            except KeyError:
                continue
    return found


def largest_distance(result: dict[str, Any]) -> float:
    """Of a plan along a path from a given point, m."""
    return float(next(c["worst"] for c in result["constraints"] if c["name"] == "accuracy"))


def illustrations(runs: list[Run], store: Store, executor: Executor) -> list[Illustration]:
    """Each case as TPBSO's median run at equal iterations has it, done again."""
    futures = []
    for case in TITLES:
        found = results_of(runs, store, case, label("bso", ITERATIONS))
        if not found:
            continue
        shown, _ = median(found)
        histories = [result["history"]["cost"] for run, result in found if run is not shown]
        futures.append(executor.submit(illustrate, case, shown.task[0], histories))
    return [future.result() for future in futures]


def median(found: list[Found]) -> Found:
    """The run in the middle, infeasible ones last; the better one of two in the middle."""
    ordered = sorted(found, key=lambda one: (not one[1]["feasible"], one[1]["objective"]["value"], one[0].seed))
    return ordered[(len(ordered) - 1) // 2]
