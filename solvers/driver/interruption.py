"""Ctrl-C during a search: finish the current batch, then stop and keep the best."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol


class Interruptible(Protocol):
    """Something that checks ``interrupted`` regularly and stops when it is set."""

    interrupted: bool


@contextmanager
def deferred_interrupt(run: Interruptible) -> Iterator[None]:
    """Turn the first Ctrl-C into a request to stop; a second one interrupts as usual.

    If SIGINT is ignored, it stays ignored. Threads other than the main one receive no signals.
    """
    previous_handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or previous_handler is signal.SIG_IGN:
        yield
        return

    def request_stop(number: int, frame: object) -> None:
        run.interrupted = True
        signal.signal(signal.SIGINT, previous_handler)

    signal.signal(signal.SIGINT, request_stop)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous_handler)
