"""L-SHADE: differential evolution that adapts F and CR, with a shrinking population.

[1] Tanabe and Fukunaga, "Improving the Search Performance of SHADE Using Linear Population Size Reduction", 2014.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.differential import Population, binomial_mask, initial_population, linear_size, midpoint_repair
from solvers.solver import FloatArray, Iterations, Search, SearchBox, Solver, require

DISTRIBUTION_SCALE = 0.1  # of F (Cauchy) and standard deviation of CR (normal) around an entry of the memory [1]


@dataclass(frozen=True)
class LSHADE(Solver):
    """Success-history based adaptive differential evolution, current-to-pbest/1 with an archive.

    Deviation: [1] starts with 18 d members whatever the budget; here the budget decides
    (``docs/explanation/solvers.md``).

    Raises:
        ValueError: a hyper-parameter outside the range stated beside it.
    """

    minimum_population: ClassVar[int] = 4

    population: int | None = None  # N_init >= 4; None: one for ``effort`` evaluations
    effort: int = 120  # >= 1, evaluations of the budget for each member, at least 20 and at most 25 d members
    last_population: int = 4  # >= 4, N_min [1]
    memory_size: int = 6  # H >= 1, entries of the memory of successful F and CR [1]
    best: float = 0.11  # p in (0, 1], share of the population towards which members move [1]
    archive_rate: float = 1.0  # >= 0, r_arc, size of the archive as a share of the population (2.6 in [1])

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.effort >= 1, f"effort = {self.effort} is less than 1")
        require(self.last_population >= 4, f"last_population = {self.last_population} is less than 4")
        require(self.memory_size >= 1, f"memory_size = {self.memory_size} is less than 1")
        require(0.0 < self.best <= 1.0, f"best = {self.best} is not in (0, 1]")
        require(self.archive_rate >= 0.0, f"archive_rate = {self.archive_rate} is negative")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        x = initial_population(box, rng, self.population, self.effort, iterations.evaluations)
        members = Population.of(x, (yield x))
        memory = SuccessMemory(f=np.full(self.memory_size, 0.5), cr=np.full(self.memory_size, 0.5))
        for progress in iterations:
            members.keep_best(linear_size(len(x), self.last_population, progress))
            f, cr = memory.draw(rng, members.size)
            step = f[:, None] * (members.leaders(rng, self.best) - members.x + members.differences(rng))
            mutant = members.x + binomial_mask(rng, cr[:, None], members.x.shape) * step
            trial = midpoint_repair(box, mutant, members.x)
            cost = yield trial
            better = cost < members.cost
            memory.learn(f[better], cr[better], members.cost[better] - cost[better])
            members.replace(rng, better, trial, cost, round(self.archive_rate * members.size))


@dataclass
class SuccessMemory:
    """Means of scale factors and crossover rates that have led to better members.

    Attributes:
        f: M_F, (H,).
        cr: M_CR, (H,); -1 is the terminal value: CR is 0 from then on.
        position: k, the entry that is written next.
    """

    f: FloatArray
    cr: FloatArray
    position: int = 0

    def draw(self, rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
        """F in (0, 1], Cauchy, and CR in [0, 1], normal, around random entries of the memory; (count,) each."""
        entry = rng.integers(len(self.f), size=count)
        f = self.f[entry] + DISTRIBUTION_SCALE * rng.standard_cauchy(count)
        while (low := np.flatnonzero(f <= 0.0)).size:
            f[low] = self.f[entry[low]] + DISTRIBUTION_SCALE * rng.standard_cauchy(low.size)
        cr = rng.normal(self.cr[entry], DISTRIBUTION_SCALE).clip(0.0, 1.0)
        return np.minimum(f, 1.0), np.where(self.cr[entry] < 0.0, 0.0, cr)

    def learn(self, f: FloatArray, cr: FloatArray, gain: FloatArray) -> None:
        """Replace the oldest entry by the Lehmer means of successful F and CR, weighted by their gains; (n,) each."""
        if f.size == 0:
            return
        weight = np.where(np.isfinite(gain), gain, 1.0)
        self.f[self.position] = (weight * f * f).sum() / (weight * f).sum()
        terminal = self.cr[self.position] < 0.0 or cr.max() == 0.0
        self.cr[self.position] = -1.0 if terminal else (weight * cr * cr).sum() / (weight * cr).sum()
        self.position = (self.position + 1) % len(self.f)
