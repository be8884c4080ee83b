"""One search, step by step: everything of it that is not its algorithm.

Counts evaluations and iterations, keeps the best and the history, calls back, and ends: when the budget is spent, at
Ctrl-C, or when the solver has nothing more to try. Who evaluates the candidates is not its concern.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from solvers.box import Box, FloatArray
from solvers.driver.archive import Archive
from solvers.driver.budget import Budget, StopReason, Usage
from solvers.driver.interruption import Interruption
from solvers.driver.iterations import Iterations
from solvers.driver.result import History, Result, Status
from solvers.solver import Solver


class SearchRun:
    """A search that says which candidates it needs and is told their costs.

    Args:
        solver: the algorithm.
        box: where to search.
        budget: how long.
        rng: of the search.
        interruption: says whether the user wants it to end.
        callback: gets the status after the initial population and after every iteration.
        archive: collects good candidates that differ from each other.

    Attributes:
        pending: candidates (m, d) to be evaluated next, as many as the budget allows; None once the search has ended.
        stop_reason: which criterion ended it; None before.

    Raises:
        ValueError: the solver left its box, or asks for nothing.
    """

    def __init__(
        self,
        solver: Solver,
        box: Box,
        budget: Budget,
        rng: np.random.Generator,
        interruption: Interruption,
        callback: Callable[[Status], object] | None = None,
        archive: Archive | None = None,
    ) -> None:
        self.box, self.budget, self.steps = box, budget, solver.steps
        self.pending: FloatArray | None = None
        self.stop_reason: StopReason | None = None
        self._interruption, self._callback, self._archive = interruption, callback, archive
        self._evaluations = 0
        self._iterations = -1  # completed; the initial population is iteration 0
        self._cost, self._x = np.inf, np.full(box.dimension, np.nan)
        self._last_improvement = 0  # iteration
        self._records: list[tuple[int, float, FloatArray]] = []
        self._start_time = time.perf_counter()
        self._search = solver.search(box, rng, Iterations(self._turns(), budget.evaluations))
        first = next(self._search, None)
        if first is None:
            raise ValueError("a solver asked for no candidate at all")
        self._ask(first)

    def _turns(self) -> Iterator[float]:
        """The solver's loop: each turn completes the iteration before it."""
        while True:
            self._iterations += 1
            self._record()
            usage = self._usage()
            self.stop_reason = self.budget.reached(usage)
            if self.stop_reason is not None:
                return
            yield self.budget.share_used(usage)

    def _ask(self, candidates: FloatArray) -> None:
        if ((candidates < self.box.lower) | (candidates > self.box.upper)).any():
            self._search.close()
            raise ValueError("a solver left its box")
        allowed = len(candidates)
        if self.budget.evaluations is not None:
            allowed = min(allowed, self.budget.evaluations - self._evaluations)
        self._candidates, self.pending = candidates, candidates[:allowed]

    def tell(self, values: FloatArray) -> None:
        """Take the costs (m,) of the pending candidates and go on to the next ones, or to the end.

        NaN and infinite costs count as worst.

        Raises:
            ValueError: not one cost a candidate, or the solver left its box.
        """
        assert self.pending is not None
        candidates, allowed = self._candidates, len(self.pending)
        if values.shape != (allowed,):
            raise ValueError(f"costs of shape {values.shape} for {allowed} candidates")
        costs = np.full(len(candidates), np.inf)
        costs[:allowed] = np.where(np.isfinite(values), values, np.inf)
        self._evaluations += allowed
        self._keep_best(candidates, costs)
        self.stop_reason = self.budget.reached(self._usage(refused=len(candidates) - allowed))
        if self.stop_reason is not None:
            return self._end()
        try:
            self._ask(self._search.send(costs))
        except StopIteration:
            self.stop_reason = self.stop_reason or StopReason.EXHAUSTED
            self._end()

    def stop(self, reason: StopReason) -> None:
        """End the search before its budget is spent."""
        self.stop_reason = reason
        self._end()

    def close(self) -> None:
        """Free what the solver holds, a thread say; a search that was closed cannot go on."""
        self._search.close()

    def _end(self) -> None:
        self.pending = None
        self.close()
        self._record()

    def _keep_best(self, candidates: FloatArray, costs: FloatArray) -> None:
        best = int(np.argmin(costs))
        if np.isnan(self._x[0]) or costs[best] < self._cost:
            self._cost, self._x = float(costs[best]), candidates[best].copy()
            self._last_improvement = self._iterations + 1
        if self._archive is not None:
            self._archive.add(candidates, costs)

    def _usage(self, refused: int = 0) -> Usage:
        """What is used, given how many evaluations of the last batch the budget did not allow."""
        return Usage(
            evaluations=self._evaluations,
            requested=self._evaluations + refused,
            iterations=max(self._iterations, 0),
            seconds=time.perf_counter() - self._start_time,
            cost=self._cost,
            unimproved=self._iterations - self._last_improvement,
            interrupted=self._interruption.requested,
        )

    @property
    def status(self) -> Status:
        """How far the search is."""
        return Status.of(self._usage(), self.budget, self.steps)

    def _record(self) -> None:
        """Add to the history and call back, unless nothing was evaluated since the last time."""
        if self._records and self._records[-1][0] == self._evaluations:
            return
        self._records.append((self._evaluations, self._cost, self._x))
        if self._callback is not None:
            self._callback(self.status)

    def result(self, seed: int | None) -> Result:
        """The outcome of a search that has ended; ``seed`` is for the record."""
        assert self.stop_reason is not None
        return Result(
            x=self._x,
            cost=self._cost,
            evaluations=self._evaluations,
            iterations=max(self._iterations, 0),
            seconds=time.perf_counter() - self._start_time,
            seed=seed,
            stop_reason=self.stop_reason,
            history=History.of(self._records, self.steps),
        )
