"""The driver: everything of a search that is not its algorithm.

Counts evaluations and iterations, keeps the best and the history, turns the seed into a generator, calls back,
and stops: when the budget is spent, at Ctrl-C, or when the solver has nothing more to try.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from solvers.archive import Archive
from solvers.box import Box, FloatArray
from solvers.budget import Budget, StopReason
from solvers.solver import Solver

Cost = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Status:
    """Where a search stands; what a callback gets after each iteration."""

    evaluations: int
    iterations: int
    seconds: float
    cost: float
    progress: float


@dataclass(frozen=True)
class History:
    """Best-so-far after each iteration, all (n,): evaluations, best cost; and the best candidates (n, d)."""

    evaluations: FloatArray
    cost: FloatArray
    best: FloatArray


@dataclass(frozen=True)
class Result:
    """What a search found and what it took.

    Attributes:
        x: the best candidate, (d,).
        cost: its cost; inf when no candidate could be priced.
        evaluations: candidates priced.
        iterations: completed iterations of the solver's loop.
        seconds: wall-clock time of the search.
        seed: as given; None when a generator was.
        stop_reason: which criterion ended the search.
        history: best-so-far, the initial population first.
    """

    x: FloatArray
    cost: float
    evaluations: int
    iterations: int
    seconds: float
    seed: int | None
    stop_reason: StopReason
    history: History


def minimize(
    cost: Cost,
    box: Box,
    solver: Solver,
    budget: Budget,
    seed: int | np.random.Generator,
    callback: Callable[[Status], object] | None = None,
    archive: Archive | None = None,
) -> Result:
    """Search a box for the lowest cost.

    Args:
        cost: prices candidates (m, d) -> (m,). NaN and infinite costs count as worst.
        box: where to search.
        solver: how.
        budget: how long.
        seed: of the search's own random generator, or a generator to go on with.
        callback: gets the status after the initial population and after every iteration.
        archive: collects good candidates that differ from each other.

    Returns:
        The best candidate and the record of the search. After Ctrl-C too, with ``StopReason.INTERRUPTED``: the
        signal is held back until the batch at hand is priced.

    Raises:
        ValueError: a candidate outside the box, or costs that do not match the candidates (a solver's bug).
    """
    run = _Run(cost, box, budget, callback, archive)
    with deferred_interrupt(run):
        run.follow(solver, np.random.default_rng(seed))
    return run.result(seed if not isinstance(seed, np.random.Generator) else None)


@dataclass
class _Run:
    """The state of one search."""

    objective: Cost
    box: Box
    budget: Budget
    callback: Callable[[Status], object] | None
    archive: Archive | None
    evaluations: int = 0
    iterations: int = -1  # the initial population completes iteration 0
    cost: float = np.inf
    x: FloatArray | None = None
    last_improvement: int = 0
    interrupted: bool = False
    started: float = field(default_factory=time.perf_counter)
    stop_reason: StopReason | None = None
    records: list[tuple[int, float, FloatArray]] = field(default_factory=list)

    def follow(self, solver: Solver, rng: np.random.Generator) -> None:
        """Run the solver's generator until something stops it."""
        search = solver.search(self.box, rng, self._iterations())
        try:
            candidates = next(search)
            while True:
                costs = self._price(candidates)
                if self.stop_reason is not None:
                    break
                candidates = search.send(costs)
        except StopIteration:
            self.stop_reason = self.stop_reason or StopReason.EXHAUSTED
        finally:
            search.close()
        self._record()

    def _iterations(self) -> Iterator[float]:
        """Given to the solver: each turn closes the iteration before it."""
        while True:
            self.iterations += 1
            self._record()
            self.stop_reason = self._spent_iterations()
            if self.stop_reason is not None:
                return
            yield self.progress

    def _price(self, candidates: FloatArray) -> FloatArray:
        """Costs of candidates, as many as the budget allows; the rest are inf."""
        if ((candidates < self.box.lower) | (candidates > self.box.upper)).any():
            raise ValueError("a solver left its box")
        left = len(candidates)
        if self.budget.evaluations is not None:
            left = min(left, self.budget.evaluations - self.evaluations)
        costs = np.full(len(candidates), np.inf)
        priced = np.asarray(self.objective(candidates[:left]), dtype=np.float64)
        if priced.shape != (left,):
            raise ValueError(f"costs of shape {priced.shape} for {left} candidates")
        costs[:left] = np.where(np.isfinite(priced), priced, np.inf)
        self.evaluations += left
        best = int(np.argmin(costs))
        if self.x is None or costs[best] < self.cost:
            self.cost, self.x = float(costs[best]), candidates[best].copy()
            self.last_improvement = self.iterations + 1
        if self.archive is not None:
            self.archive.add(candidates, costs)
        self.stop_reason = self._spent(cut_short=left < len(candidates))
        return costs

    def _spent(self, cut_short: bool) -> StopReason | None:
        budget = self.budget
        if self.interrupted:
            return StopReason.INTERRUPTED
        if budget.target is not None and self.cost <= budget.target:
            return StopReason.TARGET
        if cut_short:
            return StopReason.EVALUATIONS
        if budget.seconds is not None and self.seconds >= budget.seconds:
            return StopReason.SECONDS
        return None

    def _spent_iterations(self) -> StopReason | None:
        if self.budget.iterations is not None and self.iterations >= self.budget.iterations:
            return StopReason.ITERATIONS
        stagnation = self.budget.stagnation
        if stagnation is not None and self.iterations - self.last_improvement >= stagnation:
            return StopReason.STAGNATION
        return None

    @property
    def seconds(self) -> float:
        return time.perf_counter() - self.started

    @property
    def progress(self) -> float:
        """Share of the budget used; the clock counts only when nothing repeatable limits the search."""
        shares = []
        if self.budget.evaluations is not None:
            shares.append(self.evaluations / self.budget.evaluations)
        if self.budget.iterations is not None:
            shares.append(self.iterations / self.budget.iterations)
        if not shares and self.budget.seconds is not None:
            shares.append(self.seconds / self.budget.seconds)
        return min(1.0, max(shares))

    def _record(self) -> None:
        assert self.x is not None
        if self.records and self.records[-1][0] == self.evaluations:
            return
        self.records.append((self.evaluations, self.cost, self.x))
        if self.callback is not None:
            status = Status(self.evaluations, max(self.iterations, 0), self.seconds, self.cost, self.progress)
            self.callback(status)

    def result(self, seed: int | None) -> Result:
        assert self.x is not None and self.stop_reason is not None
        evaluations, costs, best = zip(*self.records, strict=True)
        history = History(np.array(evaluations), np.array(costs), np.array(best))
        counts = self.evaluations, max(self.iterations, 0)
        return Result(self.x, self.cost, *counts, self.seconds, seed, self.stop_reason, history)


class Interruptible(Protocol):
    """What looks at ``interrupted`` now and then."""

    interrupted: bool


@contextmanager
def deferred_interrupt(run: Interruptible) -> Iterator[None]:
    """Turn the first Ctrl-C into a request to stop; a second one interrupts as usual. Who ignores it goes on to."""
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is signal.SIG_IGN:
        yield
        return

    def request(number: int, frame: object) -> None:
        run.interrupted = True
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, request)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
