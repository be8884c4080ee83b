"""Random search: what every other solver has to beat."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.solver import Iterations, Search, SearchBox, Solver


@dataclass(frozen=True)
class RandomSearch(Solver):
    """A search by uniform random candidates."""

    minimum_population: ClassVar[int] = 1

    population: int = 100  # m >= 1, candidates of an iteration

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        yield box.initial(rng, self.population)
        for _ in iterations:
            yield box.sample(rng, self.population)
