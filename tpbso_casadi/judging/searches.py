"""Searches of benchmark functions and of problems of a suite: runs, how they are done, what is stored of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import repeat
from math import inf
from typing import Any, ClassVar, Self

import numpy as np

from problems.base import FloatArray, InvalidTable, Table
from solvers import (
    NO_SEARCH,
    BenchmarkFunction,
    Budget,
    InvalidFunction,
    Iterations,
    Result,
    SearchBox,
    Solver,
    StopReason,
    benchmark_function,
    checked_candidates,
    deferred_interrupt,
    minimize,
)
from tpbso_casadi.judging.run import AnyRun, RunFinding
from tpbso_casadi.judging.targets import PLANS, VALUES, Measure
from tpbso_casadi.plain import NotJSON, as_json, parsed_json, plain, settings_of
from tpbso_casadi.scenario import ScenarioError, SolverSection, read_table
from tpbso_casadi.suite import InvalidSuite, Recording, SuiteProblem, keep_falls, problem_named

KEY = "function"  # which only searches of functions have, scenarios have none
SUITE_KEY = "problem"  # which only searches of a suite's problems have
PREFIX = "function:"  # of the name of one on a command line
UNIT = "above minimum"
MOST_SHOWN = 6  # numbers of a vector
SUMS = 10  # of two objectives, each with its share of the budget


@dataclass(frozen=True)
class FunctionRun(AnyRun):
    """A search of a benchmark function.

    Attributes:
        case: name of the function.
        solver: label of the solver and its settings, for tables.
        solver_section: solver, budget and seed.
    """

    case: str
    solver: str
    solver_section: SolverSection
    measure: ClassVar[Measure] = VALUES

    @property
    def section(self) -> SolverSection:
        return self.solver_section

    @property
    def statement(self) -> dict[str, Any]:
        return {KEY: self.case, "solver": self.section.table()}

    @property
    def least_infeasible_cost(self) -> float:
        return inf

    @property
    def plugins(self) -> list[str]:
        return [self.section.name] if ":" in self.section.name else []

    @property
    def searched(self) -> str:
        return PREFIX + self.case

    @property
    def box(self) -> SearchBox:
        return find_function(self.case).box

    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        return find_function(self.case).f

    def found(self, text: str) -> RunFinding:
        return RunFinding(words=StoredMinimum.from_text(text).words)


class SuiteRun(FunctionRun):
    """A search of a problem of a suite by its merit; ``case`` is the problem's name."""

    measure: ClassVar[Measure] = PLANS

    @property
    def statement(self) -> dict[str, Any]:
        """Everything that decides the result: besides the search the values of the problem, and the front it has."""
        problem = find_problem(self.case)
        values, front = problem.function.checks[problem.instance - 1], problem.best_front
        decisive = {"values": values, "front": None if front is None else front.hypervolume}
        return {SUITE_KEY: self.case, **decisive, "solver": self.section.table()}

    @property
    def least_infeasible_cost(self) -> float:
        return float(np.nextafter(Recording(find_problem(self.case), self.solver).feasible_merit, np.inf))

    @property
    def searched(self) -> str:
        return self.case

    @property
    def box(self) -> SearchBox:
        return SearchBox(*find_problem(self.case).bounds)

    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        return find_problem(self.case).merit

    def found(self, text: str) -> RunFinding:
        feasible = _StoredFeasibility.from_text(text).feasible
        return RunFinding(words="keeps all constraints" if feasible else "breaks a constraint")


class StoredPart(Table):
    """The part of a stored result that is needed: other keys do not matter."""

    @classmethod
    def from_table(cls, content: Any) -> Self:
        if isinstance(content, Mapping):
            content = {key: value for key, value in content.items() if key in cls.schema()}
        return super().from_table(content)

    @classmethod
    def from_text(cls, text: str) -> Self:
        """The part of a JSON text.

        Raises:
            InvalidTable: the text is none, or has another form.
        """
        try:
            return cls.from_table(parsed_json(text))
        except NotJSON as error:
            raise InvalidTable(str(error)) from error


class _StoredFeasibility(StoredPart):
    feasible: bool


class _Minimum(StoredPart):
    value: float


