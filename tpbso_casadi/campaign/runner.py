"""A campaign: its size in seconds, and its runs, each stored when it ends."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import contextmanager, suppress

import numpy as np

from solvers import AnySolver, Budget
from tpbso_casadi.campaign.executors import ExecutorFactory, LostExecutor
from tpbso_casadi.campaign.run import AnyRun, Outcome, failed, run_one
from tpbso_casadi.campaign.run import AnyRunT as Run
from tpbso_casadi.campaign.store import Store

POPULATION = BATCH = 32  # candidates; where a solver chooses its population itself, too
DESCENT_CANDIDATES = 4_000  # as many as a descent by IPOPT takes the time of: measured 2,100 to 8,900 on seven cases
PROCESS_SECONDS = 2.0  # until a process works: modules, models
SOLVER_SECONDS = 5e-6  # that a solver itself takes for a candidate
MEASURED: dict[tuple[str, str | None], float] = {}  # seconds of a candidate, by what is searched and the backend
ITERATION_CANDIDATES = 3  # of each member of a population, at most: a beetle has two antennae


def campaign_seconds(runs: Sequence[AnyRun], workers: int, backend: str | None = None) -> float:
    """About how many seconds runs take on so many workers; fewer, if code is not compiled yet but will be.

    Args:
        runs: to be done.
        workers: processes.
        backend: evaluates populations; None for that of the environment.

    Raises:
        Exception: whatever a plug-in raises.
    """
    return PROCESS_SECONDS + sum(run_seconds(run, backend) for run in runs) / max(1, min(workers, len(runs)))


def run_seconds(run: AnyRun, backend: str | None = None) -> float:
    """About how many seconds one run takes."""
    section = run.section
    solver, budget = section.build(), section.budget()
    if section.within is not None:
        return section.within
    descent = candidate_seconds(run, "vm") * DESCENT_CANDIDATES
    if solver.solves_program:
        seconds = np.inf if budget.iterations is None else budget.iterations * descent
    else:
        seconds = _candidates(solver, budget) * (SOLVER_SECONDS + candidate_seconds(run, backend))
    return float(min(seconds, budget.seconds or np.inf)) + run.seconds_after(descent)


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
SOLO_ATTEMPTS = 2  # of a run that was in progress when a worker died
CHECK_SECONDS = 5.0  # between looks at the workers while no run ends
GRACE_SECONDS = 5.0  # after Ctrl-C, for the runs that have begun


def run_campaign(
    runs: Sequence[Run],
    store: Store,
    executors: ExecutorFactory,
    retry_failed: bool = False,
    progress: Callable[[Outcome], object] = lambda outcome: None,
) -> None:
    """Do the runs that are not in the store yet.

    A run that raises is stored as failed. When a worker dies, the runs in progress are repeated one by one: the one
    that killed the worker is identified and stored as failed, and the campaign continues.

    Args:
        runs: the campaign.
        store: of the results.
        executors: that do the runs.
        retry_failed: repeat the runs that are stored as failed.
        progress: called after each run.

    Raises:
        LostExecutor: the executor cancelled its runs, or has no workers any more.
        StoreError: a run could not be stored.
    """
    done = store.done(failed_too=not retry_failed)
    pending = deque({run.key: run for run in runs if run.key not in done}.values())

    def keep(run: Run, outcome: Outcome) -> None:
        store.add(run, outcome)
        ending = outcome.error or "done"
        LOG.info("run: %s, %s, seed %d: %s in %.3f s", run.case, run.solver, run.seed, ending, outcome.seconds)
        progress(outcome)

    while pending:
        before = len(pending)
        with _opened(executors.start) as executor:
            suspects = _work(pending, executor, executors, keep)
        for run in suspects:
            keep(run, _alone(run, executors))
        if len(pending) == before:
            raise LostExecutor("no worker can be started; completed runs are stored")


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
    pending: deque[Run], executor: Executor, executors: ExecutorFactory, keep: Callable[[Run, Outcome], None]
) -> list[Run]:
    """Work until nothing is pending or the executor breaks; returns the runs that were in progress then."""
    in_progress: dict[Future[Outcome], Run] = {}
    suspects: list[Run] = []
    try:
        while (pending and not suspects) or in_progress:
            while pending and not suspects and len(in_progress) < executors.width:
                future = executor.submit(run_one, *pending[0].task, executors.backend)
                in_progress[future] = pending.popleft()
            for future in _wait(in_progress, executors):
                run = in_progress.pop(future)
                try:
                    keep(run, _outcome(future))
                except BrokenExecutor:
                    suspects.append(run)
    except BrokenExecutor:  # on submission: the runs in progress are suspects too
        suspects.extend(in_progress.values())
    except KeyboardInterrupt:  # runs that have begun may be completed
        begun = [future for future in in_progress if not future.cancel()]
        for future in wait(begun, timeout=GRACE_SECONDS).done:
            with suppress(BrokenExecutor, LostExecutor):
                keep(in_progress[future], _outcome(future))
        raise
    finally:
        for future in in_progress:
            future.cancel()
    return suspects


def _wait(in_progress: Collection[Future[Outcome]], executors: ExecutorFactory) -> set[Future[Outcome]]:
    """The next runs to end.

    Raises:
        LostExecutor: there are no workers.
    """
    while True:
        done = wait(in_progress, CHECK_SECONDS, FIRST_COMPLETED).done
        if done:
            return done
        executors.check()


def _outcome(future: Future[Outcome]) -> Outcome:
    """The outcome of a run that has ended; an exception within a run is one already, the executor's own become one."""
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
    return failed(error)


def _alone(run: Run, executors: ExecutorFactory) -> Outcome:
    """Repeat a run on an executor of its own."""
    for _ in range(SOLO_ATTEMPTS):
        with _opened(executors.alone) as executor:
            try:
                future = executor.submit(run_one, *run.task, executors.backend)
                _wait([future], executors)
                return _outcome(future)
            except BrokenExecutor:
                continue
    return Outcome(None, 0.0, f"WorkerDied: {SOLO_ATTEMPTS} times in a row while nothing else ran")
