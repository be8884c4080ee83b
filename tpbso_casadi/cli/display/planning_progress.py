"""What a command is doing: a bar on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from problems import Problem
from solvers import Status
from solvers.traits import STARTS
from tpbso_casadi.cli.display.console import OutputConsole
from tpbso_casadi.planning.motion import INFEASIBLE_MERIT
from tpbso_casadi.planning.progress import Progress

INTERVAL = 10.0  # s between plain lines


@contextmanager
def planning_progress(problem: Problem[Any] | None, quiet: bool) -> Iterator[Progress]:
    """The callbacks that show on standard error what is being done; nothing where it is to be quiet."""
    console = OutputConsole(stderr=True, quiet=quiet)
    if quiet:
        yield Progress()
    elif console.is_terminal:
        with _bars(problem, console) as progress:
            yield progress
    else:
        yield _lines(problem, console)


@contextmanager
def _bars(problem: Problem[Any] | None, console: OutputConsole) -> Iterator[Progress]:
    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[best]}")
    with Bars(*columns, TimeRemainingColumn(), console=console, transient=True) as bars:
        bar = bars.add_task("modelling", total=None, best="")

        def phase(name: str) -> None:
            bars.reset(bar, description=name, total=None, best="")

        def show(status: Status) -> None:
            bars.update(bar, total=1.0, completed=status.progress, best=summary(status, problem))

        yield Progress(show, phase)


def _lines(problem: Problem[Any] | None, console: OutputConsole) -> Progress:
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

    return Progress(show, phase)


def summary(status: Status, problem: Problem[Any] | None) -> str:
    """The best so far and the effort, in a few words."""
    if problem is None:
        return ""
    objective = problem.objective
    feasible = status.cost < (INFEASIBLE_MERIT if status.steps is STARTS else problem.objective_upper_bound)
    best = f"{objective.name} {status.cost:.4g} {objective.unit}" if feasible else "nothing feasible yet"
    effort = f"start {status.iterations}" if status.steps is STARTS else f"{status.evaluations} evaluations"
    return f"{best}, {effort}"
