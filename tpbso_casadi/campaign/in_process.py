"""An executor that does every run where it is asked to, in this process and thread."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

from solvers.driver.interruption import Interruption
from tpbso_casadi.campaign.executors import ExecutorFactory


class InProcess(Executor):
    """Runs that need no worker: of classes that only this process knows, or where a process costs more than it saves.

    Args:
        interruption: of the campaign; a run that Ctrl-C cut short is not handed out.
    """

    def __init__(self, interruption: Interruption) -> None:
        self._interruption = interruption

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        """Call it now.

        Raises:
            KeyboardInterrupt: Ctrl-C.
        """
        future: Future[Any] = Future()
        future.set_running_or_notify_cancel()
        future.set_result(function(*arguments, **options))
        if self._interruption.requested:
            raise KeyboardInterrupt
        return future


def in_process(interruption: Interruption, backend: str | None = None) -> ExecutorFactory:
    """One run after the other, in this process."""
    return ExecutorFactory(lambda: InProcess(interruption), lambda: InProcess(interruption), 1, backend)
