"""The driver of every search: best so far, history, budget, seed, interruption.

Counts evaluations and iterations, keeps the best and the history, calls back, and ends: when the budget is spent, at
Ctrl-C, or when the solver has nothing more to try. Who evaluates the candidates is not its concern.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import ClassVar, TypeVar

import numpy as np

from solvers.budget import Budget, Interruption, StopReason, Usage, deferred_interrupt
from solvers.solver import ITERATIONS, FloatArray, Iterations, SearchBox, Solver, Steps, checked_candidates


@dataclass(frozen=True, kw_only=True)
class ArchiveSettings:
    """Settings of the archive of good candidates that differ.

    Values are chosen.

    Attributes:
        capacity: candidates.
        candidates_per_batch: best candidates of each batch that are considered.
        niche_width: share of the box: of two candidates closer than that in every coordinate the better is
            retained.
    """

    capacity: int = 64
    candidates_per_batch: int = 4
    niche_width: float = 0.1


ARCHIVE_SETTINGS = ArchiveSettings()


class Archive:
    """The best candidates of a search, none close to a better one; the best first.

    Attributes:
        x: candidates, (n, d).
        cost: of them, (n,), ascending.

    Args:
        box: of the search.
    """

    def __init__(self, box: SearchBox) -> None:
        self._box = box
        self.x: FloatArray = np.empty((0, box.dimension))
        self.cost: FloatArray = np.empty(0)

    def add(self, candidates: FloatArray, cost: FloatArray) -> None:
        """Add the best of a batch that differ: candidates (m, d), costs (m,)."""
        span = np.where(self._box.span > 0.0, self._box.span, 1.0)
        for i in np.argsort(cost, kind="stable")[: ARCHIVE_SETTINGS.candidates_per_batch]:
            full = self.cost.size >= ARCHIVE_SETTINGS.capacity
            if not np.isfinite(cost[i]) or (full and cost[i] >= self.cost[-1]):
                return
            close = (np.abs(self.x - candidates[i]) < ARCHIVE_SETTINGS.niche_width * span).all(axis=1)
            if (self.cost[close] <= cost[i]).any():
                continue
            x = np.vstack([self.x[~close], candidates[i]])
            costs = np.append(self.cost[~close], cost[i])
            order = np.argsort(costs, kind="stable")[: ARCHIVE_SETTINGS.capacity]
            self.x, self.cost = x[order], costs[order]


MOST_SHOWN = 6  # numbers of a candidate, in the short form of a result


@dataclass(frozen=True, kw_only=True)
class Status:
    """The state of a running search, given to a callback after each iteration.

    Attributes:
        evaluations: done.
        iterations: completed.
        seconds: since the start.
        cost: the lowest so far.
        progress: share of the budget used, from 0 to 1.
        steps: what an iteration is.
    """

    evaluations: int
    iterations: int
    seconds: float
    cost: float
    progress: float
    steps: Steps

    @classmethod
    def of(cls, usage: Usage, budget: Budget, steps: Steps) -> Status:
        """The status of a search that has used so much of its budget."""
        return cls(
            evaluations=usage.evaluations,
            iterations=usage.iterations,
            seconds=usage.seconds,
            cost=usage.cost,
            progress=budget.share_used(usage),
            steps=steps,
        )


@dataclass(frozen=True, kw_only=True)
class History:
    """The best so far after each step of a search.

    Attributes:
        evaluations: done, (n,).
        cost: the lowest, (n,).
        best: its candidate, (n, d).
        steps: what a step is.
    """

    evaluations: FloatArray
    cost: FloatArray
    best: FloatArray
    steps: Steps

    @classmethod
    def of(cls, records: list[tuple[int, float, FloatArray]], steps: Steps) -> History:
        """The history of one record a step: evaluations, cost, candidate (d,)."""
        evaluations, cost, best = (np.array(column) for column in zip(*records, strict=True))
        return cls(evaluations=evaluations, cost=cost, best=best, steps=steps)

    @property
    def numbers(self) -> FloatArray:
        """Numbers of the steps, (n,)."""
        return np.arange(self.steps.first, self.steps.first + len(self.cost), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Result:
    """The outcome of a search and the effort it took.

    Attributes:
        in_program_variables: whether ``x`` holds variables of a smooth program rather than a point of the box.
        x: the best candidate, (d,).
        cost: its cost; inf when no candidate had a finite one, and ``x`` is the first.
        evaluations: done.
        iterations: completed iterations of the solver's loop.
        seconds: wall-clock time of the search.
        seed: as given; None when a generator was.
        stop_reason: which criterion ended the search.
        history: best-so-far, the initial population first.
    """

    in_program_variables: ClassVar[bool] = False

    x: FloatArray
    cost: float
    evaluations: int
    iterations: int
    seconds: float
    seed: int | None
    stop_reason: StopReason
    history: History

    def __repr__(self) -> str:
        shown = ", ".join(f"{value:.6g}" for value in self.x[:MOST_SHOWN])
        more = f", ... {len(self.x)} numbers" if len(self.x) > MOST_SHOWN else ""
        return (
            f"{type(self).__name__}(cost={self.cost:.6g}, x=[{shown}{more}], evaluations={self.evaluations}, "
            f"iterations={self.iterations}, seconds={self.seconds:.3g}, seed={self.seed}, "
            f"stop_reason={self.stop_reason.value!r})"
        )


@dataclass(frozen=True, kw_only=True, repr=False)
class Unsearched(Result):
    """The result without a search, where something as good is known. ``x`` is empty."""

    in_program_variables: ClassVar[bool] = True


def unsearched(cost: float, seconds: float, seed: int | None, reason: StopReason = StopReason.TARGET) -> Unsearched:
    """The result where something is known without a search.

    Args:
        cost: of it.
        seconds: that it took to find.
        seed: of what was drawn.
        reason: why there is nothing to search: a lower bound is reached by default.
    """
    return Unsearched(
        x=np.empty(0),
        cost=cost,
        evaluations=0,
        iterations=0,
        seconds=seconds,
        seed=seed,
        stop_reason=reason,
        history=History.of([(0, cost, np.empty(0))], ITERATIONS),
    )


class SearchRun:
    """A search that asks for candidates and is given their costs.

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
        TypeError: the solver's search yields nothing, or no arrays of numbers.
        ValueError: the solver asks for nothing, or its candidates are not (m, d), not finite, or outside the box.
    """

    def __init__(
        self,
        solver: Solver,
        box: SearchBox,
        budget: Budget,
        rng: np.random.Generator,
        interruption: Interruption,
        callback: Callable[[Status], object] | None = None,
        archive: Archive | None = None,
    ) -> None:
        self.solver, self.box, self.budget, self.steps = solver, box, budget, solver.steps
        self.pending: FloatArray | None = None
        self.stop_reason: StopReason | None = None
        self._interruption, self._callback, self._archive = interruption, callback, archive
        self._evaluations = 0
        self._iterations = -1  # completed; the initial population is iteration 0
        self._cost = np.inf
        self._x: FloatArray | None = None  # of the best; None before anything is evaluated
        self._last_improvement = 0  # iteration
        self._records: list[tuple[int, float, FloatArray]] = []
        self._start_time = time.perf_counter()
        name, search = type(solver).__name__, solver.search(box, rng, Iterations(self._turns(), budget.evaluations))
        if not isinstance(search, Generator):
            raise TypeError(
                f"{name}.search returned an object of type {type(search).__name__}; it has to yield its candidates"
            )
        self._search = search
        try:
            first = next(search)
        except StopIteration:
            raise ValueError(f"{name} asked for no candidate at all") from None
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

    def _ask(self, yielded: object) -> None:
        try:
            candidates = checked_candidates(yielded, self.box, self.solver)
        except (TypeError, ValueError):
            self.close()
            raise
        allowed = len(candidates)
        if self.budget.evaluations is not None:
            allowed = min(allowed, self.budget.evaluations - self._evaluations)
        self._candidates, self.pending = candidates, candidates[:allowed]

    def tell(self, values: FloatArray) -> None:
        """Take the costs (m,) of the pending candidates and go on to the next ones, or to the end.

        NaN and infinite costs count as worst.

        Raises:
            TypeError: the solver's next candidates are no array of numbers.
            ValueError: not one cost a candidate; or the next candidates are not (m, d), not finite, or outside the box.
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

    def fail(self, costs: FloatArray | None = None) -> None:
        """End the search where something has raised; nobody is called back.

        Args:
            costs: of the first of the pending candidates, (k,), if some were evaluated before.
        """
        if self.pending is not None and costs is not None and costs.size:
            self._evaluations += costs.size
            self._keep_best(self.pending[: costs.size], np.where(np.isfinite(costs), costs, np.inf))
        self.stop_reason, self.pending = StopReason.ERROR, None
        self.close()
        self._remember()

    def close(self) -> None:
        """Free what the solver uses, such as a thread; a search that was closed cannot go on."""
        self._search.close()

    def _end(self) -> None:
        self.pending = None
        self.close()
        self._record()

    def _keep_best(self, candidates: FloatArray, costs: FloatArray) -> None:
        best = int(np.argmin(costs))
        if self._x is None or costs[best] < self._cost:
            self._cost, self._x = float(costs[best]), candidates[best].copy()
            self._last_improvement = self._iterations + 1
        if self._archive is not None:
            self._archive.add(candidates, costs)

    def _usage(self, refused: int = 0) -> Usage:
        """The effort so far, given how many evaluations of the last batch the budget did not allow."""
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
        """The state of the search: effort, lowest cost, progress."""
        return Status.of(self._usage(), self.budget, self.steps)

    def _remember(self) -> bool:
        """Add to the history; False where nothing was evaluated since the last time."""
        before = self._records[-1][0] if self._records else 0
        if self._x is None or before == self._evaluations:
            return False
        self._records.append((self._evaluations, self._cost, self._x))
        return True

    def _record(self) -> None:
        """Add to the history and call back, unless nothing was evaluated since the last time."""
        if self._remember() and self._callback is not None:
            self._callback(self.status)

    @property
    def has_candidate(self) -> bool:
        """Whether anything has been evaluated."""
        return self._x is not None

    def result(self, seed: int | None) -> Result:
        """The outcome of a search that has ended, with a candidate; ``seed`` is for the record."""
        assert self.stop_reason is not None and self._x is not None
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


