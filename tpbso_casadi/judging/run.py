"""One run of a campaign: what it is, its outcome, its record, what it found."""

from __future__ import annotations

import json
import threading
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, lru_cache
from hashlib import sha256
from typing import Any, Protocol, TypeVar

import numpy as np
from threadpoolctl import threadpool_limits

from problems import Problem
from problems.base import FloatArray, reader
from problems.evaluation import EvaluationOptions
from solvers import Box
from tpbso_casadi.judging.searches import KEY, SUITE_KEY, search_text, suite_text
from tpbso_casadi.judging.targets import PLANS, Measure
from tpbso_casadi.plain import one_line, settings_of, versions, visible
from tpbso_casadi.planning import INFEASIBLE_MERIT, PlannedMotion, SharedSearches, plan
from tpbso_casadi.scenario import Scenario, SolverSection, parse_scenario, plugin_failures_named
from tpbso_casadi.storage import Contradiction, RunResult, checked, result_of


@dataclass(frozen=True, kw_only=True)
class Record:
    """A stored run without its motion; of a failed run only the first five fields.

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


def read_record(values: Mapping[str, Any]) -> Record:
    """A record from what a database holds.

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
    return reader(Record)(given)  # type: ignore[no-any-return]


@dataclass(frozen=True, kw_only=True)
class RunFinding:
    """What a run found.

    Attributes:
        words: that say more of it than its objective.
        planned: a motion, certificate and objective included; None of a function.
    """

    words: str
    planned: PlannedMotion | None = None


def plan_found(text: str) -> RunFinding:
    """The plan of a ``result.json``.

    Raises:
        InvalidResult, ScenarioError, Contradiction: it is none, or not what a recomputation gives.
    """
    result = RunResult.from_json(text)
    with plugin_failures_named(result.scenario, Contradiction):
        motion = checked(result).motion
    words = f"it takes {motion.trajectory.duration:.5g} s and is certified for all t"
    return RunFinding(words=words, planned=PlannedMotion(scenario=result.scenario, motion=motion))


LONGEST_DETAILS = 20_000  # characters, the last ones of a traceback
CACHED_PROBLEMS = 64  # of a worker: some 10 MB each
PLAN_SECONDS = 0.15  # of what becomes of a search
RUN_LOCK = threading.Lock()  # IPOPT's linear solver is not thread-safe, and a cluster's worker may have many threads


class AnyRun(Protocol):
    """What a campaign needs of a run, whatever it searches."""

    @property
    def case(self) -> str:
        """What is searched, for tables."""

    @property
    def solver(self) -> str:
        """Label of the solver and its settings, likewise."""

    @property
    def seed(self) -> int:
        """Of the search."""

    @property
    def key(self) -> str:
        """A digest of everything that decides the result."""

    @property
    def task(self) -> tuple[str, dict[str, str]]:
        """The arguments of :func:`run_one`: plain data, which any executor can transport."""

    @property
    def search(self) -> str:
        """A digest of what decides the search: runs that differ in their polish alone have it in common."""

    @property
    def section(self) -> SolverSection:
        """Solver, budget and seed."""

    @property
    def measure(self) -> Measure:
        """What it is judged by."""

    @property
    def least_infeasible_cost(self) -> float:
        """The lowest cost of a candidate that does not count."""

    @property
    def plugins(self) -> list[str]:
        """Names of the classes that are not the package's own."""

    @property
    def searched(self) -> str:
        """The same text for runs that search the same, whatever the solver."""

    def seconds_after(self, descent: float) -> float:
        """About how many seconds pass after the search, of which a descent by IPOPT takes so many."""

    @property
    def box(self) -> Box:
        """Where it searches."""

    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        """What evaluates a population (m, n).

        Args:
            backend: that does it; None for that of the environment.
        """

    def found(self, text: str) -> RunFinding:
        """What it found, from the text that is stored of it.

        Raises:
            InvalidResult, ScenarioError, Contradiction, InvalidTable: it is no result of such a run.
        """


AnyRunT = TypeVar("AnyRunT", bound=AnyRun)


