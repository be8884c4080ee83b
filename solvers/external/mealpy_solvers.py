"""The algorithms of mealpy by their module and class.

Van Thieu and Mirjalili, "MEALPY: An open-source library for latest meta-heuristic algorithms in Python", 2023.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import mealpy
import numpy as np

from solvers.external.callbacks import Cost, GlobalRandom, callback_to_generator
from solvers.solver import FloatArray, Iterations, Search, SearchBox, Solver, require

EPOCHS = 100_000  # of one of mealpy's runs, the most that it takes; the budget ends the search


def algorithm_named(name: str) -> Any:
    """An algorithm of mealpy by the name that mealpy has for it, ``PSO.OriginalPSO``; None if there is none."""
    module, _, kind = name.partition(".")
    found = getattr(getattr(mealpy, module, None), kind or module, None)
    return found if isinstance(found, type) and issubclass(found, mealpy.Optimizer) else None


@dataclass(frozen=True)
class Mealpy(Solver):
    """An algorithm of mealpy with mealpy's defaults, except for the population. One candidate at a time.

    An iteration is as many candidates as the population has members, which is mealpy's epoch for most algorithms.
    """

    minimum_population: ClassVar[int] = 5

    population: int = 50  # m >= 5; some algorithms need 10
    algorithm: str = "PSO.OriginalPSO"  # module and class: GA.BaseGA, SHADE.L_SHADE, GWO.OriginalGWO, ...

    def __post_init__(self) -> None:
        super().__post_init__()
        known = algorithm_named(self.algorithm) is not None
        require(known, f"algorithm = {self.algorithm!r} is none of mealpy's, such as GWO.OriginalGWO")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        own = GlobalRandom(rng)

        def run(cost: Cost) -> None:
            def one(shares: FloatArray) -> float:
                with own.paused():
                    return float(cost(box.from_unit(np.asarray(shares)[None]))[0])

            with own.active():
                start = None if box.known is None else box.initial_shares(rng.random((self.population, box.dimension)))
                while True:
                    algorithm = algorithm_named(self.algorithm)(epoch=EPOCHS, pop_size=self.population)
                    algorithm.solve(_Cube(one, box.dimension), starting_solutions=start, seed=int(rng.integers(2**31)))
                    start = None

        return callback_to_generator(run, iterations, self.population)


class _Cube(mealpy.Problem):  # type: ignore[misc]  # mealpy has no types
    """A cost on the unit cube, without mealpy's output."""

    cost: Callable[[FloatArray], float]

    def __init__(self, cost: Callable[[FloatArray], float], dimension: int) -> None:
        self.cost = lambda x: 0.0  # mealpy tries the function, at a candidate that it does not use, for its objectives
        cube: Any = mealpy.FloatVar(lb=[0.0] * dimension, ub=[1.0] * dimension)
        super().__init__(cube, minmax="min", log_to=None)
        _ = self.n_objs  # counted when it is first asked for
        self.cost = cost

    def obj_func(self, x: FloatArray) -> float:
        """The cost of shares (d,)."""
        return float(self.cost(x))
