"""What a campaign says on standard error: its size before it starts, then how far it is and how long it may still take.

A bar on a terminal, plain lines at intervals elsewhere.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from threading import Event, Thread

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from tpbso_casadi.campaign.run import AnyRun, Outcome

LINE_SECONDS = 15.0  # between two plain lines
UNITS = ((86_400.0 * 365.25, "years"), (86_400.0, "days"), (3_600.0, "h"), (60.0, "min"))


def duration(seconds: float) -> str:
    """A duration in its largest unit, rounded to two digits at most."""
    for size, unit in UNITS:
        if seconds >= 2.0 * size:
            return f"{seconds / size:.2g} {unit}" if seconds < 100.0 * size else f"{seconds / size:.3g} {unit}"
    return f"{max(1.0, seconds):.0f} s"


def size_of(runs: Sequence[AnyRun], stored: int) -> str:
    """The size of a campaign in words."""
    counts = (
        (len({run.case for run in runs}), runs[0].measure.case),
        (len({run.solver for run in runs}), "solver"),
        (len({run.seed for run in runs}), "seed"),
    )
    parts = ", ".join(f"{count} {noun}{'s' * (count != 1)}" for count, noun in counts)
    total = len({run.key for run in runs})
    return f"{total} runs ({parts})" + (f", {stored} of them stored already" if stored else "")


class State:
    """How far a campaign is.

    Args:
        runs: to be done.
        round_size: runs after which the time that they took says something about the others.
        estimate: seconds for all of them; None if unknown.
    """

    def __init__(self, runs: int, round_size: int, estimate: float | None) -> None:
        self.runs, self.round_size, self.estimate = runs, round_size, estimate
        self.done = self.failed = 0
        self.began = time.perf_counter()

    def advance(self, outcome: Outcome) -> None:
        """Count a run that has ended."""
        self.done += 1
        self.failed += bool(outcome.error)

    def left(self) -> float | None:
        """Seconds that the rest may take; None if unknown."""
        remaining = self.runs - self.done
        if self.done >= self.round_size:
            return (time.perf_counter() - self.began) / self.done * remaining
        return None if self.estimate is None else self.estimate * remaining / self.runs

    def words(self) -> str:
        """Failures, and the remaining time."""
        left = self.left()
        failures = f"{self.failed} failed, " if self.failed else ""
        return failures + ("" if left is None else f"about {duration(left)} left")

    def line(self) -> str:
        """All of it."""
        elapsed = duration(time.perf_counter() - self.began)
        return f"{self.done} of {self.runs} runs after {elapsed}, {self.words()}".rstrip(", ")


@contextmanager
def campaign_progress(state: State, quiet: bool) -> Iterator[Callable[[Outcome], object]]:
    """Progress over all runs; yields the callback that advances it."""
    console = Console(stderr=True, quiet=quiet)
    shown = nullcontext(state.advance) if quiet else _bar(state, console) if console.is_terminal else _lines(state)
    with shown as advance:
        yield advance


@contextmanager
def _bar(state: State, console: Console) -> Iterator[Callable[[Outcome], object]]:
    columns = TextColumn("runs"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[words]}", markup=False)
    with Progress(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("runs", total=state.runs, words=state.words())

        def advance(outcome: Outcome) -> None:
            state.advance(outcome)
            progress.update(bar, advance=1, words=state.words())

        yield advance


@contextmanager
def _lines(state: State) -> Iterator[Callable[[Outcome], object]]:
    with _every(LINE_SECONDS, lambda: say(state.line())):
        yield state.advance


@contextmanager
def _every(seconds: float, tell: Callable[[], object]) -> Iterator[None]:
    """Call a function every so many seconds, the first time after these, in a thread."""
    ended = Event()

    def work() -> None:
        while not ended.wait(seconds):
            tell()

    thread = Thread(target=work, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@contextmanager
def phase(name: str, quiet: bool) -> Iterator[None]:
    """Say what is being done: a spinner on a terminal, elsewhere plain lines if it takes long."""
    console = Console(stderr=True, quiet=quiet)
    if quiet:
        yield
    elif console.is_terminal:
        with console.status(name):
            yield
    else:
        with _every(LINE_SECONDS, lambda: say(name)):
            yield


def say(line: str) -> None:
    """Print a line on standard error."""
    print(line, file=sys.stderr, flush=True)