@dataclass(frozen=True)
class Run:
    """One search of one scenario.

    Attributes:
        case: name of the scenario, for tables.
        solver: label of the solver and its settings, likewise.
        scenario: everything else: robot, task, limits, solver, budget and seed.
    """

    case: str
    solver: str
    scenario: Scenario

    @property
    def seed(self) -> int:
        """Of the search."""
        return self.scenario.solver.seed

    @cached_property
    def key(self) -> str:
        """A digest of everything that decides the result, defaults filled in; labels and looks do not count."""
        content = self.scenario.table()
        (content["robot"] or {}).pop("looks_text", None)
        solver = self.scenario.solver
        content["solver"] |= {"settings": settings_of(solver.build()), "budget": asdict(solver.budget())}
        return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def task(self) -> tuple[str, dict[str, str]]:
        """The arguments of :func:`run_one`: plain data, which any executor can transport."""
        return self.scenario.as_text(), versions()

    @cached_property
    def search(self) -> str:
        """Its own key, unless it is a polished search with a budget of its own."""
        solver = self.scenario.solver
        if not solver.polish_starts or solver.within is not None or not self.scenario.task.is_searched:
            return self.key
        unpolished = self.scenario.replaced(solver=solver.replaced(polish_starts=0))
        return replace(self, scenario=unpolished).key

    @property
    def section(self) -> SolverSection:
        """Solver, budget and seed."""
        return self.scenario.solver

    @property
    def measure(self) -> Measure:
        """Plans are measured from the best of a campaign."""
        return PLANS

    @property
    def least_infeasible_cost(self) -> float:
        """Each candidate with so high a cost breaks a limit at the samples of the search; each lower one keeps all."""
        if self.section.kind().solves_program:
            return INFEASIBLE_MERIT
        return float(np.nextafter(problem_of(self.scenario).objective_upper_bound, np.inf))

    @property
    def plugins(self) -> list[str]:
        """Names of the classes that are not the package's own."""
        return self.scenario.plugins

    @property
    def searched(self) -> str:
        """The scenario without its solver."""
        return without_solver(self.scenario)

    def seconds_after(self, descent: float) -> float:
        """Of a plan: timing, proofs, a record; and refinement, of sequential programs about as much as of a descent."""
        polished = not self.section.is_direct and problem_of(self.scenario).is_polished
        return PLAN_SECONDS + (1 if polished else self.section.polish_starts) * descent

    @property
    def box(self) -> Box:
        """Where it searches."""
        return Box(*problem_of(self.scenario).bounds)

    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        """What evaluates a population (m, n)."""
        options = EvaluationOptions() if backend is None else EvaluationOptions(backend)
        return problem_of(self.scenario).evaluator(options)

    def found(self, text: str) -> RunFinding:
        """Its plan, computed again."""
        return plan_found(text)


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

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


class OtherVersions(RuntimeError):
    """A worker has other versions of the packages that decide a result."""


def run_together(scenarios: Sequence[str], expected: dict[str, str], backend: str | None = None) -> list[Outcome]:
    """Do runs that differ in their polish alone: the search that they have in common is made once.

    Each gives what it would give alone. Whatever is raised within one becomes its failed outcome, an exit by a plug-in
    too; Ctrl-C passes. BLAS has one thread meanwhile: other runs have the other processors.

    Args:
        scenarios: JSON; or one statement of the search of a benchmark function or of a suite's problem.
        expected: versions that the campaign is made with.
        backend: evaluates populations; None for that of the environment. It changes no result.
    """
    with RUN_LOCK, threadpool_limits(1, user_api="blas"):
        contents = [json.loads(scenario) for scenario in scenarios]
        starts = [content.get("solver", {}).get("polish_starts", 0) for content in contents]
        shared = SharedSearches(archived=max(starts) > 1)
        return [_outcome(content, expected, backend, shared) for content in contents]


def run_one(scenario: str, expected: dict[str, str], backend: str | None = None) -> Outcome:
    """Do one run, as :func:`run_together` does."""
    [outcome] = run_together([scenario], expected, backend)
    return outcome


def _outcome(content: dict[str, Any], expected: dict[str, str], backend: str | None, shared: SharedSearches) -> Outcome:
    began, saved = time.perf_counter(), shared.seconds_saved
    try:
        result = _result(content, expected, backend, shared)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        return failed(error, time.perf_counter() - began)
    saved = shared.seconds_saved - saved
    return Outcome(result, time.perf_counter() - began + saved, seconds_saved=saved)


def failed(error: BaseException, seconds: float = 0.0) -> Outcome:
    """The outcome of a run in which this was raised, in text that any store can hold."""
    try:
        reason = str(error)
    except Exception:  # of a plug-in's own exception
        reason = "(its message cannot be read)"
    details = "".join(traceback.format_exception(error))[-LONGEST_DETAILS:]
    return Outcome(None, seconds, one_line(f"{type(error).__name__}: {reason}"), visible(details, keep="\n\t"))


def _result(content: dict[str, Any], expected: dict[str, str], backend: str | None, shared: SharedSearches) -> str:
    ours = versions()
    if ours != expected:
        raise OtherVersions(f"{difference(ours, expected)} on this worker")
    if KEY in content:
        return search_text(content)
    if SUITE_KEY in content:
        return suite_text(content)
    stated = parse_scenario(content)
    problem = problem_of(stated)
    evaluation = None if backend is None else EvaluationOptions(backend)
    finished = plan(stated, evaluation=evaluation, problem=problem, shared=shared)
    if finished.interrupted:
        raise InterruptedError("the run was interrupted")
    return result_of(finished).to_json(indent=None)


def problem_of(scenario: Scenario) -> Problem[Any]:
    """The problem of a scenario, built once for all its solvers, budgets and seeds.

    Raises:
        ScenarioError: the robot cannot do the task.
    """
    return _problem(without_solver(scenario))


def without_solver(scenario: Scenario) -> str:
    """What a scenario searches, as a text."""
    return scenario.replaced(solver=SolverSection()).as_text()


@lru_cache(maxsize=CACHED_PROBLEMS)
def _problem(scenario: str) -> Problem[Any]:
    """One object, with its compiled cost, for all runs of a worker."""
    return parse_scenario(json.loads(scenario)).problem()


def difference(installed: dict[str, str], expected: dict[str, str]) -> str:
    """The first version that differs, in words."""
    name = next(name for name in {**expected, **installed} if installed.get(name) != expected.get(name))
    return f"{name} {installed.get(name, 'is missing')} where {expected.get(name, 'none')} is needed"
