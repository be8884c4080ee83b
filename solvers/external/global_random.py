"""The random numbers that libraries draw from Python's and NumPy's global generators: their own while they work."""

from __future__ import annotations

import random
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np


class GlobalRandom:
    """Global generators that belong to one search; everybody else's are as they were whenever it does not work.

    Args:
        rng: that they are seeded from.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        seed = int(rng.integers(2**32))
        self._own: tuple[Any, Any] = (random.Random(seed).getstate(), np.random.RandomState(seed).get_state())
        self._others = self._own

    @contextmanager
    def active(self) -> Iterator[None]:
        """The library works: what it draws is the search's."""
        self._others = _exchange(self._own)
        try:
            yield
        finally:
            self._own = _exchange(self._others)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Within :meth:`active`: others work."""
        self._own = _exchange(self._others)
        try:
            yield
        finally:
            self._others = _exchange(self._own)


def _exchange(states: tuple[Any, Any]) -> tuple[Any, Any]:
    """Put these states in place; returns those that were."""
    before = random.getstate(), np.random.get_state()  # noqa: NPY002 (the libraries use it)
    random.setstate(states[0])
    np.random.set_state(states[1])  # noqa: NPY002
    return before
