"""``compare(...)``: many runs of solvers on scenarios, and their statistics."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeAlias

import numpy as np

from solvers import AnySolver
from solvers.driver.interruption import deferred_interrupt
from tpbso_casadi.campaign.analysis.best import best_runs
from tpbso_casadi.campaign.analysis.results import results_of
from tpbso_casadi.campaign.executors import processes
from tpbso_casadi.campaign.functions.run import FUNCTION_SOLVERS, function_grid, functions_of
from tpbso_casadi.campaign.functions.search import PREFIX
from tpbso_casadi.campaign.grid import (
    USUAL_RUNS,
    USUAL_SOLVERS,
    USUAL_STARTS,
    SolverSpec,
    budgeted,
    check_size,
    grid,
    parse_solver,
    parse_solvers,
)
from tpbso_casadi.campaign.in_process import in_process
from tpbso_casadi.campaign.run import AnyRun
from tpbso_casadi.campaign.runner import run_campaign
from tpbso_casadi.campaign.store import STORE, Store
from tpbso_casadi.facade.arguments.keywords import AnySolverChoice, solver_table
from tpbso_casadi.facade.arguments.messages import in_words_of_python
from tpbso_casadi.facade.arguments.values import function
from tpbso_casadi.facade.results.comparison import Comparison
from tpbso_casadi.facade.statement import HasScenario, What, check_plannable, scenario_of
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import writing
from tpbso_casadi.storage.plain import settings_of

AnyScenarios: TypeAlias = What | HasScenario | Sequence[What | HasScenario] | Mapping[str, What | HasScenario]
AnySolvers: TypeAlias = str | Sequence[AnySolverChoice] | Mapping[str, AnySolverChoice]


def compare(
    scenarios: AnyScenarios,
    solvers: AnySolvers = USUAL_SOLVERS,
    *,
    runs: int = USUAL_RUNS,
    seed: int = 1,
    population: int | None = None,
    iterations: int | None = None,
    evaluations: int | None = None,
    time_limit: float | None = None,
    starts: int = USUAL_STARTS,
    workers: int = 1,
    folder: str | Path | None = None,
    progress: Callable[[int, int], object] = lambda done, runs: None,
    **keys: Any,
) -> Comparison:
    """Compare solvers on scenarios: each of them ``runs`` times, with seeds that are counted up.

    Same seed, same result, whatever the number of workers.

    Args:
        scenarios: anything that :func:`plan` takes; a list of such; or a table of them by label. Or benchmark
            functions by name, ``["function:rastrigin-10", "function:bbob-f15-10@3"]``.
        solvers: names, as on the command line (``"bso(lambda_=0.4)"``, ``"abso+polish"``), classes, or solvers with
            their settings, your own too; or a table of them by label. The others are compared with the first.
        runs: of each solver on each scenario.
        seed: of the first run.
        population: of every swarm.
        iterations: of every swarm.
        evaluations: of every run of a swarm, the scenario's or solver's own budget by default.
        time_limit: of every run, s; the results then depend on the machine.
        starts: of ``ipopt``, which counts nothing else.
        workers: processes; with 1 everything is done in this one. A script that asks for more has to begin with
            ``if __name__ == "__main__":``. Classes of a notebook are known to this process alone, which then does all.
        folder: where each run is stored the moment it ends, with the summary and its figure; the same call resumes
            there. Nothing is kept by default.
        progress: is told after each run how many are done, of how many.
        keys: that state a task, or override keys of the scenarios, as for :func:`plan`.

    Raises:
        ScenarioError: naming the first wrong argument.
        StoreError: the folder is in use, or cannot be written.
    """
    function("progress", progress)
    with in_words_of_python():
        budget = {"population": population, "iterations": iterations, "evaluations": evaluations}
        if not isinstance(runs, int | np.integer):
            raise ScenarioError(f"runs: a whole number is needed, not {runs!r:.60}")
        functions = functions_among(scenarios, keys)
        usual = FUNCTION_SOLVERS if functions and solvers is USUAL_SOLVERS else solvers
        specs = budgeted(specs_of(usual), budget, time_limit, starts if time_limit is None else None)
        stated = {} if functions else labelled(scenarios, keys)
        check_size((len(functions) or len(stated)) * len(specs), seed, runs)
        seeds = range(seed, seed + runs)
        campaign = function_grid(functions, specs, seeds) if functions else grid(stated, specs, seeds)
        comparison = _done(campaign, workers, folder, progress)
    if folder is not None:
        comparison.save(folder)
    return comparison


def _done(
    campaign: Sequence[AnyRun], workers: int, folder: str | Path | None, progress: Callable[[int, int], object]
) -> Comparison:
    """The comparison of all runs, done as far as they are not stored."""
    with ExitStack() as opened:
        place = Path(opened.enter_context(TemporaryDirectory())) if folder is None else Path(folder)
        with writing(place):
            pass
        interruption = opened.enter_context(deferred_interrupt())
        store = opened.enter_context(Store(place / STORE))
        executors = processes(workers) if workers > 1 and known_to_workers(campaign) else in_process(interruption)
        ended = [0]

        def count(outcome: object) -> None:
            ended[0] += 1
            progress(ended[0], len(campaign))

        run_campaign(campaign, store, executors, progress=count)
        return Comparison(results_of(campaign, store), tuple(campaign), tuple(best_runs(campaign, store)))


def known_to_workers(campaign: Sequence[AnyRun]) -> bool:
    """Whether other processes find all classes by their names: not those of a notebook."""
    interactive = not hasattr(sys.modules["__main__"], "__file__")
    return not (interactive and any(name.startswith("__main__:") for run in campaign for name in run.plugins))


def functions_among(scenarios: AnyScenarios, keys: Mapping[str, Any]) -> list[str]:
    """The benchmark functions that are to be compared, without their prefix; none where these are scenarios.

    Raises:
        ScenarioError: there are scenarios too, or keys that state a task.
    """
    if isinstance(scenarios, Mapping):
        labelled_functions = functions_of(list(scenarios.values()))
        if labelled_functions:
            raise ScenarioError(f"scenarios: {PREFIX}{labelled_functions[0]} is a benchmark function; say a list")
        return []
    functions = functions_of(scenarios if isinstance(scenarios, list | tuple) else [scenarios])
    if functions and keys:
        raise ScenarioError(f"{next(iter(keys))}: is of a scenario; a benchmark function has no such key")
    return functions


def labelled(scenarios: AnyScenarios, keys: dict[str, Any]) -> dict[str, Scenario]:
    """Scenarios by their labels.

    Raises:
        ScenarioError: there is none, two have the same label, or one is wrong.
    """
    if isinstance(scenarios, Mapping):
        _check_plannable(scenarios.values())
        return {str(label): scenario_of(what, **keys) for label, what in scenarios.items()}
    several = isinstance(scenarios, list | tuple) and not all(isinstance(each, int | float) for each in scenarios)
    given: Sequence[Any] = scenarios if several else [scenarios]  # type: ignore[assignment]
    _check_plannable(given)
    found: dict[str, Scenario] = {}
    for number, what in enumerate(given, start=1):
        label = Path(what).stem if isinstance(what, str | Path) else f"scenario {number}"
        if label in found:
            raise ScenarioError(f"scenarios: {label} is there twice; say a table, {{'label': scenario}}")
        found[label] = scenario_of(what, **keys)
    return found


def _check_plannable(scenarios: Iterable[Any]) -> None:
    for what in scenarios:
        check_plannable("scenarios", what)


def specs_of(solvers: AnySolvers) -> list[SolverSpec]:
    """What a campaign runs.

    Raises:
        ScenarioError: there is none, one is none, or is there twice.
    """
    if isinstance(solvers, str):
        return parse_solvers(solvers)
    if isinstance(solvers, Mapping):
        specs = [replace(spec_of(solver), label=str(label)) for label, solver in solvers.items()]
    else:
        specs = [spec_of(solver) for solver in solvers]
    labels = [spec.label for spec in specs]
    twice = next((label for label in labels if labels.count(label) > 1), None)
    if twice is not None:
        raise ScenarioError(f"solvers: {twice} is there twice; say a table, {{'label': solver}}")
    if not specs:
        raise ScenarioError("solvers: one at least is needed")
    return specs


def spec_of(solver: AnySolverChoice) -> SolverSpec:
    """One solver; its label names the settings that differ from its defaults."""
    if isinstance(solver, str):
        return parse_solver(solver)
    table = solver_table(solver)
    name, settings = table["name"], table["settings"]
    usual = {} if isinstance(solver, type) else _defaults(type(solver))
    other = [f"{key}={value}" for key, value in settings.items() if usual.get(key) != value]
    short = name.rpartition(":")[2]
    return SolverSpec(f"{short}({','.join(other)})" if other else short, name, settings)


def _defaults(kind: type[AnySolver]) -> dict[str, Any]:
    """The settings of a solver that is made without any; none where it cannot be."""
    try:
        return settings_of(kind())
    except TypeError:
        return {}
