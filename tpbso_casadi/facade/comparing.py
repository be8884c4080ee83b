"""``tp.compare``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Self, TypeAlias

from rich.console import Console

from problems.base import FloatArray
from solvers import AnySolver, deferred_interrupt
from tpbso_casadi.facade.arguments import (
    AnySolverChoice,
    file_path,
    function,
    in_words_of_python,
    several,
    solver_table,
    whole,
)
from tpbso_casadi.facade.showing import chosen, data_frame
from tpbso_casadi.facade.statement import HasScenario, What, check_plannable, scenario_of
from tpbso_casadi.figures.palette import DEFAULT, FORMATS
from tpbso_casadi.html import heading, table
from tpbso_casadi.judging.campaign import run_campaign
from tpbso_casadi.judging.executors import in_process, processes
from tpbso_casadi.judging.grid import (
    FUNCTION_SOLVERS,
    USUAL_RUNS,
    USUAL_SOLVERS,
    USUAL_STARTS,
    SolverSpec,
    budgeted,
    campaign_of,
    functions_of,
    parse_solver,
    parse_solvers,
)
from tpbso_casadi.judging.page import write_comparison
from tpbso_casadi.judging.results import POLISH_HEADER, Best, Results, best_runs, results_of
from tpbso_casadi.judging.run import AnyRun, RunRecord
from tpbso_casadi.judging.searches import PREFIX
from tpbso_casadi.judging.statistics import Summary
from tpbso_casadi.judging.store import RunStore
from tpbso_casadi.judging.tables import HEADER, export, print_polish_gains, print_tables, rows
from tpbso_casadi.plain import settings_of
from tpbso_casadi.scenario import Scenario, ScenarioError

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


WIDTH = 100  # columns of the tables as text
SHOWN = (
    "case", "solver", "runs", "infeasible", "median", "mean", "std", "best", "expected_running_time", "a12",
    "p_corrected", "against_first", "test",
)  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Runs of solvers on scenarios, and what they show; ``print(comparison)`` shows the tables.

    Attributes:
        results: of all runs.
        runs: what was run, scenarios with solvers and seeds.
        best: run of each scenario that has one, with what it found.
    """

    results: Results
    runs: tuple[AnyRun, ...]
    best: tuple[Best, ...]

    @classmethod
    def of(cls, runs: Sequence[AnyRun], store: RunStore) -> Self:
        """The comparison of runs, as far as they are stored.

        Raises:
            StoreError: what is stored is no result, or not what a recomputation gives.
        """
        return cls(results_of(runs, store), tuple(runs), tuple(best_runs(runs, store)))

    @property
    def records(self) -> tuple[RunRecord, ...]:
        """Every run in a few numbers."""
        return tuple(self.results.records)

    @property
    def summaries(self) -> tuple[Summary, ...]:
        """The runs of each solver on each scenario together."""
        return tuple(self.results.summaries)

    @property
    def table(self) -> list[dict[str, Any]]:
        """A row for each scenario (``case``) and solver.

        ``mean``, ``std``, ``best`` and ``median`` are objectives of certified plans in ``unit``; ``a12`` and ``p`` are
        those of a ``test`` against the first solver, of rank sums or, where the two have their searches in common, of
        signed ranks; ``p_corrected`` by Holm over the table, and ``against_first`` says what that shows.
        ``expected_running_time`` is how many evaluations a plan within 1 % of the best takes (a function: within
        0.001 of its minimum), ``evaluations`` the mean of all runs, polishes included.
        """
        return [dict(zip(HEADER, row, strict=True)) for row in rows(self.summaries)]

    @property
    def polish_table(self) -> list[dict[str, Any]]:
        """A row for each scenario and solver whose searches were refined by IPOPT, run by run; empty where none was.

        ``median_before`` and ``median_after`` are objectives in ``unit``, of the searches' motions and of what is kept;
        ``median_gain`` and its quartiles are of how much of itself the objective of each run fell; ``kept`` runs have
        the refined motion as their plan, ``made_feasible`` ones had none before.
        """
        return [dict(zip(POLISH_HEADER, gain.row, strict=True)) for gain in self.results.polish_gains]

    @property
    def objectives(self) -> dict[tuple[str, str], FloatArray]:
        """The objectives of all runs that did not fail, (n,), by scenario and solver; inf without a certified plan."""
        return {(summary.case, summary.solver): summary.objectives for summary in self.summaries}

    @property
    def failures(self) -> list[str]:
        """Why runs failed, a line each."""
        failed = (record for record in self.records if record.error)
        return [f"{record.case}, {record.solver}, seed {record.seed}: {record.error}" for record in failed]

    def to_dataframe(self) -> pd.DataFrame:
        """The table as a pandas data frame; needs pandas.

        Raises:
            ImportError: pandas is not installed.
        """
        return data_frame(self.table)

    def runs_to_dataframe(self) -> pd.DataFrame:
        """Every run, a row each, as a pandas data frame; needs pandas.

        Raises:
            ImportError: pandas is not installed.
        """
        return data_frame([asdict(record) for record in self.records])

    def plot(self, kind: str = "comparison") -> Figure:
        """A figure of the runs.

        Args:
            kind: ``comparison``, gaps to the best plan over evaluations and of final plans; ``polish``, each search
                and what IPOPT made of it; ``ecdf``, the share of targets reached; ``critical-difference``, mean ranks
                over scenarios; ``effect-sizes``, A12 of each solver against each.

        Raises:
            ValueError: there is no such figure, or it makes no sense for these runs.
        """
        from tpbso_casadi.figures.notebook import notebook_figure  # noqa: PLC0415
        from tpbso_casadi.judging.page_figures import drawing_of  # noqa: PLC0415 (matplotlib is slow to load)

        return notebook_figure(drawing_of(kind, self.results))

    def save(self, folder: str | Path, plots: bool = True, figures: Sequence[str] = DEFAULT) -> Path:
        """Write ``summary.csv``, every run in ``runs.csv``, the page ``comparison.html`` and, with plots, all figures.

        Args:
            folder: to write to.
            plots: whether to draw figures, on the page too.
            figures: formats of their files: ``png``, ``pdf``, ``svg``.

        Returns:
            The path of the folder.

        Raises:
            ValueError: there is no such format.
            OutputError: it cannot be written.
        """
        formats = chosen("figures", figures, FORMATS) if plots else ()
        write_comparison(Path(folder), self.results, self.runs, self.best, formats=formats)
        export(self.records, Path(folder) / "runs.csv")
        return Path(folder)

    def __repr__(self) -> str:
        cases = len({summary.case for summary in self.summaries})
        solvers = len({summary.solver for summary in self.summaries})
        failed = f", {len(self.failures)} failed" if self.failures else ""
        searched = f"{cases} {self.results.measure.case}s"
        return f"<comparison: {solvers} solvers on {searched}, {len(self.records)} runs{failed}>"

    def __str__(self) -> str:
        text = StringIO()
        self.print_on(Console(file=text, width=WIDTH))
        return text.getvalue().rstrip()

    def print_on(self, console: Console) -> None:
        """Print the tables, as ``tpbso compare`` does."""
        print_tables(self.summaries, console)
        print_polish_gains(self.results.polish_gains, console)

    def _repr_html_(self) -> str:
        return heading(repr(self)[1:-1]) + table(SHOWN, ([row[key] for key in SHOWN] for row in self.table))


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
        runs, seed, workers = whole("runs", runs), whole("seed", seed), whole("workers", workers)
        place = None if folder is None else file_path("folder", folder)
        functions = functions_among(scenarios, keys)
        specs = solvers_of(functions, solvers, budget, time_limit, starts if time_limit is None else None)
        stated = {} if functions else labelled(scenarios, keys)
        campaign = campaign_of(functions, stated, specs, seed, runs)
        comparison = _done(campaign, workers, place, progress)
    if place is not None:
        comparison.save(place)
    return comparison


