"""A campaign: its size in seconds, and its runs, each stored when it ends."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager, suppress
from itertools import chain
from typing import TypeVar

import numpy as np

from solvers import AnySolver, Budget
from tpbso_casadi.judging.executors import ExecutorFactory, LostExecutor, run_together
from tpbso_casadi.judging.run import AnyRun, AnyRunT, Outcome, failed
from tpbso_casadi.judging.store import RunStore

POPULATION = BATCH = 32  # candidates; where a solver chooses its population itself, too
DESCENT_CANDIDATES = (2_000, 9_000)  # of which a descent by IPOPT takes the time: measured on seven cases
PROCESS_SECONDS = (1.0, 4.0)  # until a process works: modules, models
SOLVER_SECONDS = 5e-6  # that a solver itself takes for a candidate
MEASURED: dict[tuple[str, str | None], float] = {}  # seconds of a candidate, by what is searched and the backend
ITERATION_CANDIDATES = 3  # of each member of a population, at most: a beetle has two antennae


def campaign_seconds(runs: Sequence[AnyRun], workers: int, backend: str | None = None) -> tuple[float, float]:
    """The seconds, at least and at most, that runs take on so many workers, which do nothing else.

    Fewer, if code is not compiled yet but will be.

    Args:
        runs: to be done.
        workers: processes.
        backend: evaluates populations; None for that of the environment.

    Raises:
        Exception: whatever a plug-in raises.
    """
    searches = searches_of(runs)
    together = max(1, min(workers, len(searches)))
    least, most = (
        process + sum(seconds_of(search, descent, backend) for search in searches) / together
        for process, descent in zip(PROCESS_SECONDS, DESCENT_CANDIDATES, strict=True)
    )
    return least, most


def seconds_of(search: Sequence[AnyRun], descent_candidates: int, backend: str | None = None) -> float:
    """About how many seconds runs take that have a search in common.

    Args:
        search: the runs.
        descent_candidates: as many as a descent by IPOPT takes the time of.
        backend: evaluates populations; None for that of the environment.

    Raises:
        Exception: whatever a plug-in raises.
    """
    run, descent = search[0], candidate_seconds(search[0], "vm") * descent_candidates
    if run.section.within is not None:
        return run.section.within
    return search_seconds(run, descent, backend) + sum(each.seconds_after(descent) for each in search)


def search_seconds(run: AnyRun, descent: float, backend: str | None = None) -> float:
    """About how many seconds the search of a run takes, where a descent by IPOPT takes so many."""
    solver, budget = run.section.build(), run.section.budget()
    if solver.solves_program:
        seconds = np.inf if budget.iterations is None else budget.iterations * descent
    else:
        seconds = _candidates(solver, budget) * (SOLVER_SECONDS + candidate_seconds(run, backend))
    return float(min(seconds, budget.seconds or np.inf))


def _candidates(solver: AnySolver, budget: Budget) -> float:
    """How many candidates a budget allows a metaheuristic; inf where only the time is limited."""
    population = getattr(solver, "population", None) or POPULATION
    by_iterations = (budget.iterations or np.inf) * ITERATION_CANDIDATES * population
    return float(min(budget.evaluations or np.inf, by_iterations))


def candidate_seconds(run: AnyRun, backend: str | None) -> float:
    """Seconds that a candidate of a run takes in a batch; measured once in a process."""
    key = run.searched, backend
    if key not in MEASURED:
        candidates, evaluate = run.box.sample(np.random.default_rng(0), BATCH), run.evaluator(backend)
        MEASURED[key] = min(_seconds_of(lambda: evaluate(candidates)) for _ in range(3)) / BATCH
    return MEASURED[key]


def _seconds_of(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


LOG = logging.getLogger(__name__)
T = TypeVar("T")
SOLO_ATTEMPTS = 2  # of a run that was in progress when a worker died
CHECK_SECONDS = 5.0  # between looks at the workers while no run ends
GRACE_SECONDS = 5.0  # after Ctrl-C, for the runs that have begun


def run_campaign(
    runs: Sequence[AnyRunT],
    store: RunStore,
    executors: ExecutorFactory,
    retry_failed: bool = False,
    progress: Callable[[AnyRunT, Outcome], object] = lambda run, outcome: None,
) -> None:
    """Do the runs that are not in the store yet.

    Runs that differ in their polish alone are done together: their search is made once. A run that raises is stored as
    failed. When a worker dies, the runs in progress are repeated one by one: the one that killed the worker is
    identified and stored as failed, and the campaign continues.

    Args:
        runs: the campaign.
        store: of the results.
        executors: that do the runs.
        retry_failed: repeat the runs that are stored as failed.
        progress: called after each run, with its outcome.

    Raises:
        LostExecutor: the executor cancelled its runs, or has no workers any more.
        StoreError: a run could not be stored.
    """
    done = store.done(failed_too=not retry_failed)
    pending = deque(searches_of(run for run in runs if run.key not in done))

    def keep(run: AnyRunT, outcome: Outcome) -> None:
        store.add(run, outcome)
        ending = outcome.error or "done"
        LOG.info("run: %s, %s, seed %d: %s in %.3f s", run.case, run.solver, run.seed, ending, outcome.seconds)
        progress(run, outcome)

    while pending:
        before = len(pending)
        with _opened(executors.start) as executor:
            suspects = _work(pending, executor, executors, keep)
        for run in chain.from_iterable(suspects):
            keep(run, _alone(run, executors))
        if len(pending) == before:
            raise LostExecutor("no worker can be started; completed runs are stored")


def searches_of(runs: Iterable[AnyRunT]) -> list[list[AnyRunT]]:
    """The runs, each once, together with those that have the same search; in the order of the first of these."""
    found: dict[str, dict[str, AnyRunT]] = {}
    for run in runs:
        found.setdefault(run.search, {})[run.key] = run
    return [list(together.values()) for together in found.values()]


@contextmanager
def _opened(start: Callable[[], Executor]) -> Iterator[Executor]:
    """An executor; after an exception nobody waits for its runs."""
    executor = start()
    try:
        yield executor
    except BaseException:
        executor.shutdown(wait=False)
        raise
    executor.shutdown()


def _work(
    pending: deque[list[AnyRunT]],
    executor: Executor,
    executors: ExecutorFactory,
    keep: Callable[[AnyRunT, Outcome], None],
) -> list[list[AnyRunT]]:
    """Work until nothing is pending or the executor breaks; returns the runs that were in progress then."""
    in_progress: dict[Future[list[Outcome]], list[AnyRunT]] = {}
    suspects: list[list[AnyRunT]] = []

    def keep_all(future: Future[list[Outcome]], together: list[AnyRunT]) -> None:
        for run, outcome in zip(together, _outcomes(future, len(together)), strict=True):
            keep(run, outcome)

    try:
        while (pending and not suspects) or in_progress:
            while pending and not suspects and len(in_progress) < executors.width:
                statements, versions = zip(*(run.task for run in pending[0]), strict=True)
                future = executor.submit(run_together, statements, versions[0], executors.backend)
                in_progress[future] = pending.popleft()
            for future in _wait(in_progress, executors):
                together = in_progress.pop(future)
                try:
                    keep_all(future, together)
                except BrokenExecutor:
                    suspects.append(together)
    except BrokenExecutor:  # on submission: the runs in progress are suspects too
        suspects.extend(in_progress.values())
    except KeyboardInterrupt:  # runs that have begun may be completed
        begun = [future for future in in_progress if not future.cancel()]
        for future in wait(begun, timeout=GRACE_SECONDS).done:
            with suppress(BrokenExecutor, LostExecutor):
                keep_all(future, in_progress[future])
        raise
    finally:
        for future in in_progress:
            future.cancel()
    return suspects


def _wait(in_progress: Collection[Future[T]], executors: ExecutorFactory) -> set[Future[T]]:
    """The next runs to end.

    Raises:
        LostExecutor: there are no workers.
    """
    while True:
        done = wait(in_progress, CHECK_SECONDS, FIRST_COMPLETED).done
        if done:
            return done
        executors.check()


def _outcomes(future: Future[list[Outcome]], runs: int) -> list[Outcome]:
    """The outcomes of runs that have ended; an exception within a run is one already, the executor's own become one."""
    try:
        error = future.exception()
    except CancelledError as cancelled:
        error = cancelled
    if error is None:
        return future.result()
    if isinstance(error, BrokenExecutor):
        raise error
    if isinstance(error, (CancelledError, OSError)):  # the workers are gone, or do not answer
        raise LostExecutor("the workers are gone; completed runs are stored") from error
    return [failed(error)] * runs


def _alone(run: AnyRunT, executors: ExecutorFactory) -> Outcome:
    """Repeat a run on an executor of its own."""
    for _ in range(SOLO_ATTEMPTS):
        with _opened(executors.alone) as executor:
            try:
                statement, versions = run.task
                future = executor.submit(run_together, [statement], versions, executors.backend)
                _wait([future], executors)
                [outcome] = _outcomes(future, 1)
                return outcome
            except BrokenExecutor:
                continue
    return Outcome(None, 0.0, f"WorkerDied: {SOLO_ATTEMPTS} times in a row while nothing else ran")
