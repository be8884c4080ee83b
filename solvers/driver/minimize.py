"""The driver of all metaheuristics: everything of a search that is not its algorithm.

Counts evaluations and iterations, keeps the best and the history, turns the seed into a generator, calls back,
and stops: when the budget is spent, at Ctrl-C, or when the solver has nothing more to try.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from solvers.box import Box, FloatArray
from solvers.driver.archive import Archive
from solvers.driver.budget import Budget, StopReason, Usage
from solvers.driver.interruption import Interruption, deferred_interrupt
from solvers.driver.iterations import Iterations
from solvers.driver.result import History, Result, Status
from solvers.solver import Solver
from solvers.traits import Steps

Cost = Callable[[FloatArray], FloatArray]


def minimize(
    cost: Cost,
    box: Box,
    solver: Solver,
    budget: Budget,
    seed: int | np.random.Generator,
    callback: Callable[[Status], object] | None = None,
    archive: Archive | None = None,
    known: FloatArray | None = None,
) -> Result:
    """Search a box for the lowest cost.

    Args:
        cost: evaluates candidates (m, d) -> (m,). NaN and infinite costs count as worst.
        box: where to search.
        solver: the algorithm.
        budget: how long.
        seed: of the search's own random generator, or a generator to draw from.
        callback: gets the status after the initial population and after every iteration.
        archive: collects good candidates that differ from each other.
        known: candidates (m, d), clipped to the box, that take the first places of the initial population: what a
            search of almost the same cost has found, say. A solver without a population begins at the first.

    Returns:
        The best candidate and the record of the search. After Ctrl-C too, with ``StopReason.INTERRUPTED``: the
        search stops once the current batch is evaluated.

    Raises:
        ValueError: a candidate outside the box, or costs that do not match the candidates (a solver's bug); known
            candidates that are not (m, d).
    """
    with deferred_interrupt() as interruption:
        run = _Run(cost, box.with_known(known), budget, interruption, solver.steps, callback, archive)
        run.drive(solver, np.random.default_rng(seed))
    return run.result(seed if not isinstance(seed, np.random.Generator) else None)


@dataclass
class _Run:
    """The state of one search."""

    objective: Cost
    box: Box
    budget: Budget
    interruption: Interruption
    steps: Steps
    callback: Callable[[Status], object] | None
    archive: Archive | None
    evaluations: int = 0
    iterations: int = -1  # completed; the initial population is iteration 0
    cost: float = np.inf
    x: FloatArray | None = None
    last_improvement: int = 0  # iteration
    start_time: float = field(default_factory=time.perf_counter)
    stop_reason: StopReason | None = None
    records: list[tuple[int, float, FloatArray]] = field(default_factory=list)

    def drive(self, solver: Solver, rng: np.random.Generator) -> None:
        """Run the solver's generator until a criterion stops it."""
        search = solver.search(self.box, rng, Iterations(self._iterations(), self.budget.evaluations))
        try:
            candidates = next(search)
            while True:
                costs = self._evaluate(candidates)
                if self.stop_reason is not None:
                    break
                candidates = search.send(costs)
        except StopIteration:
            self.stop_reason = self.stop_reason or StopReason.EXHAUSTED
        finally:
            search.close()
        self._record()

    def _iterations(self) -> Iterator[float]:
        """The solver's loop: each turn completes the iteration before it."""
        while True:
            self.iterations += 1
            self._record()
            usage = self._usage()
            self.stop_reason = self.budget.reached(usage)
            if self.stop_reason is not None:
                return
            yield self.budget.share_used(usage)

    def _evaluate(self, candidates: FloatArray) -> FloatArray:
        """Costs of candidates (m, d), as many as the budget allows; the rest are inf. (m,)."""
        if ((candidates < self.box.lower) | (candidates > self.box.upper)).any():
            raise ValueError("a solver left its box")
        allowed = len(candidates)
        if self.budget.evaluations is not None:
            allowed = min(allowed, self.budget.evaluations - self.evaluations)
        costs = np.full(len(candidates), np.inf)
        values = np.asarray(self.objective(candidates[:allowed]), dtype=np.float64)
        if values.shape != (allowed,):
            raise ValueError(f"costs of shape {values.shape} for {allowed} candidates")
        costs[:allowed] = np.where(np.isfinite(values), values, np.inf)
        self.evaluations += allowed
        self._keep_best(candidates, costs)
        self.stop_reason = self.budget.reached(self._usage(refused=len(candidates) - allowed))
        return costs

    def _keep_best(self, candidates: FloatArray, costs: FloatArray) -> None:
        best = int(np.argmin(costs))
        if self.x is None or costs[best] < self.cost:
            self.cost, self.x = float(costs[best]), candidates[best].copy()
            self.last_improvement = self.iterations + 1
        if self.archive is not None:
            self.archive.add(candidates, costs)

    def _usage(self, refused: int = 0) -> Usage:
        """What is used, given how many evaluations of the last batch the budget did not allow."""
        return Usage(
            evaluations=self.evaluations,
            requested=self.evaluations + refused,
            iterations=max(self.iterations, 0),
            seconds=self.seconds,
            cost=self.cost,
            unimproved=self.iterations - self.last_improvement,
            interrupted=self.interruption.requested,
        )

    @property
    def seconds(self) -> float:
        return time.perf_counter() - self.start_time

    def _record(self) -> None:
        """Add to the history and call back, unless nothing was evaluated since the last time."""
        assert self.x is not None
        if self.records and self.records[-1][0] == self.evaluations:
            return
        self.records.append((self.evaluations, self.cost, self.x))
        if self.callback is not None:
            self.callback(Status.of(self._usage(), self.budget, self.steps))

    def result(self, seed: int | None) -> Result:
        assert self.x is not None and self.stop_reason is not None
        return Result(
            x=self.x,
            cost=self.cost,
            evaluations=self.evaluations,
            iterations=max(self.iterations, 0),
            seconds=self.seconds,
            seed=seed,
            stop_reason=self.stop_reason,
            history=History.of(self.records, self.steps),
        )
