"""Turn a library that calls a cost function into a generator that yields candidates and receives costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from queue import SimpleQueue
from threading import Thread

import numpy as np

from solvers.box import FloatArray
from solvers.solver import Search

LARGEST_COST = 1e100  # given to libraries in place of an infinite cost, which some of them refuse

Cost = Callable[[FloatArray], FloatArray]


class _Abandoned(BaseException):
    """Raised in the library's thread when the search is closed."""


def callback_to_generator(run: Callable[[Cost], object], iterations: Iterator[float], every: int = 1) -> Search:
    """A search made of a function that minimises, which runs in a thread of its own.

    Args:
        run: takes the cost of candidates (m, d) -> (m,) and minimises it; the search ends when it returns.
        iterations: of the search.
        every: calls of the cost that make one iteration; the first call is the initial population.

    Raises:
        Exception: the one that ``run`` has raised.
    """
    requests: SimpleQueue[FloatArray | BaseException | None] = SimpleQueue()
    replies: SimpleQueue[FloatArray | None] = SimpleQueue()

    def cost(candidates: FloatArray) -> FloatArray:
        requests.put(candidates)
        costs = replies.get()
        if costs is None:
            raise _Abandoned
        return costs

    def work() -> None:
        try:
            run(cost)
            requests.put(None)
        except _Abandoned:
            pass
        except Exception as error:
            requests.put(error)

    thread = Thread(target=work, daemon=True)
    thread.start()
    calls = 0
    try:
        while (candidates := requests.get()) is not None:
            if isinstance(candidates, BaseException):
                raise candidates
            starts_iteration = calls > 0 and (calls - 1) % every == 0
            if starts_iteration and next(iterations, None) is None:
                return
            replies.put(np.minimum((yield candidates), LARGEST_COST))
            calls += 1
    finally:
        replies.put(None)
        thread.join()
