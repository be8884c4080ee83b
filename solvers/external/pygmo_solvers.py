"""The algorithms of pygmo by their names.

Biscani and Izzo, "A parallel global multiobjective framework for optimization: pagmo", 2020.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pygmo

from solvers.external.callbacks import Cost, callback_to_generator
from solvers.solver import FloatArray, Iterations, Search, SearchBox, Solver, require

ALGORITHMS = ("bee_colony", "cmaes", "de", "de1220", "gaco", "gwo", "pso", "pso_gen", "sade", "sea", "sga", "xnes")
GENERATIONS = 1_000_000  # of one run, the most; the budget ends the search
LARGEST_KERNEL = 63  # of the ant colony, pygmo's default, which must not be larger than the population


@dataclass(frozen=True)
class Pygmo(Solver):
    """An algorithm of pygmo with pygmo's defaults, except for the population. One candidate at a time.

    An iteration is as many candidates as the population has members.
    """

    minimum_population: ClassVar[int] = 7

    population: int = 20  # m >= 7
    algorithm: str = "sade"  # one of ALGORITHMS: self-adaptive differential evolution, de1220, ...

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.algorithm in ALGORITHMS, f"algorithm = {self.algorithm!r} is none of {', '.join(ALGORITHMS)}")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        """Candidates one after the other, with a new population where pygmo has converged."""

        def run(cost: Cost) -> None:
            problem = pygmo.problem(_Cube(box, cost))
            options = {"ker": min(LARGEST_KERNEL, self.population)} if self.algorithm == "gaco" else {}
            shares = box.initial_shares(rng.random((self.population, box.dimension)))
            while True:
                population = pygmo.population(problem, seed=int(rng.integers(2**31)))
                for share in shares:
                    population.push_back(share)
                kind = getattr(pygmo, self.algorithm)
                pygmo.algorithm(kind(gen=GENERATIONS, seed=int(rng.integers(2**31)), **options)).evolve(population)
                shares = rng.random((self.population, box.dimension))

        return callback_to_generator(run, iterations, self.population)


class _Cube:
    """A cost on the unit cube, as pygmo asks for it."""

    def __init__(self, box: SearchBox, cost: Cost) -> None:
        self._box, self._cost = box, cost

    def __deepcopy__(self, memo: object) -> _Cube:
        """No copy: pygmo copies its problems, but the thread that answers must stay the same."""
        return self

    def fitness(self, share: FloatArray) -> FloatArray:
        """The cost (1,) of a share (d,)."""
        return self._cost(self._box.from_unit(np.asarray(share)[None]))

    def get_bounds(self) -> tuple[FloatArray, FloatArray]:
        """The corners of the cube."""
        return np.zeros(self._box.dimension), np.ones(self._box.dimension)
