"""``tpbso compare``: many runs of solvers on scenarios, and their statistics."""

from __future__ import annotations

import argparse
import json
import shlex
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rich.console import Console

from tpbso_casadi.cli.campaign import (
    add_campaign_options,
    add_logs,
    failures,
    prepare,
    run_campaign_command,
    run_with_progress,
)
from tpbso_casadi.cli.command import OneLineParser, command_parser
from tpbso_casadi.cli.options import (
    SCENARIO,
    add_figures_option,
    add_json,
    add_no_plots,
    add_outside_files,
    add_search_keys,
    add_solvers,
    figure_formats,
    positive_int,
    problem_group,
    search_group,
)
from tpbso_casadi.cli.progress import phase
from tpbso_casadi.facade.comparing import Comparison, solvers_of
from tpbso_casadi.judging.grid import USUAL_RUNS, USUAL_SOLVERS, USUAL_STARTS, campaign_of, functions_of
from tpbso_casadi.judging.logs import check_logs, logged, write_logs
from tpbso_casadi.judging.page import files_of, write_comparison
from tpbso_casadi.judging.run import AnyRun
from tpbso_casadi.judging.store import RunStore
from tpbso_casadi.judging.tables import export
from tpbso_casadi.scenario import load_all

DEFAULT_SOLVERS = ",".join(USUAL_SOLVERS)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit status."""
    stated = sys.argv[1:] if arguments is None else arguments
    command = shlex.join(["tpbso", "compare", *stated])
    return run_campaign_command(parser(), partial(compare, command=command), arguments)


def parser() -> OneLineParser:
    """The command line's options."""
    command_line = command_parser(
        "compare",
        "Compare solvers on scenarios, the others with the first: scenarios times solvers times --runs. The number "
        "of runs and an estimate of the time are shown before it starts; by default it takes seconds to minutes a "
        "scenario. The same command resumes an interrupted campaign.",
        examples=[
            "time-3 obstacle-3 --runs 20 --out runs/compare",
            "time-3 --solvers 'pso,pso(population=40),ga+polish' --table runs.csv",
        ],
    )
    command_line.add_argument(
        "scenario",
        nargs="+",
        metavar=SCENARIO,
        help="TOML files or built-in names; or benchmark functions: function:rastrigin-10, function:bbob-f15-10@3",
    )
    add_outside_files(problem_group(command_line))
    search = search_group(command_line)
    add_solvers(search, DEFAULT_SOLVERS)
    search.add_argument(
        "--runs", type=positive_int, default=USUAL_RUNS, metavar="N", help="of each solver on each scenario"
    )
    add_search_keys(search, "seed", "population", "iterations", "evaluations", seed=1)
    search.add_argument(
        "--starts",
        type=positive_int,
        metavar="N",
        help=f"of ipopt, which counts nothing else [default: {USUAL_STARTS}; none with --time-limit]",
    )
    add_search_keys(search, "time_limit")
    output = add_campaign_options(command_line, Path("runs/compare"))
    add_json(output)
    add_no_plots(output)
    add_figures_option(output)
    add_logs(output)
    return command_line


def compare(options: argparse.Namespace, command: str = "") -> int:
    """Run the campaign of the options; returns the exit status.

    Args:
        options: of the command line.
        command: the whole of it, for the page.
    """
    formats = figure_formats(options)
    prepare(options, *files_of(formats))
    check_logs(options.format, options.out, len(options.scenario))
    runs = campaign(options)
    with RunStore.in_folder(options.out) as store:
        run_with_progress(runs, store, options)
        comparison = Comparison.of(runs, store)
        if options.format:
            write_logs(options.format, options.out, logged(runs, store))
    with phase("writing tables, figures and the page", options.quiet):
        write_comparison(options.out, comparison.results, runs, comparison.best, command, formats)
        if options.table is not None:
            export(comparison.records, options.table)
    if options.json:
        sys.stdout.write(json.dumps(comparison.table, indent=2) + "\n")
    elif not options.quiet:
        comparison.print_on(Console())
        Console().print(f"written to {options.out}", highlight=False, soft_wrap=True)
    return failures(comparison.records)


def campaign(options: argparse.Namespace) -> Sequence[AnyRun]:
    """The runs that the options state.

    Raises:
        ScenarioError: a scenario, function or solver is unknown, they do not fit, or there are too many runs.
    """
    functions = functions_of(options.scenario)
    solvers = USUAL_SOLVERS if options.solvers == DEFAULT_SOLVERS else options.solvers
    budget = {key: getattr(options, key) for key in ("population", "iterations", "evaluations")}
    starts = options.starts or (USUAL_STARTS if options.time_limit is None else None)
    specs = solvers_of(functions, solvers, budget, options.time_limit, starts)
    scenarios = {} if functions else load_all(options.scenario, options.allow_outside_files)
    with phase("building the models", options.quiet):
        return campaign_of(functions, scenarios, specs, options.seed, options.runs)
