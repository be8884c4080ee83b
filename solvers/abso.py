"""ABSO: an adaptive beetle swarm. Ours: what becomes of the paper's BSO once it has to compete.

A beetle of the paper has a velocity, smells at two antennae on both sides of it and steps towards the better one; so
does this one. What differs, and what it is worth (``docs/solvers.md`` has the ablation):

* **Arms from the swarm.** (29)-(31) stretch the antennae along the velocity, by a length that decays on its own. Here
  the arm is a difference of two other beetles: as long as the swarm is still uncertain, and in those directions.
* **A beetle moves only where it improves**, to the better antenna. (26) moves it anyway, on the mean of both rules.
* **The second antenna only when the first finds nothing better**: one or two evaluations a step, not three.
* **Many leaders**: (27) pulls every beetle towards the one best; here each picks one of the best, fewer and fewer.
* **Momentum**: a velocity remembers the last step only if that step was a success.
* **Only some directions at a time**: axes of the box, or the swarm's own principal axes; a coin decides.
* **A shrinking swarm**: many beetles to look around, few to finish.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from solvers.box import Box, FloatArray
from solvers.differential import Population, binomial_mask, initial_population, linear_size, midpoint_repair
from solvers.solver import Search, Solver, require
from solvers.swarm import scheduled


@dataclass(frozen=True)
class AdaptiveBeetleSwarm(Solver):
    """Beetles with difference arms, momentum and a shrinking swarm.

    How the defaults were chosen: ``docs/solvers.md`` and ``benchmarks/tune.py``.

    Raises:
        ValueError: a hyper-parameter outside the range stated beside it.
    """

    minimum_population: ClassVar[int] = 4

    population: int | None = None  # m >= 4, beetles at the start; None: one for ``effort`` evaluations
    effort: int = 170  # >= 1, evaluations of the budget for each beetle, at least 20 and at most 25 d beetles
    last_population: int = 4  # >= 4, beetles at the end
    arm: float = 0.5  # > 0, length of the arm and of the pull, as a share of a difference
    momentum: float = 0.4  # >= 0, of the last step, if it was a success
    leaders_first: float = 0.4  # in (0, 1], share of the swarm that leads, at the start
    leaders_last: float = 0.05  # in (0, 1], at the end
    directions_first: float = 0.7  # in [0, 1], share of the directions in which a step goes, at the start
    directions_last: float = 1.0  # in [0, 1], at the end
    principal: float = 0.5  # in [0, 1], how often the directions are the principal axes of the better half
    memory: float = 1.0  # >= 0, how many replaced positions are remembered for arms, as a share of the swarm

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.effort >= 1, f"effort = {self.effort} is less than 1")
        require(self.last_population >= 4, f"last_population = {self.last_population} is less than 4")
        require(self.arm > 0.0, f"arm = {self.arm} is not positive")
        require(self.momentum >= 0.0 and self.memory >= 0.0, "momentum and memory are not negative")
        for name in ("leaders_first", "leaders_last"):
            require(0.0 < getattr(self, name) <= 1.0, f"{name} = {getattr(self, name)} is not in (0, 1]")
        for name in ("directions_first", "directions_last", "principal"):
            require(0.0 <= getattr(self, name) <= 1.0, f"{name} = {getattr(self, name)} is not in [0, 1]")

    def search(self, box: Box, rng: np.random.Generator, iterations: Iterator[float]) -> Search:
        """Pull, smell to the right, smell to the left if need be, move where it is better."""
        x, cost = yield from initial_population(box, rng, self.population, self.effort, iterations)
        swarm, size, moved = Population.of(x, cost), len(x), np.zeros_like(x)
        for progress in iterations:
            moved = moved[swarm.ranked(linear_size(size, self.last_population, progress))]
            leaders = swarm.leaders(rng, scheduled(self.leaders_first, self.leaders_last, progress))
            velocity = self.arm * (leaders - swarm.x) + self.momentum * moved
            arm = self.arm * swarm.differences(rng)
            share = scheduled(self.directions_first, self.directions_last, progress)
            axes, chosen = self.axes(rng, swarm), binomial_mask(rng, share, swarm.x.shape)
            antennae = ((chosen * ((velocity + side * arm) @ axes)) @ axes.T for side in (1.0, -1.0))
            right, left = (midpoint_repair(box, swarm.x + antenna, swarm.x) for antenna in antennae)
            found = yield right
            disappointed = np.flatnonzero(found >= swarm.cost)
            if disappointed.size:
                other = yield left[disappointed]
                rescued = other < found[disappointed]
                right[disappointed[rescued]] = left[disappointed[rescued]]
                found[disappointed[rescued]] = other[rescued]
            better = found < swarm.cost
            moved = np.where(better[:, None], right - swarm.x, 0.0)
            swarm.replace(rng, better, right, found, round(self.memory * swarm.size))

    def axes(self, rng: np.random.Generator, swarm: Population) -> FloatArray:
        """Orthogonal directions, the columns of (d, d): those of the box, or the principal ones of the better half."""
        dimension = swarm.x.shape[1]
        if rng.random() >= self.principal:
            return np.eye(dimension)
        better = swarm.x[: max(2, swarm.size // 2)]
        return np.asarray(np.linalg.eigh(np.cov(better.T).reshape(dimension, dimension))[1])
