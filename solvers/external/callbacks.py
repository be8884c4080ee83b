"""Other libraries' loops as generators, with their random numbers kept apart."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from threading import Thread
from typing import Any

import numpy as np

from solvers.solver import FloatArray, Search

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


class GlobalRandom:
    """Global random generators that one search uses, restored whenever it does not work.

    Args:
        rng: that they are seeded from.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        seed = int(rng.integers(2**32))
        self._own: tuple[Any, Any] = (random.Random(seed).getstate(), np.random.RandomState(seed).get_state())
        self._others = self._own

    @contextmanager
    def active(self) -> Iterator[None]:
        """Run the library with the search's generators."""
        self._others = _exchange(self._own)
        try:
            yield
        finally:
            self._own = _exchange(self._others)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Run others within :meth:`active`, with their own generators."""
        self._own = _exchange(self._others)
        try:
            yield
        finally:
            self._others = _exchange(self._own)


def _exchange(states: tuple[Any, Any]) -> tuple[Any, Any]:
    """Put these states in place and return those that were."""
    before = random.getstate(), np.random.get_state()  # noqa: NPY002 (the libraries use it)
    random.setstate(states[0])
    np.random.set_state(states[1])  # noqa: NPY002
    return before
