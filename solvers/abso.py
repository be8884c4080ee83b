"""ABSO: an adaptive beetle swarm. Ours; what is left of the paper's BSO, and what it takes to be competitive.

A beetle of the paper smells on both sides of its velocity and steps towards the better side. So does this one, with four
changes:
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
class AdaptiveBeetleSwarm(Solver):
    minimum_population: ClassVar[int] = 4

    population: int | None = None
    effort: int = 120
    momentum: float = 0.4
    arm: float = 0.5
    mask: float = 0.8
    best_first: float = 0.25
    best_last: float = 0.05
    memory: float = 0.5

    def search(self, box: Box, rng: np.random.Generator, iterations: Iterator[float]) -> Search:
        x, cost = yield from founders(box, rng, self.population, self.effort, iterations)
        swarm, first = Population.of(x, cost), len(x)
        moved = np.zeros_like(x)
        for progress in iterations:
            moved = moved[swarm.ranked(shrunk(first, 4, progress))]
            share = self.best_first + (self.best_last - self.best_first) * progress
            q = 0.7 if progress < 0.2 else 0.8 if progress < 0.4 else 1.2
            velocity = q * self.arm * (swarm.leaders(rng, share) - swarm.x) + self.momentum * moved
            arm = self.arm * swarm.differences(rng)
            mask = crossing(rng, self.mask, swarm.x.shape)
            tried = halfway_back(box, swarm.x + mask * (velocity + arm), swarm.x)
            cost = yield tried
            worse = cost >= swarm.cost
            if worse.any():
                left = halfway_back(box, swarm.x + mask * (velocity - arm), swarm.x)[worse]
                cost_left = yield left
                prefer = cost_left < cost[worse]
                tried[np.flatnonzero(worse)[prefer]] = left[prefer]
                cost = cost.copy()
                cost[np.flatnonzero(worse)[prefer]] = cost_left[prefer]
            better = cost < swarm.cost
            moved = np.where(better[:, None], tried - swarm.x, 0.0)
            swarm.replace(rng, better, tried, cost, round(self.memory * swarm.size))
