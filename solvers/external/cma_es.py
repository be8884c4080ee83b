"""CMA-ES by its authors' package ``cma``: the covariance of good steps is learned.

Hansen and Ostermeier 2001; restarts with twice the population: Auger and Hansen, "A Restart CMA Evolution Strategy With
Increasing Population Size", 2005.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

import cma
import numpy as np

from solvers.external.callbacks import LARGEST_COST
from solvers.solver import Iterations, Search, SearchBox, Solver, require
from solvers.threads import one_thread


@dataclass(frozen=True)
class CMAES(Solver):
    """Covariance matrix adaptation with restarts (IPOP)."""

    minimum_population: ClassVar[int] = 4

    population: int | None = None  # lambda >= 4; None: 4 + 3 ln d, the default of the package
    sigma: float = 0.3  # > 0, first step size as a share of the box
    growth: float = 2.0  # >= 1, of the population at a restart

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.sigma > 0.0, f"sigma = {self.sigma} is not positive")
        require(self.growth >= 1.0, f"growth = {self.growth} is less than 1")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        size = float(self.population or 4 + int(3 * np.log(box.dimension)))
        first = True
        while True:
            strategy = self.strategy(box, rng, int(size))
            while not strategy.stop():
                if not first and next(iterations, None) is None:
                    return
                with one_thread():
                    points = np.array(strategy.ask())
                points = box.initial_shares(points) if first else points
                first = False
                costs = yield box.from_unit(points)
                with one_thread():
                    strategy.tell(list(points), np.minimum(costs, LARGEST_COST).tolist())
            size *= self.growth
            box = replace(box, known=None)

    def strategy(self, box: SearchBox, rng: np.random.Generator, population: int) -> Any:
        """A strategy of the package on the unit cube, around the first known candidate where there is one.

        With our random numbers and no output.
        """
        options: dict[str, Any] = {
            "bounds": [0.0, 1.0],
            "popsize": population,
            "randn": lambda *shape: rng.standard_normal(shape),
            "seed": np.nan,  # leaves NumPy's global generator alone
            "verbose": -9,
        }
        if box.dimension == 1:
            options["maxstd"] = np.inf  # the package cannot limit the one standard deviation, and raises
        return cma.CMAEvolutionStrategy(box.initial_shares(rng.random((1, box.dimension)))[0], self.sigma, options)
