"""The one interface of all metaheuristics."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator, Iterator
from typing import ClassVar, TypeAlias

import numpy as np

from solvers.box import Box, FloatArray

Search: TypeAlias = Generator[FloatArray, FloatArray, None]


class Solver(ABC):
    """A population-based search, written as the paper writes Algorithm 1: one loop over iterations.

    A subclass is a frozen dataclass whose fields are its hyper-parameters. It holds only the algorithm; budget,
    best-so-far, history, seed and interruption belong to :func:`solvers.minimize.minimize`.

    Attributes:
        minimum_population: the fewest members the algorithm works with.
        population: m, the number of members; None for what suits the budget.
    """

    minimum_population: ClassVar[int] = 2
    population: int | None

    def __post_init__(self) -> None:
        if self.population is not None and self.population < self.minimum_population:
            name = type(self).__name__
            raise ValueError(f"{name} needs a population of at least {self.minimum_population}, not {self.population}")

    @abstractmethod
    def search(self, box: Box, rng: np.random.Generator, iterations: Iterator[float]) -> Search:
        """Yield candidates and receive their costs: ``costs = yield candidates``.

        Args:
            box: where to search; every candidate (m, d) lies inside.
            rng: the only source of randomness.
            iterations: loop over it; each turn starts an iteration and gives the share of the budget already used,
                from 0 to 1, for schedules. The search is closed from outside when the budget is spent.

        Receives:
            costs (m,), finite or inf (for points that cannot be priced), lower is better.
        """


def require(holds: bool, requirement: str) -> None:
    """Raise ValueError with ``requirement`` unless it holds; for hyper-parameters."""
    if not holds:
        raise ValueError(requirement)
