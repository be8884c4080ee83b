"""GA: a real-coded genetic algorithm: tournament, simulated binary crossover, polynomial mutation, elitism.

[1] Deb and Agrawal, "Simulated Binary Crossover for Continuous Search Space", 1995; [2] Deb and Goyal, "A Combined
Genetic Adaptive Search (GeneAS) for Engineering Design", 1996 (polynomial mutation).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from solvers.solver import FloatArray, Iterations, Search, SearchBox, Solver, require

IndexArray: TypeAlias = NDArray[np.int64]


@dataclass(frozen=True)
class GA(Solver):
    """Real-coded genetic algorithm with (mu + lambda) elitism: the best m of parents and children survive.

    The defaults are the best found on the paper's eight point-to-point cases, with the same effort for each solver: see
    ``benchmarks/results/tune.md`` and ``benchmarks/tune.py``.

    Raises:
        ValueError: a hyper-parameter outside the range stated beside it.
    """

    minimum_population: ClassVar[int] = 2

    population: int = 30  # m >= 2, individuals
    tournament: int = 2  # >= 1, how many compete to become a parent
    crossover_rate: float = 0.9  # in [0, 1], share of pairs that cross over [1]
    crossover_eta: float = 10.0  # >= 0, distribution index of the crossover: larger stays nearer the parents [1]
    mutation_rate: float = 0.2  # in [0, 1], share of genes that mutate
    mutation_eta: float = 20.0  # >= 0, distribution index of the mutation [2]

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.tournament >= 1, f"tournament = {self.tournament} is less than 1")
        for name in ("crossover_rate", "mutation_rate"):
            require(0.0 <= getattr(self, name) <= 1.0, f"{name} = {getattr(self, name)} is not in [0, 1]")
        for name in ("crossover_eta", "mutation_eta"):
            require(getattr(self, name) >= 0.0, f"{name} = {getattr(self, name)} is negative")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        x = box.initial(rng, self.population)
        cost = yield x
        for _ in iterations:
            children = self.mutate(rng, box, self.crossover(rng, box, x[self.select(rng, cost)]))
            pool = np.concatenate([x, children])
            costs = np.concatenate([cost, (yield children)])
            survivors = np.argsort(costs, kind="stable")[: self.population]
            x, cost = pool[survivors], costs[survivors]

    def select(self, rng: np.random.Generator, cost: FloatArray) -> IndexArray:
        """Tournaments: for each child the index of the best of a few random individuals, (m,)."""
        rivals = rng.integers(self.population, size=(self.population, self.tournament))
        winners: IndexArray = rivals[np.arange(self.population), np.argmin(cost[rivals], axis=1)]
        return winners

    def crossover(self, rng: np.random.Generator, box: SearchBox, parents: FloatArray) -> FloatArray:
        """Simulated binary crossover [1] of the first half of the parents with the second half, (m, d)."""
        pairs = self.population // 2
        first, second = parents[:pairs], parents[pairs : 2 * pairs]
        u = rng.random(first.shape)
        power = 1.0 / (self.crossover_eta + 1.0)
        spread = np.where(u <= 0.5, (2.0 * u) ** power, (1.0 / (2.0 * (1.0 - u))) ** power)
        pair_mask = rng.random((pairs, 1)) < self.crossover_rate
        swap_mask = rng.random(first.shape) < 0.5
        spread = np.where(pair_mask, np.where(swap_mask, -spread, spread), 1.0)
        middle, half = (first + second) / 2.0, (first - second) / 2.0
        return box.clip(np.concatenate([middle + spread * half, middle - spread * half, parents[2 * pairs :]]))

    def mutate(self, rng: np.random.Generator, box: SearchBox, children: FloatArray) -> FloatArray:
        """Polynomial mutation [2] of a random share of the genes, (m, d)."""
        u = rng.random(children.shape)
        power = 1.0 / (self.mutation_eta + 1.0)
        shift = np.where(u < 0.5, (2.0 * u) ** power - 1.0, 1.0 - (2.0 * (1.0 - u)) ** power)
        gene_mask = rng.random(children.shape) < self.mutation_rate
        return box.clip(children + np.where(gene_mask, shift, 0.0) * box.span)
