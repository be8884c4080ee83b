"""L-SHADE: success-history based adaptive differential evolution with a shrinking population.

Tanabe and Fukunaga, "Improving the Search Performance of SHADE Using Linear Population Size Reduction", 2014.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.box import Box, FloatArray
from solvers.differential import Population, crossing, founders, halfway_back, shrunk
from solvers.solver import Search, Solver, require


@dataclass(frozen=True)
class LSHADE(Solver):
    """Success-history based adaptive differential evolution: current-to-pbest/1 with an archive."""

    minimum_population: ClassVar[int] = 4

    population: int | None = None
    effort: int = 60
    history: int = 6
    best: float = 0.11
    memory: float = 1.0

    def search(self, box: Box, rng: np.random.Generator, iterations: Iterator[float]) -> Search:
        """Mutate towards the better, cross, select, learn what worked, shrink."""
        x, cost = yield from founders(box, rng, self.population, self.effort, iterations)
        members, first = Population.of(x, cost), len(x)
        history = History(np.full(self.history, 0.5), np.full(self.history, 0.5))
        for progress in iterations:
            members.ranked(shrunk(first, 4, progress))
            f, rate = history.draw(rng, members.size)
            step = f[:, None] * (members.leaders(rng, self.best) - members.x + members.differences(rng))
            mask = crossing(rng, rate[:, None], members.x.shape)
            tried = halfway_back(box, members.x + mask * step, members.x)
            cost = yield tried
            better = cost < members.cost
            history.learn(f[better], rate[better], (members.cost - cost)[better])
            members.replace(rng, better, tried, cost, round(self.memory * members.size))


@dataclass
class History:
    """Scale factors F and crossover rates CR that have led to better members."""

    f: FloatArray
    rate: FloatArray
    turn: int = 0

    def draw(self, rng: np.random.Generator, count: int) -> tuple[FloatArray, FloatArray]:
        """F in (0, 1] from Cauchy distributions, CR in [0, 1] from normal ones, around entries of the history."""
        entry = rng.integers(len(self.f), size=count)
        f = self.f[entry] + 0.1 * rng.standard_cauchy(count)
        while (f <= 0.0).any():
            low = f <= 0.0
            f[low] = self.f[entry[low]] + 0.1 * rng.standard_cauchy(int(low.sum()))
        rate = np.where(self.rate[entry] < 0.0, 0.0, rng.normal(self.rate[entry], 0.1)).clip(0.0, 1.0)
        return np.minimum(f, 1.0), rate

    def learn(self, f: FloatArray, rate: FloatArray, gain: FloatArray) -> None:
        """Lehmer means of what worked, weighted by how much it gained, take the place of the oldest entry."""
        gain = np.where(np.isfinite(gain), gain, 1.0)
        if f.size == 0 or gain.sum() <= 0:
            return
        self.f[self.turn] = np.sum(gain * f * f) / np.sum(gain * f)
        top = np.sum(gain * rate)
        if self.rate[self.turn] < 0.0 or rate.max() == 0.0:
            self.rate[self.turn] = -1.0
        else:
            self.rate[self.turn] = np.sum(gain * rate * rate) / top
        self.turn = (self.turn + 1) % len(self.f)
