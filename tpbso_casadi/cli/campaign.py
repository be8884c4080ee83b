"""Campaigns from a command line: their options, store, workers, progress and failures."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from math import inf, isfinite
from pathlib import Path

from problems.evaluation import processors
from tpbso_casadi.cli.command import FAILURES, Exit, OneLineParser, print_error, run_command
from tpbso_casadi.cli.options import (
    Group,
    add_backend,
    add_out,
    add_quiet,
    add_workers,
    defaulting,
    is_silent,
    machine_group,
    output_group,
    path,
)
from tpbso_casadi.cli.progress import State, campaign_progress, duration, phase, say, size_of
from tpbso_casadi.judging.campaign import campaign_seconds, run_campaign, searches_of
from tpbso_casadi.judging.executors import (
    ExecutorFactory,
    LostExecutor,
    check_address,
    cluster,
    processes,
)
from tpbso_casadi.judging.logs import WRITERS
from tpbso_casadi.judging.run import AnyRun, RunRecord
from tpbso_casadi.judging.store import STORE, RunStore, StoreError
from tpbso_casadi.judging.tables import check_export
from tpbso_casadi.storage import OutputError, check_file, check_writable

CAMPAIGN_FAILURES = (*FAILURES, StoreError, LostExecutor)
INTERRUPTED = "interrupted; completed runs are stored, and the same command resumes"


def run_campaign_command(
    parser: OneLineParser, work: Callable[[argparse.Namespace], int], arguments: Sequence[str] | None
) -> int:
    """Parse the arguments and do the campaign that they ask for; returns the exit status."""
    return run_command(parser, work, arguments, failures=CAMPAIGN_FAILURES, interrupted=INTERRUPTED)


def add_campaign_options(parser: argparse.ArgumentParser, folder: Path) -> Group:
    """The options that every campaign has.

    Args:
        parser: to add them to.
        folder: of the output by default.

    Returns:
        The group of options for the output.
    """
    machine = machine_group(parser)
    alternatives = machine.add_mutually_exclusive_group()
    add_workers(alternatives)
    alternatives.add_argument(
        "--dask", metavar="ADDRESS", help=defaulting("the workers of a Dask scheduler, tcp://host:port", "none")
    )
    add_backend(machine)
    output = output_group(parser)
    add_out(output, folder, folder)
    output.add_argument("--retry-failed", action="store_true", help="repeat the runs that failed")
    output.add_argument(
        "--table", type=path, metavar="FILE", help=defaulting("the runs as a table: .csv or .parquet", "none")
    )
    output.add_argument("--export", type=path, dest="table", help=argparse.SUPPRESS)  # its name before
    add_quiet(output)
    return output


def add_logs(group: Group) -> None:
    """Logs for other tools."""
    group.add_argument(
        "--format",
        type=log_formats,
        default=(),
        metavar="LOGS",
        help=defaulting(
            "coco, ioh or both: also write the histories of all searches as logs for COCO's cocopp, for IOHanalyzer",
            "none",
        ),
    )


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


def prepare(options: argparse.Namespace, *files: str) -> None:
    """Make sure before the runs that the output can be written, and that workers are stated that can be.

    Args:
        options: of the command line.
        files: names of the files in the output folder.

    Raises:
        OutputError: the output cannot be written.
        ExecutorError: no such workers.
    """
    check_writable(options.out)
    if (options.out / "result.json").exists():
        raise OutputError(f"{options.out}: is the folder of a run; say another")
    for name in (STORE, *files):
        check_file(options.out / name)
    if options.table is not None:
        check_export(options.table)
        if options.table.resolve() in [(options.out / name).resolve() for name in (STORE, *files)]:
            raise OutputError(f"--table {options.table}: is a file that is written anyway")
    if options.dask is None:
        local(options)
    else:
        check_address(options.dask)


def local(options: argparse.Namespace, searches: int | None = None) -> ExecutorFactory:
    """Processes of this machine, no more of them than searches.

    Raises:
        ExecutorError: too many are asked for.
    """
    workers = options.workers or processors()
    executors = processes(workers, options.backend)
    return executors if searches is None or searches >= workers else processes(searches, options.backend)


def run_with_progress(runs: Sequence[AnyRun], store: RunStore, options: argparse.Namespace) -> None:
    """Do the remaining runs; their number, an estimate, and then progress are said on standard error.

    Raises:
        ExecutorError: there are no workers.
        LostExecutor, StoreError: it was interrupted; completed runs are stored.
    """
    done = store.done(failed_too=not options.retry_failed)
    pending = list({run.key: run for run in runs if run.key not in done}.values())
    if not pending:
        return
    with executors_of(options, len(searches_of(pending))) as executors:
        if not options.quiet:
            announce(runs, pending, executors.workers, options)
        state = State(pending, executors.workers)
        with campaign_progress(state, is_silent(options)) as progress:
            run_campaign(runs, store, executors, options.retry_failed, progress)


@contextmanager
def executors_of(options: argparse.Namespace, searches: int) -> Iterator[ExecutorFactory]:
    """The executors that the options state.

    Raises:
        ExecutorError: there are none.
    """
    if options.dask is None:
        yield local(options, searches)
        return
    with ExitStack() as connected:
        with phase(f"connecting to {options.dask}", options.quiet):
            executors = connected.enter_context(cluster(options.dask, options.backend))
        yield executors


def announce(runs: Sequence[AnyRun], pending: Sequence[AnyRun], workers: int, options: argparse.Namespace) -> None:
    """Say how large a campaign is, and from how many seconds to how many it may take.

    Args:
        runs: all of it.
        pending: what remains to be done.
        workers: that do it.
        options: of the command line.
    """
    size = size_of(runs, stored=len({run.key for run in runs}) - len(pending))
    try:
        least, most = campaign_seconds(pending, workers, options.backend)
    except Exception:  # of a plug-in, which the runs will report
        least = most = inf
    if isfinite(most):
        seconds = " to ".join(dict.fromkeys((duration(least), duration(most))))
        size += f": {seconds} on {workers} process{'es' * (workers != 1)}"
    say(size)


def failures(records: Sequence[RunRecord]) -> Exit:
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
