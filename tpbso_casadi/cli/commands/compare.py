"""``python -m tpbso_casadi.compare``: many runs of solvers on scenarios, and their statistics."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from tpbso_casadi.campaign import Run, grid, parse_solvers
from tpbso_casadi.campaign.analysis.best import best_plans
from tpbso_casadi.campaign.analysis.results import results_of
from tpbso_casadi.campaign.export import export, files_of, write_comparison
from tpbso_casadi.campaign.grid import SolverSpec, check_size
from tpbso_casadi.campaign.logs.write import WRITERS, check_logs, traces_of_scenarios, write_logs
from tpbso_casadi.campaign.table import HEADER, print_tables, rows
from tpbso_casadi.cli.campaign import (
    add_campaign_options,
    exit_code_of,
    failures,
    prepare,
    run_with_progress,
    stored,
)
from tpbso_casadi.cli.commands.compare_functions import compare_functions, functions_of
from tpbso_casadi.cli.common import OneLineParser, add_input_options, natural, positive_float, positive_int
from tpbso_casadi.cli.display.campaign_progress import phase
from tpbso_casadi.cli.figure_formats import add_figures_option, figure_formats
from tpbso_casadi.scenario.loading import load_all

DEFAULT_SOLVERS = "bso,pso,ga,abso,abso+polish"
FUNCTION_SOLVERS = "bso,pso,ga,abso"  # by default on functions, where there is nothing to polish
DEFAULT_RUNS = 10
DEFAULT_STARTS = 5


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    stated = sys.argv[1:] if arguments is None else arguments
    options = parser().parse_args(stated)
    return exit_code_of(lambda: compare(options, shlex.join(["tpbso", "compare", *stated])))


def parser() -> argparse.ArgumentParser:
    """The command line's options."""
    command_line = OneLineParser(
        "python -m tpbso_casadi.compare",
        description="Compare solvers on scenarios: scenarios times solvers times --runs. The number of runs and an "
        "estimate of the time are shown before it starts; by default it takes seconds to minutes a scenario.",
    )
    command_line.add_argument(
        "scenario",
        nargs="+",
        help="TOML files or built-in names; or benchmark functions: function:rastrigin-10, function:bbob-f15-10@3",
    )
    add_input_options(command_line)
    command_line.add_argument(
        "--solvers",
        default=DEFAULT_SOLVERS,
        metavar="A,B,...",
        help=f"NAME, NAME(setting=value,...), either with +polish or +polishN; the others are compared with "
        f"the first; {DEFAULT_SOLVERS} if none",
    )
    command_line.add_argument(
        "--runs",
        type=positive_int,
        default=DEFAULT_RUNS,
        metavar="N",
        help=f"of each solver on each scenario; {DEFAULT_RUNS} by default",
    )
    command_line.add_argument(
        "--seed", type=natural, default=1, help="of the first run, 1 by default; counted up from run to run"
    )
    budget = command_line.add_argument_group("the budget of each run, overriding the scenarios'")
    budget.add_argument("--population", type=positive_int, metavar="M", help="of every swarm")
    budget.add_argument("--iterations", type=positive_int, metavar="N", help="of every swarm")
    budget.add_argument("--evaluations", type=positive_int, metavar="N", help="of every swarm")
    budget.add_argument(
        "--starts",
        type=positive_int,
        metavar="N",
        help=f"of ipopt, which counts nothing else; {DEFAULT_STARTS} by default, none with --time-limit",
    )
    budget.add_argument("--time-limit", type=positive_float, metavar="S", help="results then depend on the machine")
    add_campaign_options(command_line, Path("runs/compare"))
    command_line.add_argument("--json", action="store_true", help="print the table as JSON")
    command_line.add_argument("--no-plots", action="store_true", help="draw no figure, on the page neither")
    add_figures_option(command_line)
    command_line.add_argument(
        "--format",
        type=log_formats,
        default=(),
        metavar="coco,ioh",
        help="also write the histories of all searches as logs for COCO's cocopp, for IOHanalyzer, or for both; "
        "none by default",
    )
    return command_line


def compare(options: argparse.Namespace, command: str = "") -> int:
    """Run the campaign of the options; returns the exit status.

    Args:
        options: of the command line.
        command: the whole of it, for the page.
    """
    formats = figure_formats(options)
    prepare(options, *files_of(formats))
    functions = functions_of(options.scenario)
    check_logs(options.format, options.out, len(options.scenario))
    if functions:
        return compare_functions(functions, solver_specs(options), options, options.export)
    runs = campaign(options)
    with stored(options) as store:
        run_with_progress(runs, store, options)
        results, best = results_of(runs, store), best_plans(runs, store)
        if options.format:
            write_logs(options.format, options.out, traces_of_scenarios(runs, store))
    with phase("writing tables, figures and the page", options.quiet):
        write_comparison(options.out, results, runs, best, command, formats)
        if options.export is not None:
            export(results.records, options.export)
    summaries = results.summaries
    if options.json:
        sys.stdout.write(json.dumps([dict(zip(HEADER, row, strict=True)) for row in rows(summaries)], indent=2) + "\n")
    elif not options.quiet:
        print_tables(summaries, Console())
        Console().print(f"written to {options.out}", highlight=False, soft_wrap=True)
    return failures(results.records)


def campaign(options: argparse.Namespace) -> list[Run]:
    """The runs that the options state.

    Raises:
        ScenarioError: a scenario or solver is unknown, they do not fit each other, or there are too many runs.
    """
    specs = solver_specs(options)
    scenarios = load_all(options.scenario, options.allow_outside_files)
    check_size(len(scenarios) * len(specs), options.seed, options.runs)
    with phase("building the models", options.quiet):
        return grid(scenarios, specs, range(options.seed, options.seed + options.runs))


def solver_specs(options: argparse.Namespace) -> list[SolverSpec]:
    """The solvers that the options state, with their budgets.

    Raises:
        ScenarioError: one cannot be read, or is there twice.
    """
    usual = FUNCTION_SOLVERS if functions_of(options.scenario) else DEFAULT_SOLVERS
    stated = usual if options.solvers == DEFAULT_SOLVERS else options.solvers
    table, descent_table = swarm_budget(options), descent_budget(options)
    return [replace(spec, table=table, descent_table=descent_table) for spec in parse_solvers(stated)]


def log_formats(text: str) -> tuple[str, ...]:
    """Formats of logs from a command line.

    Raises:
        ArgumentTypeError: one is unknown.
    """
    names = tuple(dict.fromkeys(text.split(",")))
    for name in names:
        if name not in WRITERS:
            raise argparse.ArgumentTypeError(f"{name or repr(name)} is none of {', '.join(WRITERS)}")
    return names


def swarm_budget(options: argparse.Namespace) -> dict[str, object]:
    """The keys of the [solver] table that the options state for a swarm."""
    table = {key: getattr(options, key) for key in ("population", "iterations", "evaluations", "time_limit")}
    return {key: value for key, value in table.items() if value is not None}


def descent_budget(options: argparse.Namespace) -> dict[str, object]:
    """The same for a solver that descends: 30,000 evaluations, a swarm's work of a second, are a thousand starts."""
    starts = options.starts or (DEFAULT_STARTS if options.time_limit is None else None)
    time_limit = {} if options.time_limit is None else {"time_limit": options.time_limit}
    return {"evaluations": None, "iterations": starts, **time_limit}
