"""The grid of scenarios or functions, solvers and seeds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

from tpbso_casadi.judging.run import AnyRun, Run, problem_of
from tpbso_casadi.judging.searches import PREFIX, FunctionRun, SuiteRun, find_function, section_of
from tpbso_casadi.plain import visible
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
from tpbso_casadi.suite import SuiteProblem

USUAL_SOLVERS = ("bso", "pso", "ga", "abso", "abso+polish")  # that are compared where nothing is said
FUNCTION_SOLVERS = ("bso", "pso", "ga", "abso")  # likewise on functions: there is nothing to polish
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
    """Solvers with the budget of a campaign in place of the scenarios' own.

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
        FunctionRun(name, spec.label, _section(f"{PREFIX}{name}: {spec.label}", spec, seed, spec.table))
        for seed in seeds
        for name in names
        for spec in specs
    ]


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
        SuiteRun(
            problem.name, spec.label, _section(spec.label, spec, seed, {"evaluations": budget * problem.dimension})
        )
        for seed in range(first_seed, first_seed + seeds)
        for problem in problems
        for spec in specs
    ]


def _section(place: str, spec: SolverSpec, seed: int, further: Mapping[str, Any]) -> SolverSection:
    """The section of a solver that can search a function; errors name the place."""
    table = {"name": spec.name, "seed": seed, "polish_starts": spec.polish_starts, "settings": dict(spec.settings)}
    with _named(place):
        has_population = SolverSection(name=spec.name).kind().has_population
        return section_of(table | dict(further) | ({} if has_population else {"population": None}))


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
