"""[solver]: which search, with which settings, how long and from which seed."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, Any

from problems.base import Checked, Range, did_you_mean, shown_value
from solvers import AnySolver, Budget
from tpbso_casadi.scenario.catalogues import DIRECT, SOLVER_CATALOGUE, current_name, find_solver
from tpbso_casadi.scenario.plugin_failures import failures_named
from tpbso_casadi.scenario.robots import check_numbers
from tpbso_casadi.scenario.validation import (
    LARGEST_SEED,
    MOST_EVALUATIONS,
    MOST_ITERATIONS,
    MOST_MEMBERS,
    MOST_POLISH_STARTS,
    Positive,
    ScenarioError,
    Section,
    Word,
)

LARGEST_SETTING = 1_000_000  # of a solver, where it is a whole number

NEEDED: dict[type, tuple[type | tuple[type, ...], str]] = {  # of a setting, by the type of its default
    int: (int, "a whole number"),
    float: ((int, float), "a number"),
    str: (str, "a word"),
}


class SolverSection(Section):
    """[solver]: which search, how long, from which seed; the command line overrides."""

    name: Annotated[Word, Checked(current_name)] = "bso"
    population: Annotated[int, Range(most=MOST_MEMBERS)] | None = None
    iterations: Annotated[int, Range(above=0, most=MOST_ITERATIONS)] | None = None
    evaluations: Annotated[int, Range(above=0, most=MOST_EVALUATIONS)] | None = None
    time_limit: Positive | None = None
    within: Positive | None = None
    first: bool = False
    seed: Annotated[int, Range(0, LARGEST_SEED)] = 1
    polish_starts: Annotated[int, Range(0, MOST_POLISH_STARTS)] = 0
    settings: dict[str, int | float | Word] = field(default_factory=dict)

    @property
    def is_direct(self) -> bool:
        """Whether motions are planned without a search, where one is found so."""
        return self.name == DIRECT

    def kind(self) -> type[AnySolver]:
        """The class of what searches.

        Raises:
            ScenarioError: an unknown solver.
        """
        try:
            return find_solver(self.name)
        except ValueError as error:
            raise ScenarioError(f"solver.name: {error}") from error

    def build(self) -> AnySolver:
        """The solver with its settings.

        Raises:
            ScenarioError: an unknown solver or setting, or one out of its range.
        """
        settings: dict[str, Any] = dict(self.settings)
        if self.population is not None:
            settings["population"] = self.population
        kind = self.kind()
        if kind.solves_program and self.polish_starts:
            raise ScenarioError(f"solver.polish_starts: {self.name} has nothing to polish, it descends by itself")
        if kind.solves_program and self.within is not None:
            raise ScenarioError(f"solver.within: {self.name} starts again and again by itself; say time_limit")
        if self.within is not None and self.time_limit is not None:
            raise ScenarioError("solver.within: has a time limit of its own; leave time_limit out")
        if self.first and not self.is_direct:
            raise ScenarioError(
                f"solver.first: {self.name} searches for the best; name direct, in space, or say within"
            )
        self._check_settings(kind, settings)
        foreign = [] if self.name in SOLVER_CATALOGUE.registry else [self.name]
        with failures_named(foreign, "solver.settings", TypeError, ValueError):
            return kind(**settings)

    def _check_settings(self, kind: type[AnySolver], settings: dict[str, Any]) -> None:
        known = list(getattr(kind, "__dataclass_fields__", {}))
        for key, value in settings.items():
            if known and key not in known:
                raise ScenarioError(f"solver.settings.{key}: {self.name} has no such setting{did_you_mean(key, known)}")
            needed, what = NEEDED.get(type(getattr(kind, key, None)), (object, ""))
            if not isinstance(value, needed):
                raise ScenarioError(f"solver.settings.{key}: {what} is needed, not {shown_value(value)}")
            most = MOST_MEMBERS if key == "population" else LARGEST_SETTING
            if isinstance(value, int) and abs(value) > most:
                raise ScenarioError(f"solver.settings.{key}: {shown_value(value)} is more than {most}")
            check_numbers(f"solver.settings.{key}", value)

    def budget(self) -> Budget:
        """How long to search; the solver's default budget unless a limit is stated."""
        if self.evaluations is not None or self.iterations is not None or self.time_limit is not None:
            return Budget(self.evaluations, self.iterations, self.time_limit)
        return self.kind().default_budget
