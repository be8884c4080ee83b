"""L-SHADE: differential evolution that learns its own settings, with a shrinking population.

[1] Tanabe and Fukunaga, "Improving the Search Performance of SHADE Using Linear Population Size Reduction", 2014.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.box import Box, FloatArray
from solvers.differential import Population, binomial_mask, initial_population, linear_size, midpoint_repair
from solvers.solver import Search, Solver, require

WIDTH = 0.1  # of the distributions around an entry of the history [1]


@dataclass(frozen=True)
class LSHADE(Solver):
    """Success-history based adaptive differential evolution, current-to-pbest/1 with an archive.

    [1] starts with 18 d members whatever the budget; ours have a budget each (``docs/solvers.md``).

    Raises:
        ValueError: a hyper-parameter outside the range stated beside it.
    """

    minimum_population: ClassVar[int] = 4

    population: int | None = None  # N_init >= 4; None: one for ``effort`` evaluations
    effort: int = 120  # >= 1, evaluations of the budget for each member, at least 20 and at most 25 d members
    last_population: int = 4  # >= 4, N_min [1]
    history: int = 6  # H >= 1, entries of the success history [1]
    best: float = 0.11  # p in (0, 1], share of the population towards which members move [1]
    memory: float = 1.0  # >= 0, archive size as a share of the population (2.6 in [1])

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.effort >= 1, f"effort = {self.effort} is less than 1")
        require(self.last_population >= 4, f"last_population = {self.last_population} is less than 4")
        require(self.history >= 1, f"history = {self.history} is less than 1")
        require(0.0 < self.best <= 1.0, f"best = {self.best} is not in (0, 1]")
        require(self.memory >= 0.0, f"memory = {self.memory} is negative")

    def search(self, box: Box, rng: np.random.Generator, iterations: Iterator[float]) -> Search:
        """Mutate, cross, select, learn what worked, shrink."""
        x, cost = yield from initial_population(box, rng, self.population, self.effort, iterations)
        members, size = Population.of(x, cost), len(x)
        history = History(np.full(self.history, 0.5), np.full(self.history, 0.5))
        for progress in iterations:
            members.ranked(linear_size(size, self.last_population, progress))
            f, cr = history.draw(rng, members.size)
            step = f[:, None] * (members.leaders(rng, self.best) - members.x + members.differences(rng))
            mutant = members.x + binomial_mask(rng, cr[:, None], members.x.shape) * step
            tried = midpoint_repair(box, mutant, members.x)
            cost = yield tried
            better = cost < members.cost
            history.learn(f[better], cr[better], members.cost[better] - cost[better])
            members.replace(rng, better, tried, cost, round(self.memory * members.size))


@dataclass
class History:
    """Scale factors and crossover rates that have led to better members.

    Attributes:
        f: M_F, (H,).
        cr: M_CR, (H,); -1 is the terminal value, from which CR is 0 ever after.
        turn: the entry that is written next.
    """

    f: FloatArray
    cr: FloatArray
    turn: int = 0

    def draw(self, rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
        """F in (0, 1], Cauchy, and CR in [0, 1], normal, around entries of the history; (count,) each."""
        entry = rng.integers(len(self.f), size=count)
        f = self.f[entry] + WIDTH * rng.standard_cauchy(count)
        while (low := np.flatnonzero(f <= 0.0)).size:
            f[low] = self.f[entry[low]] + WIDTH * rng.standard_cauchy(low.size)
        cr = rng.normal(self.cr[entry], WIDTH).clip(0.0, 1.0)
        return np.minimum(f, 1.0), np.where(self.cr[entry] < 0.0, 0.0, cr)

    def learn(self, f: FloatArray, cr: FloatArray, gain: FloatArray) -> None:
        """Replace the oldest entry by the Lehmer means of what worked, weighted by what it gained; (n,) each."""
        if f.size == 0:
            return
        weight = np.where(np.isfinite(gain), gain, 1.0)
        self.f[self.turn] = (weight * f * f).sum() / (weight * f).sum()
        terminal = self.cr[self.turn] < 0.0 or cr.max() == 0.0
        self.cr[self.turn] = -1.0 if terminal else (weight * cr * cr).sum() / (weight * cr).sum()
        self.turn = (self.turn + 1) % len(self.f)
