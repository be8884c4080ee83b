"""The optimisers of nevergrad by their names in its registry.

Bennet, Doerr, Moreau, Rapin, Teytaud and Teytaud, "Nevergrad: black-box optimization platform", 2021.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from solvers.external.callbacks import LARGEST_COST, GlobalRandom
from solvers.solver import DEFAULT_EVALUATIONS, FloatArray, Iterations, Search, SearchBox, Solver, require

with GlobalRandom(np.random.default_rng(1)).active():  # it draws random numbers as it is imported
    import nevergrad

ONE_BY_ONE = 1


@dataclass(frozen=True)
class Nevergrad(Solver):
    """An optimiser of nevergrad, given the number of candidates that it may ask for at a time.

    The default is a fast one. ``NGOpt``, which chooses among many by dimension and budget, may take milliseconds for
    each candidate. Many of them begin at the centre of the box, where many published functions have their minimum.
    """

    minimum_population: ClassVar[int] = 1

    population: int = 30  # m >= 1, nevergrad's num_workers: candidates that are evaluated at a time
    optimizer: str = "TwoPointsDE"  # a name of nevergrad.optimizers.registry: NGOpt, CMA, PSO, ...

    def __post_init__(self) -> None:
        super().__post_init__()
        known = nevergrad.optimizers.registry
        require(self.optimizer in known, f"optimizer = {self.optimizer!r} is none of nevergrad's {len(known)}")
        alone = known[self.optimizer].no_parallelization and self.population > ONE_BY_ONE
        require(not alone, f"optimizer = {self.optimizer!r} works one candidate at a time; say population=1")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        own = GlobalRandom(rng)
        with _working(own):
            optimizer = self._optimizer(box, rng, iterations.evaluations or DEFAULT_EVALUATIONS)
        while True:
            with _working(own):
                asked = [optimizer.ask() for _ in range(self.population)]
                shares = np.array([candidate.value for candidate in asked])
            costs = yield box.from_unit(shares)
            with _working(own):
                for candidate, cost in zip(asked, np.minimum(costs, LARGEST_COST), strict=True):
                    optimizer.tell(candidate, float(cost))
            if next(iterations, None) is None:
                return

    def _optimizer(self, box: SearchBox, rng: np.random.Generator, evaluations: int) -> Any:
        """The optimiser of the unit cube, with known candidates as its first."""
        cube = nevergrad.p.Array(shape=(box.dimension,), lower=0.0, upper=1.0)
        cube.random_state = np.random.RandomState(int(rng.integers(2**32)))
        optimizer = nevergrad.optimizers.registry[self.optimizer](cube, budget=evaluations, num_workers=self.population)
        for share in self._known(box)[::-1]:  # the last suggestion is the first that is asked for
            optimizer.suggest(share)
        return optimizer

    def _known(self, box: SearchBox) -> FloatArray:
        return np.empty((0, box.dimension)) if box.known is None else box.to_unit(box.known)[: self.population]


@contextmanager
def _working(own: GlobalRandom) -> Iterator[None]:
    """Run nevergrad with the search's random numbers, without showing its advice."""
    with own.active(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