class StoredMinimum(StoredPart):
    """The stored end of a search of a function."""

    cost: float
    x: list[float]
    minimum: _Minimum

    @property
    def words(self) -> str:
        """The value of the function itself, and where it has it."""
        shown = ", ".join(f"{number:.5g}" for number in self.x[:MOST_SHOWN])
        more = f", and {len(self.x) - MOST_SHOWN} more" if len(self.x) > MOST_SHOWN else ""
        value, lowest = self.cost + self.minimum.value, self.minimum.value
        return f"f(x) = {value:.7g} where {lowest:.7g} is the minimum, at x = ({shown}{more})"


class Recorder:
    """A function of a population that keeps at which evaluations its lowest value so far fell, exactly.

    Attributes:
        evaluations: numbers of these evaluations, the first is 1.
        values: found there.
    """

    def __init__(self, f: Callable[[FloatArray], FloatArray]) -> None:
        self._f, self._done = f, 0
        self.evaluations: list[int] = []
        self.values: list[float] = []

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """Values (m,) of candidates (m, d)."""
        values = self._f(candidates)
        keep_falls(values.tolist(), self._done, self.evaluations, self.values)
        self._done += len(values)
        return values


def find_function(name: str) -> BenchmarkFunction:
    """A benchmark function by its name, without the prefix.

    Raises:
        ScenarioError: there is none.
    """
    try:
        return benchmark_function(name)
    except InvalidFunction as error:
        raise ScenarioError(f"{PREFIX}{name}: {error}") from error


def section_of(table: Mapping[str, Any]) -> SolverSection:
    """The section of a [solver] table that can search a function.

    Raises:
        ScenarioError: a key is wrong, or the solver needs more than a function.
    """
    section = read_table(SolverSection, "solver", dict(table))
    if section.is_direct:
        raise ScenarioError(NO_SEARCH)
    if section.kind().solves_program or section.polish_starts:
        raise ScenarioError("IPOPT needs the derivatives of a program, which a benchmark function does not give")
    section.build()
    return section


def search_text(statement: Mapping[str, Any]) -> str:
    """Do a search; the text that is stored of it, with the keys that a ``result.json`` has too.

    Values are those above the function's minimum.

    Raises:
        ScenarioError: it cannot be done.
        InterruptedError: Ctrl-C.
    """
    function = find_function(statement[KEY])
    recorder = Recorder(function.f)
    result, common = _searched(recorder, function.box, section_of(statement["solver"]), partial(_above, function))
    content = {
        KEY: function.name,
        **common,
        "objective": {"name": function.name, "value": common["cost"], "unit": UNIT},
        "feasible": bool(np.isfinite(result.cost)),
        "minimum": {"value": function.optimum, "x": function.minimum},
        "improvements": {"evaluations": recorder.evaluations, "cost": _above(function, np.array(recorder.values))},
    }
    return as_json(plain(content), None)


def _searched(
    f: Callable[[FloatArray], FloatArray], box: SearchBox, section: SolverSection, shown: Callable[[Any], Any]
) -> tuple[Result, dict[str, Any]]:
    """The result of the solver of a section in a box, and what is stored of any such search.

    Args:
        f: values (m,) of candidates (m, d).
        box: of the variables.
        section: the solver, its budget and seed.
        shown: of values, what is stored of them.

    Raises:
        InterruptedError: Ctrl-C.
    """
    solver = section.build()
    assert isinstance(solver, Solver)
    result = minimize(f, box, solver, section.budget(), section.seed)
    _check(result.stop_reason is StopReason.INTERRUPTED)
    return result, {
        "solver": {"name": section.name, "settings": settings_of(solver)},
        "seed": section.seed,
        "cost": shown(result.cost),
        "x": result.x,
        "evaluations": result.evaluations,
        "iterations": result.iterations,
        "seconds": result.seconds,
        "stop_reason": result.stop_reason.value,
        "history": {"evaluations": result.history.evaluations, "cost": shown(result.history.cost)},
    }


def find_problem(name: str) -> SuiteProblem:
    """A problem of a suite by its name.

    Raises:
        ScenarioError: there is none.
    """
    try:
        return problem_named(name)
    except InvalidSuite as error:
        raise ScenarioError(str(error)) from error


def suite_text(statement: Mapping[str, Any]) -> str:
    """Do a search of a problem of a suite, by its merit; the text that is stored of it.

    Raises:
        ScenarioError: it cannot be done.
        InterruptedError: Ctrl-C.
    """
    problem, section = find_problem(statement[SUITE_KEY]), section_of(statement["solver"])
    recording = Recording(problem, section.name, section.seed)
    search = _merit_searched if len(problem.objectives) == 1 else _front_searched
    content = {
        SUITE_KEY: problem.name,
        **search(recording, section),
        "feasible": recording.merits[-1] <= recording.feasible_merit,
        "improvements": {"evaluations": recording.evaluations, "cost": recording.merits},
    }
    return as_json(plain(content), None)