def _done(
    campaign: Sequence[AnyRun], workers: int, folder: Path | None, progress: Callable[[int, int], object]
) -> Comparison:
    """The comparison of all runs, done as far as they are not stored."""
    with ExitStack() as opened:
        place = Path(opened.enter_context(TemporaryDirectory())) if folder is None else folder
        interruption = opened.enter_context(deferred_interrupt())
        store = opened.enter_context(RunStore.in_folder(place))
        executors = processes(workers) if workers > 1 and known_to_workers(campaign) else in_process(interruption)
        ended = [0]

        def count(run: object, outcome: object) -> None:
            ended[0] += 1
            progress(ended[0], len(campaign))

        run_campaign(campaign, store, executors, progress=count)
        return Comparison.of(campaign, store)


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


def solvers_of(
    functions: Sequence[str],
    solvers: AnySolvers,
    budget: Mapping[str, Any],
    time_limit: float | None,
    starts: int | None,
) -> list[SolverSpec]:
    """The solvers that a campaign runs, with their budgets; on functions the usual ones are others.

    Raises:
        ScenarioError: there is none, one is none, or is there twice.
    """
    usual = FUNCTION_SOLVERS if functions and solvers is USUAL_SOLVERS else solvers
    return budgeted(specs_of(usual), budget, time_limit, starts)


def specs_of(solvers: AnySolvers) -> list[SolverSpec]:
    """The solvers that a campaign runs.

    Raises:
        ScenarioError: there is none, one is none, or is there twice.
    """
    if isinstance(solvers, str):
        return parse_solvers(solvers)
    if isinstance(solvers, Mapping):
        specs = [replace(spec_of(solver), label=str(label)) for label, solver in solvers.items()]
    else:
        specs = [spec_of(solver) for solver in several("solvers", solvers, "solvers")]
    labels = [spec.label for spec in specs]
    twice = next((label for label in labels if labels.count(label) > 1), None)
    if twice is not None:
        raise ScenarioError(f"solvers: {twice} is there twice; say a table, {{'label': solver}}")
    if not specs:
        raise ScenarioError("solvers: one at least is needed")
    return specs


def spec_of(solver: AnySolverChoice) -> SolverSpec:
    """One solver; its label names the settings that differ from its defaults.

    Raises:
        ScenarioError: it is none.
    """
    if solver is None:
        raise ScenarioError("solvers: a name, a class, or a solver with its settings is needed, not None")
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
