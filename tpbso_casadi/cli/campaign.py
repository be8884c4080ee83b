"""What the command lines of campaigns share: executors, the store, and progress."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from problems.evaluation import BACKENDS, InvalidEvaluation, processors
from tpbso_casadi.campaign.executors import ExecutorError, ExecutorFactory, cluster, processes
from tpbso_casadi.campaign.export import check_export
from tpbso_casadi.campaign.run import Outcome, Run
from tpbso_casadi.campaign.runner import LostExecutor, run_campaign
from tpbso_casadi.campaign.store import Record, Store, StoreError
from tpbso_casadi.cli.common import Exit, positive_int, print_error
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.files import OutputError, check_writable, writing

FAILURES = (ScenarioError, OutputError, StoreError, ExecutorError, LostExecutor, InvalidEvaluation)
STORE = "runs.sqlite"


def exit_code_of(work: Callable[[], int]) -> int:
    """The exit status of a campaign; an error is reported in one line."""
    try:
        return work()
    except FAILURES as error:
        print_error(str(error))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        print_error("interrupted; completed runs are stored, and the same command resumes")
        return Exit.INTERRUPTED


def add_campaign_options(parser: argparse.ArgumentParser, folder: Path) -> None:
    """The options that every campaign has.

    Args:
        parser: to add them to.
        folder: of the output by default.
    """
    executors = parser.add_argument_group("the executors; they change how long it takes, not the results")
    alternatives = executors.add_mutually_exclusive_group()
    alternatives.add_argument(
        "--workers", type=positive_int, metavar="N", help=f"processes; {processors()}, one a processor, by default"
    )
    alternatives.add_argument("--dask", metavar="ADDRESS", help="the workers of a Dask scheduler, tcp://host:port")
    executors.add_argument("--backend", choices=BACKENDS, help="evaluates populations; auto by default")
    output = parser.add_argument_group("the output; the same command resumes an interrupted campaign")
    output.add_argument(
        "--out", type=Path, default=folder, metavar="DIR", help=f"folder of the runs; {folder} by default"
    )
    output.add_argument("--retry-failed", action="store_true", help="repeat the runs that failed")
    output.add_argument("--export", type=Path, metavar="FILE", help="the runs as a table: .csv or .parquet")
    output.add_argument("--quiet", action="store_true", help="no progress, no table")


def prepare(options: argparse.Namespace) -> None:
    """Make sure before the runs that the output can be written.

    Raises:
        OutputError: it cannot.
    """
    check_writable(options.out)
    if options.export is not None:
        check_export(options.export)


@contextmanager
def stored(options: argparse.Namespace) -> Iterator[Store]:
    """The store in the output folder.

    Raises:
        OutputError: the folder cannot be made.
        StoreError: the store cannot be used.
    """
    with writing(options.out):
        pass
    with Store(options.out / STORE) as store:
        yield store


def local(options: argparse.Namespace) -> ExecutorFactory:
    """Processes of this machine."""
    return processes(options.workers or processors(), options.backend)


def run_with_progress(runs: Sequence[Run], store: Store, options: argparse.Namespace) -> None:
    """Do the remaining runs, with a progress bar on standard error.

    Raises:
        ExecutorError: there are no workers.
        LostExecutor, StoreError: it was interrupted; completed runs are stored.
    """
    keys = {run.key for run in runs}
    pending = keys - store.done(failed_too=not options.retry_failed)
    if not pending:
        return
    connection = cluster(options.dask, options.backend) if options.dask else nullcontext(local(options))
    with connection as executors, campaign_progress(len(keys), len(keys) - len(pending), options.quiet) as progress:
        run_campaign(runs, store, executors, options.retry_failed, progress)


@contextmanager
def campaign_progress(total: int, done: int, quiet: bool) -> Iterator[Callable[[Outcome], object]]:
    """A progress bar over all runs, on a terminal only; yields the callback that advances it."""
    console = Console(stderr=True, quiet=quiet)
    columns = (
        TextColumn("runs"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]}"),
        TimeRemainingColumn(),
    )
    failed = 0
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        bar = progress.add_task("runs", total=total, completed=done, failed="")

        def advance(outcome: Outcome) -> None:
            nonlocal failed
            failed += bool(outcome.error)
            progress.update(bar, advance=1, failed=f"{failed} failed" if failed else "")

        yield advance


def failures(records: Sequence[Record]) -> Exit:
    """Report the runs that failed; the exit status: 0 where there is none, else 1."""
    failed = [record for record in records if record.error]
    if not failed:
        return Exit.FEASIBLE
    first = failed[0]
    print_error(
        f"{len(failed)} of {len(records)} runs failed, the first: {first.case}, {first.solver}, seed {first.seed}: "
        f"{first.error} (--retry-failed tries them again)"
    )
    return Exit.INFEASIBLE
