"""Turn a library that calls a cost function into a search that asks for costs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from queue import SimpleQueue
from threading import Thread

import numpy as np

from solvers.box import FloatArray
from solvers.solver import Search

WORST = 1e100  # what libraries get for an infinite cost, which some of them refuse

Cost = Callable[[FloatArray], FloatArray]


class _Abandoned(BaseException):
    """Raised within the library when nobody wants its result any more."""


def callback_to_generator(run: Callable[[Cost], object], iterations: Iterator[float], every: int = 1) -> Search:
    """A search from a function that minimises.

    Args:
        run: takes the cost of candidates (m, d) -> (m,) and minimises it, for ever if it can.
        iterations: of the search.
        every: calls of the cost that make one iteration; the first call is the initial population.

    Raises:
        Exception: whatever ``run`` raises.
    """
    asked: SimpleQueue[FloatArray | BaseException | None] = SimpleQueue()
    answers: SimpleQueue[FloatArray | None] = SimpleQueue()

    def cost(candidates: FloatArray) -> FloatArray:
        asked.put(candidates)
        answer = answers.get()
        if answer is None:
            raise _Abandoned
        return answer

    def work() -> None:
        try:
            run(cost)
            asked.put(None)
        except _Abandoned:
            pass
        except Exception as error:
            asked.put(error)

    thread = Thread(target=work, daemon=True)
    thread.start()
    calls = 0
    try:
        while (candidates := asked.get()) is not None:
            if isinstance(candidates, BaseException):
                raise candidates
            starts_iteration = calls > 0 and (calls - 1) % every == 0
            if starts_iteration and next(iterations, None) is None:
                return
            answers.put(np.minimum((yield candidates), WORST))
            calls += 1
    finally:
        answers.put(None)
        thread.join()
