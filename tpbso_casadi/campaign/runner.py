"""Do what is left of a campaign, on any executor, and keep each run the moment it ends."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait

from tpbso_casadi.campaign.executors import ExecutorFactory
from tpbso_casadi.campaign.run import Outcome, Run, run_one
from tpbso_casadi.campaign.store import Store

CHANCES = 2  # alone, for a run that was at work when a worker died


class LostExecutor(RuntimeError):
    """Whatever did the runs is gone; those that ended before are kept."""


def run_campaign(
    runs: Sequence[Run],
    store: Store,
    crew: ExecutorFactory,
    retry_failed: bool = False,
    progress: Callable[[Outcome], object] = lambda outcome: None,
) -> None:
    """Do the runs that are not in the store yet.

    A run that raises is kept as failed. When a worker dies, those at work are tried again one by one, so that the one
    that killed it is found and kept as failed, and the rest goes on.

    Args:
        runs: the campaign.
        store: what is done, and where what ends is kept.
        crew: who does it.
        retry_failed: do those that are kept as failed once more.
        progress: called after each run.

    Raises:
        LostExecutor: the executor cancelled what it was given.
        StoreError: a run could not be kept.
    """
    done = store.done(failed_too=not retry_failed)
    left = deque({run.key: run for run in runs if run.key not in done}.values())

    def keep(run: Run, outcome: Outcome) -> None:
        store.add(run, outcome)
        progress(outcome)

    while left:
        before = len(left)
        with crew.start() as executor:
            suspects = _work(left, executor, crew, keep)
        for run in suspects:
            keep(run, _alone(run, crew))
        if len(left) == before:
            raise LostExecutor("no worker can be started; what was done is kept")


def _work(
    left: deque[Run], executor: Executor, crew: ExecutorFactory, keep: Callable[[Run, Outcome], None]
) -> list[Run]:
    """Work until nothing is left or the executor breaks; returns the runs that were at work then."""
    at_work: dict[Future[Outcome], Run] = {}
    suspects: list[Run] = []
    try:
        while (left and not suspects) or at_work:
            while left and not suspects and len(at_work) < crew.width:
                future = executor.submit(run_one, *left[0].task, crew.backend)
                at_work[future] = left.popleft()
            for future in wait(at_work, return_when=FIRST_COMPLETED).done:
                run = at_work.pop(future)
                try:
                    keep(run, _outcome(future))
                except BrokenExecutor:
                    suspects.append(run)
    except BrokenExecutor:  # when handing out: whoever was at work is found in the same way
        suspects.extend(at_work.values())
    except KeyboardInterrupt:  # what a worker has begun is seen through
        for future in [future for future in at_work if not future.cancel()]:
            keep(at_work[future], _outcome(future))
        raise
    finally:
        for future in at_work:
            future.cancel()
    return suspects


def _outcome(future: Future[Outcome]) -> Outcome:
    try:
        return future.result()
    except BrokenExecutor:
        raise
    except (CancelledError, OSError) as error:  # nobody is there any more, or nobody answers
        raise LostExecutor("the workers are gone; what was done is kept") from error
    except Exception as error:  # of the executor itself: what a run raises comes as an outcome
        return Outcome(None, 0.0, " ".join(f"{type(error).__name__}: {error}".split()))


def _alone(run: Run, crew: ExecutorFactory) -> Outcome:
    """Try a run with nobody beside it."""
    for _ in range(CHANCES):
        with crew.alone() as executor:
            try:
                return executor.submit(run_one, *run.task, crew.backend).result()
            except BrokenExecutor:
                continue
    return Outcome(None, 0.0, f"WorkerDied: {CHANCES} times in a row while nothing else ran")
