"""Who does the runs: processes of this machine, a Dask cluster, or any ``concurrent.futures.Executor``."""

from __future__ import annotations

import logging
import os
import re
import signal
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import connection, get_context, parent_process
from threading import Thread

from tpbso_casadi.campaign.run import difference
from tpbso_casadi.storage.versions import versions

ADDRESS = re.compile(r"(\w+://)?(\[[^]]+\]|[^:/\s]+):\d+")
CHATTER = ("distributed", "tornado")
EVERYTHING = 100_000  # runs: the scheduler shares them out
PATIENCE = 10.0  # seconds for a scheduler to answer


class ExecutorError(ValueError):
    """Workers that cannot be had; the message is one line."""


@dataclass(frozen=True)
class ExecutorFactory:
    """How to get executors.

    Attributes:
        start: an executor for everything; again when one is broken.
        alone: an executor for a single run that is suspected of having broken another.
        width: how many runs are handed out at a time, those included that wait for a worker.
        backend: what prices a population there; None for what a worker's environment says. It changes no result.
    """

    start: Callable[[], Executor]
    alone: Callable[[], Executor]
    width: int
    backend: str | None = None


def processes(workers: int, backend: str | None = None) -> ExecutorFactory:
    """Processes of this machine."""
    return ExecutorFactory(lambda: _pool(workers), lambda: _pool(1), 2 * workers, backend)


def _pool(workers: int) -> Executor:
    return ProcessPoolExecutor(workers, get_context("spawn"), _stay_with_parent)


def _stay_with_parent() -> None:
    """In a worker: leave Ctrl-C to the parent, and end when the parent has, however it ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def cluster(address: str, backend: str | None = None) -> Iterator[ExecutorFactory]:
    """The workers of a Dask scheduler, those included that come later.

    Args:
        address: as ``tcp://host:port``.
        backend: what prices a population there.

    Raises:
        ExecutorError: Dask is not installed, nobody answers, or a worker has other versions than this process.
    """
    try:
        from distributed import Client  # noqa: PLC0415 (optional, and slow to load)
    except ImportError as error:
        raise ExecutorError("--dask needs the package distributed: pip install 'tpbso-casadi[dask]'") from error
    if not ADDRESS.fullmatch(address):
        raise ExecutorError(f"--dask {address}: is not an address like tcp://host:port")
    for name in [name for name in logging.root.manager.loggerDict if name.split(".")[0] in CHATTER]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # what matters of it is said in one line
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except OSError as error:
        raise ExecutorError(f"--dask {address}: no scheduler answers there ({type(error).__name__})") from error
    with client:
        check_versions(address, client.run(versions, on_error="return"))
        start = partial(client.get_executor, pure=False)
        yield ExecutorFactory(start, start, EVERYTHING, backend)


def check_versions(address: str, found: Mapping[str, dict[str, str] | Exception]) -> None:
    """Hold the versions of each worker against those of this process; a worker that has just gone does not matter.

    Raises:
        ExecutorError: naming the first that differs.
    """
    for worker, theirs in found.items():
        if isinstance(theirs, OSError):
            continue
        if isinstance(theirs, Exception):
            raise ExecutorError(f"--dask {address}: {worker} cannot do it: {type(theirs).__name__}: {theirs}")
        if theirs != versions():
            raise ExecutorError(f"--dask {address}: {difference(theirs, versions())} on {worker}")
