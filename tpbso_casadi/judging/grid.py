"""The grid of scenarios or functions, solvers and seeds."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from math import inf
from typing import Any

from problems.base import FloatArray
from solvers import Box
from tpbso_casadi.judging.run import AnyRun, Run, RunFinding, problem_of
from tpbso_casadi.judging.searches import KEY, PREFIX, StoredMinimum, find_function, section_of
from tpbso_casadi.judging.targets import VALUES, Measure
from tpbso_casadi.plain import settings_of, versions, visible
from tpbso_casadi.scenario import (
    FAMILIES,
    Scenario,
    ScenarioError,
    SolverSection,
    each_of,
    named_solver,
    parse_scenario,
    plugin_failures_named,
)

USUAL_SOLVERS = ("bso", "pso", "ga", "abso", "abso+polish")  # that are compared where nothing is said
USUAL_RUNS, USUAL_STARTS = 10, 5  # of each, and of a descent
MOST_RUNS = 100_000  # of a campaign
LARGEST_SEED = 2**63 - 1  # that a store can hold


@dataclass(frozen=True)
class SolverSpec:
    """A solver as stated on a command line.

    Attributes:
        label: as stated; for tables.
        name: of the solver.
        settings: those that differ from the solver's defaults.
        polish_starts: candidates that IPOPT refines afterwards.
        table: further keys of the scenario's [solver] table.
        descent_table: these in their place where the solver descends a program; None if there is no difference.
    """

    label: str
    name: str
    settings: Mapping[str, int | float | str] = field(default_factory=dict)
    polish_starts: int = 0
    table: Mapping[str, Any] = field(default_factory=dict)
    descent_table: Mapping[str, Any] | None = None

    def applied(self, scenario: Scenario, seed: int) -> Scenario:
        """The scenario with this solver. Of its own [solver] table only the budget is kept if the solver is another.

        Raises:
            ScenarioError: an unknown solver or setting.
        """
        content, kind = scenario.table(), SolverSection(name=self.name).kind()
        table = content["solver"]
        further = self.descent_table if kind.solves_program and self.descent_table is not None else self.table
        if self.name != scenario.solver.name:
            table |= {"population": None, "settings": {}}
        content["model"]["retime"] = scenario.model.retime and _is_retimed(scenario)
        table |= {"name": self.name, "polish_starts": self.polish_starts, "seed": seed, **further}
        table["settings"] |= dict(self.settings)
        if not kind.has_population:
            table["population"] = None
        applied = parse_scenario(content)
        with plugin_failures_named(applied):
            applied.solver.build()
        return applied


def budgeted(
    specs: Iterable[SolverSpec], budget: Mapping[str, Any], time_limit: float | None, starts: int | None
) -> list[SolverSpec]:
    """The same solvers with the budget of a campaign in place of the scenarios' own.

    30,000 evaluations, a swarm's work of a second, are a thousand starts of a descent: it counts nothing but those.

    Args:
        specs: the solvers.
        budget: keys of [solver] for a swarm; what is None is left to the scenario.
        time_limit: of every run, s; None for none.
        starts: of a descent; None for no limit of their number.
    """
    limit = {} if time_limit is None else {"time_limit": time_limit}
    swarm = {key: value for key, value in budget.items() if value is not None} | limit
    descent = {"evaluations": None, "iterations": starts, **limit}
    return [replace(spec, table=swarm, descent_table=descent) for spec in specs]


def _is_retimed(scenario: Scenario) -> bool:
    """Whether plans of a campaign are timed anew: only where the scenario says so, or its motions always are."""
    return "retime" in scenario.model.stated_keys or FAMILIES[scenario.model.motion].timed_at_the_end


def parse_solvers(text: str) -> list[SolverSpec]:
    """Read a list of solvers: ``bso,bso(printed,lambda_=0.4),bso(c1=1.5),pso+polish,abso+polish3,ipopt``.

    Raises:
        ScenarioError: a solver cannot be read, or is stated twice.
    """
    specs = [parse_solver(part) for part in each_of(text)]
    labels = [spec.label for spec in specs]
    duplicate = next((label for label in labels if labels.count(label) > 1), None)
    if duplicate is not None:
        raise ScenarioError(f"solvers: {duplicate} is there twice")
    return specs


def parse_solver(text: str) -> SolverSpec:
    """Read one solver, as :func:`tpbso_casadi.scenario.named_solver` does.

    Raises:
        ScenarioError: it cannot be read.
    """
    stated = named_solver(text, "solvers")
    return SolverSpec(text, stated.name, stated.settings, stated.polish_starts)


def grid(scenarios: Mapping[str, Scenario], specs: Sequence[SolverSpec], seeds: Sequence[int]) -> list[Run]:
    """Every scenario with every solver and seed; all of one seed before the next, so that any part is a fair sample.

    Raises:
        ScenarioError: naming the case: its task cannot be done, or or a solver does not fit it.
    """
    for case, scenario in scenarios.items():
        with _named(case), plugin_failures_named(scenario):
            problem_of(scenario)
    runs = []
    for seed in seeds:
        for case, scenario in scenarios.items():
            for spec in specs:
                name, label = (visible(text, keep="\n\t") for text in (case, spec.label))
                with _named(f"{case}: {spec.label}"):
                    runs.append(Run(name, label, spec.applied(scenario, seed)))
    return runs


def check_size(combinations: int, first_seed: int, seeds: int) -> None:
    """Make sure that a campaign can be listed and stored.

    Args:
        combinations: of a scenario and a solver.
        first_seed: of each.
        seeds: of each.

    Raises:
        ScenarioError: there are no runs or too many, or a seed is too large.
    """
    if seeds < 1:
        raise ScenarioError(f"runs: {seeds} are none; each solver needs at least one on each scenario")
    if combinations * seeds > MOST_RUNS:
        raise ScenarioError(f"runs: a campaign has at most {MOST_RUNS} in all, scenarios times solvers times seeds")
    if first_seed + seeds - 1 > LARGEST_SEED:
        raise ScenarioError(f"seed: the last one would be larger than {LARGEST_SEED}")


@contextmanager
def _named(place: str) -> Iterator[None]:
    try:
        yield
    except ScenarioError as error:
        raise ScenarioError(f"{place}: {error}") from error


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
        return {KEY: self.case, "solver": self.section.table()}

    @cached_property
    def key(self) -> str:
        """A digest of everything that decides the result, defaults filled in; the label does not count."""
        content = self.statement
        content["solver"] |= {"settings": settings_of(self.section.build()), "budget": asdict(self.section.budget())}
        return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def task(self) -> tuple[str, dict[str, str]]:
        """The arguments of :func:`tpbso_casadi.judging.run.run_one`."""
        return json.dumps(self.statement), versions()

    @property
    def search(self) -> str:
        """Its own key: nothing is polished."""
        return self.key

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

    def seconds_after(self, descent: float) -> float:
        """None: what was found is not refined."""
        return 0.0

    @property
    def box(self) -> Box:
        """Where it searches."""
        return find_function(self.case).box

    def evaluator(self, backend: str | None) -> Callable[[FloatArray], object]:
        """What evaluates a population (m, n), without any backend."""
        return find_function(self.case).f

    def found(self, text: str) -> RunFinding:
        """The place of the lowest value."""
        return RunFinding(words=StoredMinimum.from_text(text).words)


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


def campaign_of(
    functions: Sequence[str],
    scenarios: Mapping[str, Scenario],
    specs: Sequence[SolverSpec],
    first_seed: int,
    seeds: int,
) -> Sequence[AnyRun]:
    """All runs of a campaign on benchmark functions or, where there are none, on scenarios.

    Args:
        functions: their names, without prefix.
        scenarios: by label.
        specs: the solvers.
        first_seed: of each solver on each case.
        seeds: of each.

    Raises:
        ScenarioError: there are no runs or too many, one cannot be done, or a solver does not fit.
    """
    check_size((len(functions) or len(scenarios)) * len(specs), first_seed, seeds)
    numbers = range(first_seed, first_seed + seeds)
    return function_grid(functions, specs, numbers) if functions else grid(scenarios, specs, numbers)


def _section(name: str, spec: SolverSpec, seed: int) -> SolverSection:
    table = {"name": spec.name, "seed": seed, "polish_starts": spec.polish_starts, "settings": dict(spec.settings)}
    try:
        section = SolverSection(name=spec.name)
        population = spec.table if section.kind().has_population else {**spec.table, "population": None}
        return section_of(table | dict(population))
    except ScenarioError as error:
        raise ScenarioError(f"{PREFIX}{name}: {spec.label}: {error}") from error
