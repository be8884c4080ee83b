"""What the command lines of campaigns share: who does the runs, where they are kept, how far they are."""

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
    """The exit status of a campaign; what stops it is said in one line."""
    try:
        return work()
    except FAILURES as error:
        print_error(str(error))
        return Exit.BAD_INPUT
    except KeyboardInterrupt:
        print_error("interrupted; what was done is kept, and the same command goes on")
        return Exit.INTERRUPTED


def add_campaign_options(parser: argparse.ArgumentParser, folder: Path) -> None:
    """The options that every campaign has.

    Args:
        parser: to add them to.
        folder: where the files go if nothing is said.
    """
    who = parser.add_argument_group("who does the runs; changes how long it takes, not what is found")
    alternatives = who.add_mutually_exclusive_group()
    alternatives.add_argument(
        "--workers", type=positive_int, metavar="N", help=f"processes; {processors()}, one a processor, if none"
    )
    alternatives.add_argument("--dask", metavar="ADDRESS", help="the workers of a Dask scheduler, tcp://host:port")
    who.add_argument("--backend", choices=BACKENDS, help="what prices a population")
    output = parser.add_argument_group("the output; the same command goes on where it was cut off")
    output.add_argument("--out", type=Path, default=folder, metavar="DIR", help=f"folder of the runs; {folder} if none")
    output.add_argument("--retry-failed", action="store_true", help="try once more what is kept as failed")
    output.add_argument("--export", type=Path, metavar="FILE", help="the runs as a table: .csv or .parquet")
    output.add_argument("--quiet", action="store_true", help="no progress, no table")


def prepare(options: argparse.Namespace) -> None:
    """Make sure before the work that what comes out can be written.

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
    """The processes of this machine."""
    return processes(options.workers or processors(), options.backend)


def run_with_progress(runs: Sequence[Run], store: Store, options: argparse.Namespace) -> None:
    """Do the runs that are left, with a bar on standard error.

    Raises:
        ExecutorError: nobody can do them.
        LostExecutor, StoreError: it was cut off; what was done is kept.
    """
    keys = {run.key for run in runs}
    left = keys - store.done(failed_too=not options.retry_failed)
    if not left:
        return
    crews = cluster(options.dask, options.backend) if options.dask else nullcontext(local(options))
    with crews as crew, campaign_progress(len(keys), len(keys) - len(left), options.quiet) as progress:
        run_campaign(runs, store, crew, options.retry_failed, progress)


@contextmanager
def campaign_progress(total: int, done: int, quiet: bool) -> Iterator[Callable[[Outcome], object]]:
    """A live bar over all runs with the time left, on a terminal only; gives what moves it."""
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
    """Say what failed; the exit status: 0 nothing, 1 something."""
    failed = [record for record in records if record.error]
    if not failed:
        return Exit.FEASIBLE
    first = failed[0]
    print_error(
        f"{len(failed)} of {len(records)} runs failed, the first: {first.case}, {first.solver}, seed {first.seed}: "
        f"{first.error} (--retry-failed tries them again)"
    )
    return Exit.INFEASIBLE
