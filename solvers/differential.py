"""Common parts of solvers by differential evolution.

A difference of two members is a step whose size and direction fit the population as it is: large while it is spread
over the box, small when it has contracted (Storn and Price, "Differential Evolution", 1997).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.solver import DEFAULT_EVALUATIONS, FloatArray, SearchBox

SMALLEST_POPULATION = 20
LARGEST_POPULATION_PER_DIMENSION = 25

IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]


def initial_population(
    box: SearchBox, rng: np.random.Generator, size: int | None, effort: int, evaluations: int | None
) -> FloatArray:
    """Random members x (m, d), known ones first.

    Args:
        box: where to search.
        rng: the search's own.
        size: m; if None, one member for ``effort`` evaluations of the budget, from 20 up to 25 for each dimension.
        effort: evaluations a member.
        evaluations: the budget; if None, as many as a solver has by default.
    """
    if size is None:
        members = (DEFAULT_EVALUATIONS if evaluations is None else evaluations) // effort
        size = int(np.clip(members, SMALLEST_POPULATION, LARGEST_POPULATION_PER_DIMENSION * box.dimension))
    return box.initial(rng, size)


@dataclass
class Population:
    """m members, the best first, and an archive of some that better ones have replaced.

    Attributes:
        x: positions, (m, d).
        cost: of them, (m,), ascending.
        archive: positions of replaced members, (n, d).
    """

    x: FloatArray
    cost: FloatArray
    archive: FloatArray

    @classmethod
    def of(cls, x: FloatArray, cost: FloatArray) -> Population:
        """A population with an empty archive."""
        order = np.argsort(cost, kind="stable")
        return cls(x[order], cost[order], np.empty((0, x.shape[1])))

    @property
    def size(self) -> int:
        """The number of members, m."""
        return len(self.x)

    def leaders(self, rng: np.random.Generator, share: float) -> FloatArray:
        """Members drawn from the best ``share`` of all, two at the least, one for each member; (m, d)."""
        best = max(2, round(share * self.size))
        leaders: FloatArray = self.x[rng.integers(min(best, self.size), size=self.size)]
        return leaders

    def differences(self, rng: np.random.Generator) -> FloatArray:
        """Differences of two other members for each member, the second perhaps from the archive; (m, d)."""
        m, pool = self.size, np.concatenate([self.x, self.archive])
        own = np.arange(m)
        first = (own + rng.integers(1, m, size=m)) % m
        second = rng.integers(len(pool), size=m)
        clash = (second == own) | (second == first)
        while clash.any():
            second[clash] = rng.integers(len(pool), size=int(clash.sum()))
            clash = (second == own) | (second == first)
        difference: FloatArray = self.x[first] - pool[second]
        return difference

    def replace(
        self, rng: np.random.Generator, better: BoolArray, x: FloatArray, cost: FloatArray, archive_size: int
    ) -> None:
        """Replace members by better candidates x (m, d) of costs (m,); the archive keeps ``archive_size`` at most."""
        archive = np.concatenate([self.archive, self.x[better]])
        full = len(archive) > archive_size
        self.archive = archive[rng.permutation(len(archive))[:archive_size]] if full else archive
        self.x = np.where(better[:, None], x, self.x)
        self.cost = np.where(better, cost, self.cost)

    def keep_best(self, size: int) -> IndexArray:
        """Sort by cost and keep the best ``size``; returns their former indices."""
        order = np.argsort(self.cost, kind="stable")[:size]
        self.x, self.cost = self.x[order], self.cost[order]
        return order


def binomial_mask(rng: np.random.Generator, rate: FloatArray | float, shape: tuple[int, ...]) -> BoolArray:
    """A mask (m, d) of components that change, each with probability ``rate``, one a member at the least."""
    mask = rng.random(shape) < rate
    mask[np.arange(shape[0]), rng.integers(shape[1], size=shape[0])] = True
    return mask


def midpoint_repair(box: SearchBox, candidates: FloatArray, parents: FloatArray) -> FloatArray:
    """Candidates (m, d) whose components out of the box are midpoints of the parent's and the bound."""
    for bound, is_out in ((box.lower, candidates < box.lower), (box.upper, candidates > box.upper)):
        if is_out.any():
            candidates = np.where(is_out, (parents + bound) / 2.0, candidates)
    return candidates


def linear_size(first: int, last: int, progress: float) -> int:
    """The size of a population that shrinks linearly from first to last as progress goes from 0 to 1."""
    return max(last, round(first + (last - first) * progress))