BEST_SO_FAR = "best_so_far"  # attribute of an exception that ended a search
T = TypeVar("T")


def keep_best(error: BaseException, found: object) -> None:
    """Attach the best that was found to an exception, as its attribute ``best_so_far``."""
    setattr(error, BEST_SO_FAR, found)
    note = f"what was found before is its attribute {BEST_SO_FAR}"
    if note not in getattr(error, "__notes__", ()):
        error.add_note(note)


def best_so_far(error: BaseException, kind: type[T]) -> T | None:
    """The object that :func:`keep_best` attached to an exception; None where there is none of this kind."""
    found = getattr(error, BEST_SO_FAR, None)
    return found if isinstance(found, kind) else None


Cost = Callable[[FloatArray], FloatArray]


def minimize(
    cost: Cost,
    box: SearchBox,
    solver: Solver,
    budget: Budget,
    seed: int | np.random.Generator,
    callback: Callable[[Status], object] | None = None,
    archive: Archive | None = None,
    known: FloatArray | None = None,
) -> Result:
    """Search a box for the lowest cost.

    Args:
        cost: evaluates candidates (m, d) -> (m,). NaN and infinite costs count as worst. Where it raises, it may
            leave the costs (k,) of the first of them in the exception by :func:`keep_best`.
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
        TypeError: the solver yields no arrays of numbers.
        ValueError: its candidates are not (m, d), not finite or outside the box; costs that do not match them; known
            candidates that are not (m, d).
        BaseException: whatever cost, callback and solver raise. Once there is a candidate, the exception's attribute
            ``best_so_far`` is the result until then, with ``StopReason.ERROR``.
    """
    started, number = box.with_known(known), seed if not isinstance(seed, np.random.Generator) else None
    with deferred_interrupt() as interruption:
        run = SearchRun(solver, started, budget, np.random.default_rng(seed), interruption, callback, archive)
        try:
            while run.pending is not None:
                run.tell(np.asarray(cost(run.pending), dtype=np.float64))
        except BaseException as error:
            run.fail(best_so_far(error, np.ndarray))
            if run.has_candidate or hasattr(error, BEST_SO_FAR):  # which may be of a search within the cost
                keep_best(error, run.result(number) if run.has_candidate else None)
            raise
        finally:
            run.close()
    return run.result(number)
