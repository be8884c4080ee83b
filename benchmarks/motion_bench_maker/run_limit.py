"""Executors whose runs are ended, with their worker, when they take too long; the campaign starts another worker."""

from __future__ import annotations

import faulthandler
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import replace
from functools import partial
from typing import Any, TypeVar

from tpbso_casadi.judging.executors import ExecutorFactory

T = TypeVar("T")


def limited(executors: ExecutorFactory, seconds: float) -> ExecutorFactory:
    """The same processes, each run of which has so many seconds; a worker that ends says where it was."""
    return replace(
        executors, start=partial(_started, executors.start, seconds), alone=partial(_started, executors.alone, seconds)
    )


def _started(start: Callable[[], Executor], seconds: float) -> Executor:
    return _Limited(start(), seconds)


class _Limited(Executor):
    """Submits each call with a limit."""

    def __init__(self, executor: Executor, seconds: float) -> None:
        self._executor, self._seconds = executor, seconds

    def submit(self, call: Callable[..., T], /, *arguments: Any, **options: Any) -> Future[T]:
        """Submit a call."""
        return self._executor.submit(_call, self._seconds, call, *arguments, **options)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Free the workers."""
        self._executor.shutdown(wait, cancel_futures=cancel_futures)


def _call(seconds: float, call: Callable[..., T], *arguments: Any, **options: Any) -> T:
    faulthandler.dump_traceback_later(seconds, exit=True)
    try:
        return call(*arguments, **options)
    finally:
        faulthandler.cancel_dump_traceback_later()
