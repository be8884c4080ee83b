"""Executors of runs: processes of this machine, a Dask cluster, or any ``concurrent.futures.Executor``."""

from __future__ import annotations

import logging
import os
import re
import signal
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing import connection, get_context, parent_process, resource_tracker
from threading import Thread
from typing import Any

from tpbso_casadi.campaign.run import difference
from tpbso_casadi.storage.versions import versions

ADDRESS = re.compile(r"(\w+://)?(\[[^]]+\]|[^:/\s]+):\d+")
DASK_LOGGERS = ("distributed", "tornado")
DASK_QUEUE_LENGTH = 100_000  # runs: the scheduler distributes them itself
CONNECT_TIMEOUT = 10.0  # s, for a scheduler to answer


class ExecutorError(ValueError):
    """Workers that are not available; the message is one line."""


@dataclass(frozen=True)
class ExecutorFactory:
    """Makes executors.

    Attributes:
        start: makes an executor for all runs, and another when one is broken.
        alone: makes an executor for a single run that may have broken another.
        width: runs submitted at a time, including those that wait for a worker.
        backend: evaluates populations there; None for that of a worker's environment. It changes no result.
    """

    start: Callable[[], Executor]
    alone: Callable[[], Executor]
    width: int
    backend: str | None = None


def processes(workers: int, backend: str | None = None) -> ExecutorFactory:
    """Processes of this machine."""
    return ExecutorFactory(lambda: _pool(workers), lambda: _pool(1), 2 * workers, backend)


def _pool(workers: int) -> Executor:
    return _Pool(workers, get_context("spawn"), _stay_with_parent)


class _Pool(ProcessPoolExecutor):
    """A process pool whose workers never see Ctrl-C, not even while they start."""

    def submit(self, *arguments: Any, **options: Any) -> Future[Any]:
        """Submit a call; worker processes that start here inherit the blocked signal."""
        with _sigint_blocked():
            return super().submit(*arguments, **options)


@contextmanager
def _sigint_blocked() -> Iterator[None]:
    """Block SIGINT in this thread; one that arrives is delivered at the end. Has no effect on Windows."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # it would unblock the signal when it starts
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _stay_with_parent() -> None:
    """In a worker: leave Ctrl-C to the parent process, and end when that has ended, for whatever reason."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        connection.wait([parent.sentinel])
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def cluster(address: str, backend: str | None = None) -> Iterator[ExecutorFactory]:
    """The workers of a Dask scheduler, including those that join later.

    Args:
        address: as ``tcp://host:port``.
        backend: evaluates populations there.

    Raises:
        ExecutorError: Dask is not installed, no scheduler answers, or a worker has other versions than this process.
    """
    try:
        from distributed import Client  # noqa: PLC0415 (optional, and slow to load)
    except ImportError as error:
        raise ExecutorError("--dask needs the package distributed: pip install 'tpbso-casadi[dask]'") from error
    if not ADDRESS.fullmatch(address):
        raise ExecutorError(f"--dask {address}: is not an address like tcp://host:port")
    for name in [name for name in logging.root.manager.loggerDict if name.split(".")[0] in DASK_LOGGERS]:
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are reported in one line
    try:
        client = Client(address, timeout=CONNECT_TIMEOUT, set_as_default=False)
    except OSError as error:
        raise ExecutorError(f"--dask {address}: no scheduler answers there ({type(error).__name__})") from error
    with client:
        check_versions(address, client.run(versions, on_error="return"))
        start = partial(client.get_executor, pure=False)
        yield ExecutorFactory(start, start, DASK_QUEUE_LENGTH, backend)


def check_versions(address: str, by_worker: Mapping[str, dict[str, str] | Exception]) -> None:
    """Compare the versions of each worker with those of this process; a worker that has just left does not matter.

    Raises:
        ExecutorError: naming the first that differs.
    """
    for worker, installed in by_worker.items():
        if isinstance(installed, OSError):
            continue
        if isinstance(installed, Exception):
            raise ExecutorError(f"--dask {address}: {worker} cannot do it: {type(installed).__name__}: {installed}")
        if installed != versions():
            raise ExecutorError(f"--dask {address}: {difference(installed, versions())} on {worker}")
