"""A run of a campaign: what it is, its outcome, its record, what it found."""

from __future__ import annotations

import json
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from hashlib import sha256
from typing import Any, ClassVar, TypeVar

import numpy as np

from problems import Problem
from problems.base import FloatArray, reader
from problems.evaluation import EvaluationOptions
from solvers import SearchBox
from tpbso_casadi.judging.targets import PLANS, Measure
from tpbso_casadi.plain import one_line, settings_of, versions, visible
from tpbso_casadi.planning import INFEASIBLE_MERIT, PlannedMotion
from tpbso_casadi.scenario import Scenario, SolverSection, parse_scenario, plugin_failures_named
from tpbso_casadi.storage import Contradiction, RunResult, checked


@dataclass(frozen=True, kw_only=True)
class RunRecord:
    """The numbers of a stored run; of a failed run only the first five fields.

    Attributes:
        case: name of the scenario.
        solver: label of the solver.
        seed: of the search.
        seconds: wall-clock time of the whole run.
        error: why it failed; empty where it did not.
        feasible: whether the plan is certified.
        objective: of the plan, in ``unit``.
        unit: of the objective.
        cost: of the search's best candidate.
        evaluations: of the search and its polish.
        iterations: of the search.
        stop_reason: of the search.
        search: a digest of what decides the search: runs that differ in their polish alone have it in common.
    """

    case: str
    solver: str
    seed: int
    seconds: float
    error: str
    feasible: bool = False
    objective: float | None = None
    unit: str = ""
    cost: float | None = None
    evaluations: int | None = None
    iterations: int | None = None
    stop_reason: str = ""
    search: str = ""


def read_record(values: Mapping[str, Any]) -> RunRecord:
    """The record of values that a database holds.

    Args:
        values: by field; of a run that did not fail all of them, ``feasible`` as 0 or 1.

    Raises:
        ValueError: naming the field, in one line: it is missing or not of its type.
    """
    given = {name: value for name, value in values.items() if value is not None}
    if not given.get("error"):
        required = ("feasible", "objective", "evaluations") if given.get("feasible") else ("feasible", "evaluations")
        missing = next((name for name in required if name not in given), None)
        if missing is not None:
            raise ValueError(f"{missing} is missing")
    if given.get("feasible") in (0, 1):
        given["feasible"] = bool(given["feasible"])
    return reader(RunRecord)(given)  # type: ignore[no-any-return]


@dataclass(frozen=True, kw_only=True)
class RunFinding:
    """The best that a run found.

    Attributes:
        words: that say more of it than its objective.
        planned: the motion with its certificate; None of a function.
    """

    words: str
    planned: PlannedMotion | None = None


LONGEST_DETAILS = 20_000  # characters, the last ones of a traceback
CACHED_PROBLEMS = 64  # of a worker: some 10 MB each
PLAN_SECONDS = 0.15  # of what becomes of a search


class AnyRun(ABC):
    """A search that a campaign does, whatever it searches.

    Attributes:
        case: what is searched, for tables.
        solver: label of the solver and its settings, likewise.
        measure: that runs are judged by.
    """

    case: str
    solver: str
    measure: ClassVar[Measure] = PLANS

    @property
    @abstractmethod
    def section(self) -> SolverSection:
        """Solver, budget and seed of the search."""

    @property
    def seed(self) -> int:
        """The seed of the search."""
        return self.section.seed

    @property
    @abstractmethod
    def statement(self) -> dict[str, Any]:
        """Everything that decides the result, as plain data; labels and looks do not count."""

    @cached_property
    def key(self) -> str:
        """A digest of everything that decides the result, defaults filled in."""
        content, section = self.statement, self.section
        content["solver"] |= {"settings": settings_of(section.build()), "budget": asdict(section.budget())}
        return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def task(self) -> tuple[str, dict[str, str]]:
        """Arguments of :func:`tpbso_casadi.judging.executors.run_one`: plain data, which any executor can transport."""
        return json.dumps(self.statement), versions()

    @property
    def search(self) -> str:
        """A digest of what decides the search: runs that differ in their polish alone have it in common."""
        return self.key

    @property
    @abstractmethod
    def least_infeasible_cost(self) -> float:
        """The lowest cost of a candidate that does not count."""

    @property
    @abstractmethod
    def plugins(self) -> list[str]:
        """Names of the classes that are not the package's own."""

    @property
    @abstractmethod
    def searched(self) -> str:
        """A text that is equal for runs that search the same, whatever the solver."""

    def seconds_after(self, descent: float) -> float:
        """Seconds that pass after the search, about, where a descent by IPOPT takes so many."""
        return 0.0

    @property
    @abstractmethod
    def box(self) -> SearchBox:
        """The box that is searched."""

    @abstractmethod
    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        """The function that evaluates a population (m, n).

        Args:
            backend: that does it; None for that of the environment.
        """

    @abstractmethod
    def found(self, text: str) -> RunFinding:
        """The finding of the run, from the text that is stored of it.

        Raises:
            InvalidResult, ScenarioError, Contradiction, InvalidTable: it is no result of such a run.
        """


