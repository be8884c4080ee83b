"""Ends of searches: budgets, reasons, Ctrl-C."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from enum import StrEnum
from numbers import Integral, Real
from types import FrameType
from typing import TypeVar


class StopReason(StrEnum):
    """The criterion that ended a search."""

    EVALUATIONS = "evaluations"
    ITERATIONS = "iterations"
    SECONDS = "seconds"
    TARGET = "target"
    STAGNATION = "stagnation"
    INTERRUPTED = "interrupted"
    CONVERGED = "converged"  # of one descent: a point where no direction improves
    FAILED = "failed"  # of one descent: infeasible, or a numerical failure
    EXHAUSTED = "exhausted"  # the solver itself had nothing more to try
    ERROR = "error"  # the cost, the callback or the solver raised


@dataclass(frozen=True, kw_only=True)
class Usage:
    """The effort of a search so far.

    Attributes:
        evaluations: done.
        requested: evaluations done, and those that the search needs to go on.
        iterations: completed.
        seconds: since the start, wall-clock time.
        cost: the lowest so far.
        unimproved: iterations since it was found.
        interrupted: whether the user has pressed Ctrl-C.
    """

    evaluations: int
    requested: int
    iterations: int
    seconds: float
    cost: float
    unimproved: int
    interrupted: bool


@dataclass(frozen=True)
class Budget:
    """Limits of a search, of which the first that is reached ends it; None is no limit.

    Args:
        evaluations: candidates evaluated, all of them counted, antennae included; never exceeded by a metaheuristic.
        iterations: of the solver's loop, where the initial population is iteration 0; or starts of a descent.
        seconds: wall-clock time, checked after every batch. Results then depend on the machine.
        target: stop as soon as a cost is at or below it.
        stagnation: stop after so many iterations without improvement.

    Raises:
        ValueError: a limit is not positive, or none of the first three is given.
        TypeError: a limit is not a number, or evaluations are not a whole one.
    """

    evaluations: int | None = None
    iterations: int | None = None
    seconds: float | None = None
    target: float | None = None
    stagnation: int | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            _check_number(field.name, value)
            if field.name != "target" and value is not None and not value > 0:
                raise ValueError(f"a budget of {value} {field.name} is not positive")
        if self.evaluations is None and self.iterations is None and self.seconds is None:
            raise ValueError("a budget limits evaluations, iterations or seconds")

    def reached(self, usage: Usage) -> StopReason | None:
        """The first criterion, in this order, that ends the search now, or None."""
        criteria = (
            (StopReason.INTERRUPTED, usage.interrupted),
            (StopReason.TARGET, self.target is not None and usage.cost <= self.target),
            (StopReason.EVALUATIONS, self.evaluations is not None and usage.requested > self.evaluations),
            (StopReason.ITERATIONS, self.iterations is not None and usage.iterations >= self.iterations),
            (StopReason.SECONDS, self.seconds is not None and usage.seconds >= self.seconds),
            (StopReason.STAGNATION, self.stagnation is not None and usage.unimproved >= self.stagnation),
        )
        return next((reason for reason, holds in criteria if holds), None)

    def share_used(self, usage: Usage) -> float:
        """The share of the budget used, from 0 to 1; the clock counts only where nothing repeatable limits it."""
        shares = []
        if self.evaluations is not None:
            shares.append(usage.evaluations / self.evaluations)
        if self.iterations is not None:
            shares.append(usage.iterations / self.iterations)
        if not shares and self.seconds is not None:
            shares.append(usage.seconds / self.seconds)
        return min(1.0, max(shares))


def _check_number(name: str, value: object) -> None:
    if value is None:
        return
    kind, words = (Integral, "whole number") if name == "evaluations" else (Real, "number")
    if isinstance(value, bool) or not isinstance(value, kind):
        raise TypeError(f"a budget of {value!r:.60} {name}: a {words} is needed")


T = TypeVar("T")

PATIENCE = 2.0  # s after a request, in which further ones change nothing; a later one interrupts as usual


class Interruption:
    """A handler of Ctrl-C or another signal, by which the user asks to stop.

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
        """Handle a signal as a request to stop.

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
    def polling(self) -> Iterator[None]:
        """Run a part of breakable work that only polls."""
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
        with outer.polling():
            yield outer
    else:
        before, interruption = signal.getsignal(signal.SIGINT), Interruption()
        interruption.install(signal.SIGINT)
        try:
            yield interruption
        finally:
            signal.signal(signal.SIGINT, before)


def _installed() -> Interruption | None:
    """The interruption that handles a signal now; where SIGINT is ignored, another signal may be handled."""
    handlers = (signal.getsignal(number) for number in signal.valid_signals())
    owners = (getattr(handler, "__self__", None) for handler in handlers)
    return next((owner for owner in owners if isinstance(owner, Interruption)), None)
