"""Executors of runs: processes of this machine, or any ``concurrent.futures.Executor``."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import connection, get_context, parent_process, resource_tracker
from threading import Thread
from typing import Any

from problems.evaluation import processors

WORKERS_PER_PROCESSOR = 8  # more only take memory


class ExecutorError(ValueError):
    """Workers that are not available; the message is one line."""


class LostExecutor(RuntimeError):
    """The executor is gone; the runs that ended before are stored."""


def _nothing_to_check() -> None:
    """Workers of this machine report their own end."""


@dataclass(frozen=True)
class ExecutorFactory:
    """Makes executors.

    Attributes:
        start: makes an executor for all runs, and another when one is broken.
        alone: makes an executor for a single run that may have broken another.
        width: runs submitted at a time, including those that wait for a worker.
        backend: evaluates populations there; None for that of a worker's environment. It changes no result.
        check: called now and then while no run ends; raises :class:`LostExecutor` if none can end any more.
    """

    start: Callable[[], Executor]
    alone: Callable[[], Executor]
    width: int
    backend: str | None = None
    check: Callable[[], None] = _nothing_to_check


def processes(workers: int, backend: str | None = None) -> ExecutorFactory:
    """Processes of this machine.

    Raises:
        ExecutorError: so many that they would only take memory.
    """
    most = WORKERS_PER_PROCESSOR * processors()
    if workers > most:
        raise ExecutorError(f"--workers: more than {most}, {WORKERS_PER_PROCESSOR} a processor, only take memory")
    return ExecutorFactory(lambda: _pool(workers), lambda: _pool(1), 2 * workers, backend)


def _pool(workers: int) -> Executor:
    return _Pool(workers, get_context("spawn"), _stay_with_parent)


class _Pool(ProcessPoolExecutor):
    """A process pool whose workers never see Ctrl-C, not even while they start, and end when nobody waits for them."""

    def submit(self, *arguments: Any, **options: Any) -> Future[Any]:
        """Submit a call; worker processes that start here inherit the blocked signal."""
        with _sigint_blocked():
            return super().submit(*arguments, **options)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Free the workers; without ``wait``, end those that are at work."""
        workers = [] if wait else list((self._processes or {}).values())
        super().shutdown(wait, cancel_futures=cancel_futures)
        for worker in workers:
            worker.kill()


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
