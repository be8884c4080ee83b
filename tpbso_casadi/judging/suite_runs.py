"""Runs of solvers on the problems of a suite, as a campaign has them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from problems.base import FloatArray, InvalidTable
from solvers import Box
from tpbso_casadi.judging.grid import FunctionRun, SolverSpec, check_size
from tpbso_casadi.judging.run import RunFinding
from tpbso_casadi.judging.searches import SUITE_KEY, StoredPart, find_problem, section_of
from tpbso_casadi.judging.store import Store, StoreError
from tpbso_casadi.judging.targets import PLANS, Measure
from tpbso_casadi.scenario import ScenarioError, SolverSection
from tpbso_casadi.suite import Recording, SuiteProblem


class SuiteRun(FunctionRun):
    """One search of one problem of a suite, by its merit; ``case`` is the problem's name."""

    @property
    def statement(self) -> dict[str, Any]:
        """Everything that is needed to do it, plain data; and what decides its merits: the values, and a front."""
        problem = find_problem(self.case)
        values, front = problem.function.checks[problem.instance - 1], problem.best_front
        decisive = {"values": values, "front": None if front is None else front.hypervolume}
        return {SUITE_KEY: self.case, **decisive, "solver": self.section.table()}

    @property
    def measure(self) -> Measure:
        return PLANS

    @property
    def least_infeasible_cost(self) -> float:
        return float(np.nextafter(Recording(find_problem(self.case), self.solver).feasible_merit, np.inf))

    @property
    def searched(self) -> str:
        return self.case

    @property
    def box(self) -> Box:
        return Box(*find_problem(self.case).bounds)

    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        return find_problem(self.case).merit

    def found(self, text: str) -> RunFinding:
        stored = _StoredSuiteSearch.from_text(text)
        return RunFinding(words="keeps all constraints" if stored.feasible else "breaks a constraint")


class _Improvements(StoredPart):
    evaluations: list[int]
    cost: list[float]


class _StoredSuiteSearch(StoredPart):
    feasible: bool
    evaluations: int
    improvements: _Improvements


def suite_grid(
    problems: Sequence[SuiteProblem], specs: Sequence[SolverSpec], seeds: int, budget: int, first_seed: int = 1
) -> list[SuiteRun]:
    """Every problem with every solver and seed, all of one seed before the next.

    Args:
        problems: of the suite.
        specs: the solvers.
        seeds: how many, of each.
        budget: evaluations of a run for each variable.
        first_seed: of each.

    Raises:
        ScenarioError: there are too many, or a solver cannot search.
    """
    check_size(len(problems) * len(specs), first_seed, seeds)
    return [
        SuiteRun(problem.name, spec.label, _section(spec, seed, budget * problem.dimension))
        for seed in range(first_seed, first_seed + seeds)
        for problem in problems
        for spec in specs
    ]


def _section(spec: SolverSpec, seed: int, evaluations: int) -> SolverSection:
    table: Mapping[str, Any] = {
        "name": spec.name,
        "seed": seed,
        "evaluations": evaluations,
        "polish_starts": spec.polish_starts,
        "settings": dict(spec.settings),
    }
    try:
        return section_of(table)
    except ScenarioError as error:
        raise ScenarioError(f"{spec.label}: {error}") from error


def recordings(runs: Sequence[SuiteRun], store: Store) -> Iterator[Recording]:
    """What is stored of these runs, without those that failed.

    Raises:
        StoreError: what is stored is not a result.
    """
    for run, text in store.texts(runs):
        if text is None:
            continue
        try:
            stored = _StoredSuiteSearch.from_text(text)
        except InvalidTable as error:
            raise StoreError(f"{store.place(run)}: {error}") from error
        course = stored.improvements
        yield Recording(
            find_problem(run.case), run.solver, run.seed, course.evaluations, course.cost, stored.evaluations
        )
