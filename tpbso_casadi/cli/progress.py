"""What is said on standard error while a command works: a bar on a terminal, plain lines at intervals elsewhere."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from threading import Event, Thread
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, SpinnerColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from problems import Problem
from problems.base import listening
from solvers import STARTS, Status
from tpbso_casadi.display.console import OutputConsole
from tpbso_casadi.planning import INFEASIBLE_MERIT, Progress

if TYPE_CHECKING:
    from tpbso_casadi.judging.run import AnyRun, Outcome

INTERVAL = 10.0  # s between plain lines


@contextmanager
def planning_progress(problem: Problem[Any] | None, quiet: bool) -> Iterator[Progress]:
    """The callbacks that show on standard error what is being done; nothing where it is to be quiet."""
    console = OutputConsole(stderr=True, quiet=quiet)
    if quiet:
        yield Progress()
    else:
        with (_bars if console.is_terminal else _lines)(problem, console) as progress:
            yield progress


@contextmanager
def _bars(problem: Problem[Any] | None, console: OutputConsole) -> Iterator[Progress]:
    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[best]}")
    with Bars(*columns, TimeRemainingColumn(), console=console, transient=True) as bars:
        bar = bars.add_task("modelling", total=None, best="")

        def phase(name: str) -> None:
            bars.reset(bar, description=name, total=None, best="")

        def show(status: Status) -> None:
            bars.update(bar, total=1.0, completed=status.progress, best=summary(status, problem))

        def step(work: str, done: int, total: int) -> None:
            bars.update(bar, description=work, total=total, completed=done, best="")

        with listening(step):
            yield Progress(show, phase)


@contextmanager
def _lines(problem: Problem[Any] | None, console: OutputConsole) -> Iterator[Progress]:
    """A line when ``INTERVAL`` seconds have passed since the last; short commands print none."""
    told, current = time.monotonic(), "modelling"

    def tell(text: str) -> None:
        nonlocal told
        if time.monotonic() - told > INTERVAL:
            console.print(text, markup=False, soft_wrap=True)
            told = time.monotonic()

    def phase(name: str) -> None:
        nonlocal current
        current = name
        tell(name)

    def show(status: Status) -> None:
        tell(f"{current}: {status.progress:.0%} of the budget, {summary(status, problem)}")

    with listening(lambda work, done, total: tell(f"{work}: {done} of {total}")):
        yield Progress(show, phase)


def summary(status: Status, problem: Problem[Any] | None) -> str:
    """The best so far and the effort, in a few words."""
    if problem is None:
        return ""
    objective = problem.criteria.objective
    feasible = status.cost < (INFEASIBLE_MERIT if status.steps is STARTS else problem.objective_upper_bound)
    best = f"{objective.name} {status.cost:.4g} {objective.unit}" if feasible else "nothing feasible yet"
    effort = f"start {status.iterations}" if status.steps is STARTS else f"{status.evaluations} evaluations"
    return f"{best}, {effort}"


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

    The first search of a case in each worker builds and compiles the model, so these say nothing about the time of the
    others; the last one of a solver on a case says how long its next ones take.

    Args:
        pending: runs to be done.
        workers: that do them, a run at a time each.
    """

    def __init__(self, pending: Sequence[AnyRun], workers: int) -> None:
        self.runs, self.workers = len(pending), workers
        self.done = self.failed = 0
        self.began = time.perf_counter()
        self._remaining = Counter((run.case, run.solver) for run in pending)
        self._searches: dict[str, set[str]] = {}  # by case, those that have ended
        self._seconds: dict[tuple[str, str], float] = {}  # of a run of a case by a solver

    def advance(self, run: AnyRun, outcome: Outcome) -> None:
        """Count a run that has ended."""
        self.done += 1
        self.failed += bool(outcome.error)
        kind, ended = (run.case, run.solver), self._searches.setdefault(run.case, set())
        self._remaining[kind] -= 1
        ended.add(run.search)
        if len(ended) > self.workers:
            self._seconds[kind] = outcome.seconds - outcome.seconds_saved

    def left(self) -> float | None:
        """Seconds that the rest may take; None before there was a run of each kind in a worker that knew the model."""
        remaining = {kind: number for kind, number in self._remaining.items() if number}
        if not remaining.keys() <= self._seconds.keys():
            return None
        work = sum(number * self._seconds[kind] for kind, number in remaining.items())
        return work / max(1, min(self.workers, sum(remaining.values())))

    def words(self) -> str:
        """Failures, and the remaining time."""
        left = self.left()
        failures = f"{self.failed} failed, " if self.failed else ""
        return failures + ("" if left is None else f"about {duration(left)} left")

    def line(self) -> str:
        """The progress in one line."""
        elapsed = duration(time.perf_counter() - self.began)
        return f"{self.done} of {self.runs} runs after {elapsed}, {self.words()}".rstrip(", ")


@contextmanager
def campaign_progress(state: State, quiet: bool) -> Iterator[Callable[[AnyRun, Outcome], object]]:
    """Progress over all runs; yields the callback that advances it."""
    console = Console(stderr=True, quiet=quiet)
    if quiet:
        yield state.advance
    elif console.is_terminal:
        with _campaign_bar(state, console) as advance:
            yield advance
    else:
        with _every(LINE_SECONDS, lambda: say(state.line())):
            yield state.advance


@contextmanager
def _campaign_bar(state: State, console: Console) -> Iterator[Callable[[AnyRun, Outcome], object]]:
    columns = TextColumn("runs"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[words]}", markup=False)
    with Bars(*columns, console=console, transient=True) as progress:
        bar = progress.add_task("runs", total=state.runs, words=state.words())

        def advance(run: AnyRun, outcome: Outcome) -> None:
            state.advance(run, outcome)
            progress.update(bar, advance=1, words=state.words())

        yield advance


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
