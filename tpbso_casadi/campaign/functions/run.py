"""The runs of a campaign on benchmark functions."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from hashlib import sha256
from math import inf
from typing import Any

from problems.base.matrix import FloatArray
from solvers import Box
from tpbso_casadi.campaign.analysis.found import Found
from tpbso_casadi.campaign.analysis.measures import VALUES, Measure
from tpbso_casadi.campaign.functions.search import KEY, PREFIX, StoredMinimum, find_function, section_of
from tpbso_casadi.campaign.grid import SolverSpec
from tpbso_casadi.scenario.scenario import SolverSection
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.plain import settings_of
from tpbso_casadi.storage.versions import versions

FUNCTION_SOLVERS = ("bso", "pso", "ga", "abso")  # by default: there is nothing to polish


@dataclass(frozen=True)
class FunctionRun:
    """One search of one benchmark function.

    Attributes:
        case: name of the function.
        solver: label of the solver and its settings, for tables.
        section: solver, budget and seed.
    """

    case: str
    solver: str
    section: SolverSection

    @property
    def seed(self) -> int:
        """Of the search."""
        return self.section.seed

    @property
    def statement(self) -> dict[str, Any]:
        """Everything that is needed to do it, plain data."""
        return {KEY: self.case, "solver": self.section.model_dump(mode="json")}

    @cached_property
    def key(self) -> str:
        """A digest of everything that decides the result, defaults filled in; the label does not count."""
        content = self.statement
        content["solver"] |= {"settings": settings_of(self.section.build()), "budget": asdict(self.section.budget())}
        return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def task(self) -> tuple[str, dict[str, str]]:
        """The arguments of :func:`tpbso_casadi.campaign.run.run_one`."""
        return json.dumps(self.statement), versions()

    @property
    def measure(self) -> Measure:
        """Values are measured from the minimum."""
        return VALUES

    @property
    def least_infeasible_cost(self) -> float:
        """Every finite value counts."""
        return inf

    @property
    def plugins(self) -> list[str]:
        """The solver, where it is not the package's own."""
        return [self.section.name] if ":" in self.section.name else []

    @property
    def searched(self) -> str:
        """The function."""
        return PREFIX + self.case

    @property
    def box(self) -> Box:
        """Where it searches."""
        return find_function(self.case).box

    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        """What evaluates a population (m, n), without any backend."""
        return find_function(self.case).f

    def found(self, text: str) -> Found:
        """The place of the lowest value."""
        return Found(words=StoredMinimum.model_validate_json(text).words)


def functions_of(cases: Sequence[object]) -> list[str]:
    """The benchmark functions among what is to be compared, without their prefix; none where these are scenarios.

    Raises:
        ScenarioError: there are both.
    """
    names = [case.removeprefix(PREFIX) for case in cases if isinstance(case, str) and case.startswith(PREFIX)]
    if names and len(names) < len(cases):
        scenario = next(case for case in cases if not (isinstance(case, str) and case.startswith(PREFIX)))
        raise ScenarioError(f"{scenario}: a scenario beside benchmark functions; compare each by itself")
    return names


def function_grid(names: Sequence[str], specs: Sequence[SolverSpec], seeds: Sequence[int]) -> list[FunctionRun]:
    """Every function with every solver and seed, all of one seed before the next.

    Args:
        names: of the functions, without prefix.
        specs: the solvers.
        seeds: of the searches.

    Raises:
        ScenarioError: there is no such function, it is there twice, or a solver cannot search one.
    """
    for name in names:
        find_function(name)
        if names.count(name) > 1:
            raise ScenarioError(f"{PREFIX}{name}: is there twice")
    return [
        FunctionRun(name, spec.label, _section(name, spec, seed)) for seed in seeds for name in names for spec in specs
    ]


def _section(name: str, spec: SolverSpec, seed: int) -> SolverSection:
    table = {"name": spec.name, "seed": seed, "polish_starts": spec.polish_starts, "settings": dict(spec.settings)}
    try:
        section = SolverSection(name=spec.name)
        population = spec.table if section.kind().has_population else {**spec.table, "population": None}
        return section_of(table | dict(population))
    except ScenarioError as error:
        raise ScenarioError(f"{PREFIX}{name}: {spec.label}: {error}") from error