def _merit_searched(recording: Recording, section: SolverSection) -> dict[str, Any]:
    """The stored keys of a search with one objective."""
    result, common = _searched(recording.of_population, SearchBox(*recording.problem.bounds), section, plain)
    [(objective, unit)] = recording.problem.objectives
    return {**common, "objective": {"name": objective, "value": result.cost, "unit": unit}}


def _front_searched(recording: Recording, section: SolverSection) -> dict[str, Any]:
    """The stored keys of a search with two objectives."""
    began, solver, budget = time.perf_counter(), section.build(), section.budget()
    assert isinstance(solver, Solver) and budget.evaluations is not None
    search_front(recording, solver, budget.evaluations, section.seed)
    return {
        "solver": {"name": section.name, "settings": settings_of(solver)},
        "seed": section.seed,
        "cost": recording.merits[-1],
        "evaluations": recording.done,
        "seconds": time.perf_counter() - began,
        "stop_reason": StopReason.EVALUATIONS.value,
        "objective": {"name": "missing hypervolume", "value": recording.merits[-1], "unit": "1"},
    }


def _above(function: BenchmarkFunction, values: FloatArray | float) -> Any:
    """Values above the minimum of a function, not less than 0, which rounding may give."""
    return np.maximum(np.asarray(values) - function.optimum, 0.0).tolist()


def search_front(
    recording: Recording, solver: Solver, evaluations: int, seed: int, known: FloatArray | None = None
) -> None:
    """Search for the front of the recording's problem; the recording keeps what is found.

    Args:
        recording: of the run.
        solver: one that takes several costs, or any other.
        evaluations: of the run.
        seed: of the run.
        known: candidates (m, d) to begin with.

    Raises:
        InterruptedError: Ctrl-C.
    """
    box = SearchBox(*recording.problem.bounds).with_known(known)
    search = _ranked if solver.takes_several_costs else _weighted
    search(recording, box, solver, evaluations, np.random.default_rng(seed))


def _ranked(recording: Recording, box: SearchBox, solver: Solver, evaluations: int, rng: np.random.Generator) -> None:
    """Search by a solver that is told both merits of each candidate."""
    search = solver.search(box, rng, Iterations(repeat(0.0), evaluations))
    candidates = checked_candidates(next(search), box, solver)
    with deferred_interrupt() as interruption:
        while len(candidates) <= evaluations - recording.done:
            candidates = checked_candidates(search.send(recording.of_population(candidates)), box, solver)
            _check(interruption.requested)
    search.close()
    recording.of_population(candidates[: evaluations - recording.done])


def _weighted(recording: Recording, box: SearchBox, solver: Solver, evaluations: int, rng: np.random.Generator) -> None:
    """Search for the least weighted sum of merits, one sum after the other; sums keep feasibility first.

    First each objective by itself; then sums, in which an objective counts by how much it differs between these two
    ends. Every search begins with what those before it have found.
    """

    def total(candidates: FloatArray, by: FloatArray) -> FloatArray:
        return recording.of_population(candidates) @ by

    weights = [(1.0, 0.0), (0.0, 1.0), *((1.0 - w, w) for w in np.linspace(0.0, 1.0, SUMS)[1:-1])]
    found = np.empty((0, box.dimension)) if box.known is None else box.known
    ends = np.empty((0, 2))
    for number, pair in enumerate(weights, start=1):
        apart = np.abs(ends[1] - ends[0]) if len(ends) > 1 else np.ones(2)
        by = np.array(pair) / np.where(apart > 0.0, apart, 1.0)
        budget = Budget(evaluations=number * evaluations // SUMS - recording.done)
        known = found if len(found) else None
        result = minimize(partial(total, by=by), box, solver, budget, rng, known=known)
        _check(result.stop_reason is StopReason.INTERRUPTED)
        found = np.vstack([found, result.x])
        ends = np.vstack([ends, recording.problem.merit(result.x[None])])


def _check(interrupted: bool) -> None:
    if interrupted:
        raise InterruptedError("the run was interrupted")
