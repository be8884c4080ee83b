"""The loop of a search, as its driver hands it to the solver."""

from __future__ import annotations

from collections.abc import Iterable, Iterator


class Iterations(Iterator[float]):
    """Iterates over the share of the budget already used, from 0 to 1, once for each iteration of the solver.

    Ends when a limit is reached.

    Args:
        progress: the shares.
        evaluations: the budget in evaluations, for solvers that fit their population to it; None where evaluations
            are not limited.
    """

    def __init__(self, progress: Iterable[float], evaluations: int | None = None) -> None:
        self._progress = iter(progress)
        self.evaluations = evaluations

    def __next__(self) -> float:
        return next(self._progress)
