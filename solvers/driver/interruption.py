"""Ctrl-C as a request to stop: what has been found so far is kept."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import TypeVar

T = TypeVar("T")

PATIENCE = 2.0  # s after a request, in which further ones change nothing; a later one interrupts as usual


class Interruption:
    """Whether the user has asked to stop, by Ctrl-C or another signal.

    While its handler is installed, a signal only sets ``requested``, which whoever is working has to poll. Only work
    of which nothing needs to be kept is interrupted at once, see :meth:`breakable`.

    Attributes:
        requested: whether to stop.
    """

    def __init__(self) -> None:
        self.requested = False
        self._breakable = False
        self._since = 0.0

    def request(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal.

        Raises:
            KeyboardInterrupt: this is the first request and the work is breakable, or the first was too long ago.
        """
        if self.requested:
            if time.monotonic() - self._since > PATIENCE:
                raise KeyboardInterrupt
            return
        self.requested, self._since = True, time.monotonic()
        if self._breakable:
            raise KeyboardInterrupt

    def install(self, *numbers: int) -> None:
        """Handle these signals from now on; one that is ignored stays ignored."""
        for number in numbers:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, self.request)

    def breakable(self, work: Callable[[], T]) -> T:
        """The result of work that a request interrupts at once.

        Raises:
            KeyboardInterrupt: there was a request, during the work or before it.
        """
        try:
            self._breakable = True
            if self.requested:
                raise KeyboardInterrupt
            return work()
        finally:
            self._breakable = False

    def attempt(self, work: Callable[[], T]) -> T | None:
        """The result of breakable work; None where a request cut it short.

        Raises:
            KeyboardInterrupt: an interruption that was no request.
        """
        try:
            return self.breakable(work)
        except KeyboardInterrupt:
            if not self.requested:
                raise
            return None

    @contextmanager
    def holding(self) -> Iterator[None]:
        """Within breakable work, a part that only polls."""
        before, self._breakable = self._breakable, False
        try:
            yield
        finally:
            self._breakable = before


@contextmanager
def deferred_interrupt() -> Iterator[Interruption]:
    """Turn Ctrl-C into a request for as long as this lasts.

    Within another one, yields that. Threads other than the main one receive no signals.
    """
    outer = _installed()
    if threading.current_thread() is not threading.main_thread():
        yield Interruption()
    elif outer is not None:
        with outer.holding():
            yield outer
    else:
        before, interruption = signal.getsignal(signal.SIGINT), Interruption()
        interruption.install(signal.SIGINT)
        try:
            yield interruption
        finally:
            signal.signal(signal.SIGINT, before)


def _installed() -> Interruption | None:
    """The interruption that handles a signal now, whichever: where SIGINT is ignored, another one may be handled."""
    handlers = (signal.getsignal(number) for number in signal.valid_signals())
    owners = (getattr(handler, "__self__", None) for handler in handlers)
    return next((owner for owner in owners if isinstance(owner, Interruption)), None)
