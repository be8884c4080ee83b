"""``compare function:...``: solvers on benchmark functions, with the options, store and table of scenarios."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from tpbso_casadi.campaign.export import export
from tpbso_casadi.campaign.functions.run import FunctionRun, function_grid
from tpbso_casadi.campaign.functions.search import PREFIX
from tpbso_casadi.campaign.grid import SolverSpec, check_size
from tpbso_casadi.campaign.logs.write import traces_of_functions, write_logs
from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.runner import run_campaign
from tpbso_casadi.campaign.statistics import summarise
from tpbso_casadi.campaign.store import Store
from tpbso_casadi.campaign.table import HEADER, print_tables, rows
from tpbso_casadi.cli.campaign import executors_of, failures, stored
from tpbso_casadi.cli.display.campaign_progress import State, campaign_progress, say
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import write_csv, writing


def functions_of(cases: Sequence[str]) -> list[str]:
    """The benchmark functions among what is to be compared, without their prefix; none where these are scenarios.

    Raises:
        ScenarioError: there are both.
    """
    names = [case.removeprefix(PREFIX) for case in cases if case.startswith(PREFIX)]
    if names and len(names) < len(cases):
        scenario = next(case for case in cases if not case.startswith(PREFIX))
        raise ScenarioError(f"{scenario}: a scenario beside benchmark functions; compare each in a command of its own")
    return names


def compare_functions(
    names: Sequence[str], specs: Sequence[SolverSpec], options: argparse.Namespace, table: Path | None
) -> int:
    """Run the campaign of the options on functions; returns the exit status.

    Args:
        names: of the functions.
        specs: the solvers.
        options: of the command line.
        table: file for the runs as a table; None for none.

    Raises:
        ScenarioError: a function or solver is unknown, or there are too many runs.
    """
    check_size(len(names) * len(specs), options.seed, options.runs)
    runs = function_grid(names, specs, range(options.seed, options.seed + options.runs))
    with stored(options) as store:
        _run(runs, store, options)
        records = store.records(runs)
        write_logs(options.format, options.out, traces_of_functions(runs, store))
    _report(records, options, table)
    return failures(records)


def _run(runs: Sequence[FunctionRun], store: Store, options: argparse.Namespace) -> None:
    """Do the runs that are not stored yet, with progress on standard error."""
    done = store.done(failed_too=not options.retry_failed)
    pending = list({run.key: run for run in runs if run.key not in done}.values())
    if not pending:
        return
    if not options.quiet:
        say(f"{len(runs)} runs of benchmark functions, {len(runs) - len(pending)} of them stored already")
    state = State(len(pending), len({(run.case, run.solver) for run in pending}), None)
    with executors_of(options, len(pending)) as executors, campaign_progress(state, options.quiet) as progress:
        run_campaign(pending, store, executors, options.retry_failed, progress)


def _report(records: Sequence[Record], options: argparse.Namespace, table: Path | None) -> None:
    summaries = summarise(records)
    with writing(options.out):
        write_csv(options.out / "summary.csv", HEADER, rows(summaries))
    if table is not None:
        export(records, table)
    if options.json:
        sys.stdout.write(json.dumps([dict(zip(HEADER, row, strict=True)) for row in rows(summaries)], indent=2) + "\n")
    elif not options.quiet:
        print_tables(summaries, Console())
        Console().print(f"written to {options.out}", highlight=False, soft_wrap=True)