AnyRunT = TypeVar("AnyRunT", bound=AnyRun)


@dataclass(frozen=True)
class Run(AnyRun):
    """A search of a scenario, and the plan that it leads to.

    Attributes:
        case: name of the scenario, for tables.
        solver: label of the solver and its settings, likewise.
        scenario: everything else: robot, task, limits, solver, budget and seed.
    """

    case: str
    solver: str
    scenario: Scenario

    @property
    def section(self) -> SolverSection:
        return self.scenario.solver

    @property
    def statement(self) -> dict[str, Any]:
        content = self.scenario.table()
        (content["robot"] or {}).pop("looks_text", None)
        return content

    @property
    def task(self) -> tuple[str, dict[str, str]]:
        return self.scenario.as_text(), versions()

    @cached_property
    def search(self) -> str:
        solver = self.section
        if not solver.polish_starts or solver.within is not None or not self.scenario.task.is_searched:
            return self.key
        unpolished = self.scenario.replaced(solver=solver.replaced(polish_starts=0))
        return replace(self, scenario=unpolished).key

    @property
    def least_infeasible_cost(self) -> float:
        if self.section.kind().solves_program:
            return INFEASIBLE_MERIT
        return float(np.nextafter(problem_of(self.scenario).objective_upper_bound, np.inf))

    @property
    def plugins(self) -> list[str]:
        return self.scenario.plugins

    @property
    def searched(self) -> str:
        return without_solver(self.scenario)

    def seconds_after(self, descent: float) -> float:  # a refinement takes about as long as a descent
        polished = not self.section.is_direct and problem_of(self.scenario).direct.replaces_descents
        return PLAN_SECONDS + (1 if polished else self.section.polish_starts) * descent

    @property
    def box(self) -> SearchBox:
        return SearchBox(*problem_of(self.scenario).bounds)

    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        options = EvaluationOptions() if backend is None else EvaluationOptions(backend)
        return problem_of(self.scenario).evaluator(options)

    def found(self, text: str) -> RunFinding:
        result = RunResult.from_json(text)
        with plugin_failures_named(result.scenario, Contradiction):
            motion = checked(result).motion
        words = f"it takes {motion.trajectory.duration:.5g} s and is certified for all t"
        return RunFinding(words=words, planned=PlannedMotion(scenario=result.scenario, motion=motion))


@dataclass(frozen=True)
class Outcome:
    """The end of a run.

    Attributes:
        result: the text of its ``result.json``, compact; None where it failed.
        seconds: wall-clock time of the whole run, as if it had been alone.
        error: why it failed, one line of at most 300 characters.
        details: the traceback.
        seconds_saved: those of ``seconds`` that were not spent, because another run had made the same search.
    """

    result: str | None
    seconds: float
    error: str = ""
    details: str = ""
    seconds_saved: float = 0.0


def failed(error: BaseException, seconds: float = 0.0) -> Outcome:
    """The outcome of a run that raised an exception, in text that any store can hold."""
    try:
        reason = str(error)
    except Exception:  # of a plug-in's own exception
        reason = "(its message cannot be read)"
    details = "".join(traceback.format_exception(error))[-LONGEST_DETAILS:]
    return Outcome(None, seconds, one_line(f"{type(error).__name__}: {reason}"), visible(details, keep="\n\t"))


def problem_of(scenario: Scenario) -> Problem[Any]:
    """The problem of a scenario, built once for all its solvers, budgets and seeds.

    Raises:
        ScenarioError: the robot cannot do the task.
    """
    return _problem(without_solver(scenario))


def without_solver(scenario: Scenario) -> str:
    """The text of a scenario without its solver: what it searches."""
    return scenario.replaced(solver=SolverSection()).as_text()


@lru_cache(maxsize=CACHED_PROBLEMS)
def _problem(scenario: str) -> Problem[Any]:
    """The one problem, with its compiled cost, of all runs of a worker."""
    return parse_scenario(json.loads(scenario)).problem()


def difference(installed: dict[str, str], expected: dict[str, str]) -> str:
    """The first version that differs, in words."""
    name = next(name for name in {**expected, **installed} if installed.get(name) != expected.get(name))
    return f"{name} {installed.get(name, 'is missing')} where {expected.get(name, 'none')} is needed"
