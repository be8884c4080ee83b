"""ABSO: an adaptive beetle swarm, developed in this project from the paper's BSO.

A beetle of the paper has a velocity, evaluates its two antennae on both sides of it and steps towards the better one;
so does this one. What differs, and what it is worth (``docs/explanation/solvers.md`` has the ablation):

* **Antennae from the swarm.** (29)-(31) place the antennae along the velocity, at a length that decays by a fixed rate.
  Here an antenna is a difference of two other beetles: as long, and in those directions, as the swarm is still spread.
* **A beetle moves only where it improves**, to the better antenna. (26) always moves it, by the mean of both rules.
* **The second antenna only when the first finds nothing better**: one or two evaluations a step, not three.
* **Many leaders**: (27) pulls every beetle towards the one best; here each picks one of the best, of which there are
  fewer and fewer.
* **Momentum**: the velocity includes the last step only if that step was a success.
* **A random subset of directions in each step**: of the axes of the box, or of the swarm's principal axes, at random.
  These change slowly, and are computed anew after ten evaluations for each dimension.
* **A shrinking swarm**: many beetles to explore, few to converge.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import ClassVar

import numpy as np

from solvers.differential import Population, binomial_mask, initial_population, linear_size, midpoint_repair
from solvers.solver import FloatArray, Iterations, Search, SearchBox, Solver, require
from solvers.swarm import linear_schedule
from solvers.threads import one_thread

AXES_KEPT = 10  # evaluations for each dimension until the swarm's axes are computed anew


@dataclass(frozen=True)
class AdaptiveBeetleSwarm(Solver):
    """A swarm of beetles whose antennae are differences, with momentum and a shrinking swarm.

    How the defaults were chosen: ``docs/explanation/solvers.md`` and ``benchmarks/tune.py``.

    Raises:
        ValueError: a hyper-parameter outside the range stated beside it.
    """

    minimum_population: ClassVar[int] = 4

    population: int | None = None  # m >= 4, beetles at the start; None: one for ``effort`` evaluations
    effort: int = 170  # >= 1, evaluations of the budget for each beetle, at least 20 and at most 25 d beetles
    last_population: int = 4  # >= 4, beetles at the end
    antenna: float = 0.5  # > 0, length of the antenna and of the pull to a leader, as a share of a difference
    momentum: float = 0.4  # >= 0, share of the last step that is repeated if it was a success
    leaders_first: float = 0.4  # in (0, 1], share of the swarm that leads, at the start
    leaders_last: float = 0.05  # in (0, 1], at the end
    directions_first: float = 0.7  # in [0, 1], share of the directions in which a step moves, at the start
    directions_last: float = 1.0  # in [0, 1], at the end
    principal: float = 0.3  # in [0, 1], how often the directions are the principal axes of the better half
    archive_rate: float = 1.0  # >= 0, size of the archive of replaced positions as a share of the swarm

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.effort >= 1, f"effort = {self.effort} is less than 1")
        require(self.last_population >= 4, f"last_population = {self.last_population} is less than 4")
        require(self.antenna > 0.0, f"antenna = {self.antenna} is not positive")
        for name in ("momentum", "archive_rate"):
            require(getattr(self, name) >= 0.0, f"{name} = {getattr(self, name)} is negative")
        for name in ("leaders_first", "leaders_last"):
            require(0.0 < getattr(self, name) <= 1.0, f"{name} = {getattr(self, name)} is not in (0, 1]")
        for name in ("directions_first", "directions_last", "principal"):
            require(0.0 <= getattr(self, name) <= 1.0, f"{name} = {getattr(self, name)} is not in [0, 1]")

    def search(self, box: SearchBox, rng: np.random.Generator, iterations: Iterations) -> Search:
        """Candidates at the right antenna, the left one where that failed, and the better positions."""
        x = initial_population(box, rng, self.population, self.effort, iterations.evaluations)
        swarm, last_step = Population.of(x, (yield x)), np.zeros_like(x)
        axes, age = np.eye(box.dimension), inf  # the swarm's, and evaluations since
        for progress in iterations:
            last_step = last_step[swarm.keep_best(linear_size(len(x), self.last_population, progress))]
            leaders = swarm.leaders(rng, linear_schedule(self.leaders_first, self.leaders_last, progress))
            velocity = self.antenna * (leaders - swarm.x) + self.momentum * last_step
            antenna = self.antenna * swarm.differences(rng)
            share = linear_schedule(self.directions_first, self.directions_last, progress)
            is_principal, mask = rng.random() < self.principal, binomial_mask(rng, share, swarm.x.shape)
            steps = [velocity + antenna, velocity - antenna]
            if is_principal:
                with one_thread():
                    if age >= AXES_KEPT * box.dimension:
                        axes, age = principal_axes(swarm.x), 0
                    steps = [(mask * (step @ axes)) @ axes.T for step in steps]
            else:
                steps = [mask * step for step in steps]
            right = midpoint_repair(box, swarm.x + steps[0], swarm.x)
            cost = yield right
            failed = np.flatnonzero(cost >= swarm.cost)
            age += swarm.size + failed.size
            if failed.size:
                left = midpoint_repair(box, swarm.x[failed] + steps[1][failed], swarm.x[failed])
                cost_left = yield left
                improved = cost_left < cost[failed]
                right[failed[improved]] = left[improved]
                cost[failed[improved]] = cost_left[improved]
            better = cost < swarm.cost
            last_step = np.where(better[:, None], right - swarm.x, 0.0)
            swarm.replace(rng, better, right, cost, round(self.archive_rate * swarm.size))


def principal_axes(x: FloatArray) -> FloatArray:
    """Orthogonal directions, the columns of (d, d): the principal ones of the better half of members (m, d)."""
    dimension = x.shape[1]
    better = x[: max(2, len(x) // 2)]
    return np.asarray(np.linalg.eigh(np.cov(better.T).reshape(dimension, dimension))[1])
