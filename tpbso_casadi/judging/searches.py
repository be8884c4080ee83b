"""Searches of benchmark functions, and of problems of a suite."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Self

import numpy as np

from problems.base import FloatArray, InvalidTable, Table
from solvers import (
    NO_SEARCH,
    BenchmarkFunction,
    Box,
    InvalidFunction,
    Result,
    Solver,
    StopReason,
    benchmark_function,
    minimize,
)
from tpbso_casadi.judging.front_search import search_front
from tpbso_casadi.plain import NotJSON, as_json, parsed_json, plain, settings_of
from tpbso_casadi.scenario import ScenarioError, SolverSection, read_table
from tpbso_casadi.suite import InvalidSuite, Recording, SuiteProblem, keep_falls, problem_named

KEY = "function"  # which only searches of functions have, scenarios have none
SUITE_KEY = "problem"  # which only searches of a suite's problems have
PREFIX = "function:"  # of the name of one on a command line
UNIT = "above minimum"
MOST_SHOWN = 6  # numbers of a vector


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
    """A [solver] table that can search a function.

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
    f: Callable[[FloatArray], FloatArray], box: Box, section: SolverSection, shown: Callable[[Any], Any]
) -> tuple[Result, dict[str, Any]]:
    """What the solver of a section finds in a box, and what is stored of any such search.

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
    if result.stop_reason.value == "interrupted":
        raise InterruptedError("the run was interrupted")
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
    """What is stored of a search with one objective."""
    result, common = _searched(recording.of_population, Box(*recording.problem.bounds), section, plain)
    [(objective, unit)] = recording.problem.objectives
    return {**common, "objective": {"name": objective, "value": result.cost, "unit": unit}}


def _front_searched(recording: Recording, section: SolverSection) -> dict[str, Any]:
    """What is stored of a search with two objectives."""
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


class _Minimum(StoredPart):
    value: float


class StoredMinimum(StoredPart):
    """Where a search ended, of what is stored of it."""

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


def _above(function: BenchmarkFunction, values: FloatArray | float) -> Any:
    """How far values are above the minimum, not less than 0, which rounding may give."""
    return np.maximum(np.asarray(values) - function.optimum, 0.0).tolist()
