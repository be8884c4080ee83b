"""What searches by differences share: initial_population, difference vectors, the way back into the box.

A difference of two members is a step whose size and direction fit the population as it is: large while it is spread
over the box, small when it has gathered (Storn and Price, "Differential Evolution", 1997).
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from solvers.box import Box, FloatArray

SCOUTS = 20  # priced before anything else: they tell how large a part of the budget one evaluation is
UNKNOWN_BUDGET = 30_000  # evaluations assumed where the budget is not stated in evaluations
MEMBERS_A_DIMENSION = 25  # initial_population at the most

IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
Founding = Generator[FloatArray, FloatArray, tuple[FloatArray, FloatArray]]


def initial_population(
    box: Box, rng: np.random.Generator, size: int | None, effort: int, iterations: Iterator[float]
) -> Founding:
    """Random members x (m, d) and their costs (m,).

    Args:
        box: where to search.
        rng: the search's own.
        size: m; if None, one member for ``effort`` evaluations of the budget, from 20 up to 25 for each dimension.
        effort: evaluations a member.
        iterations: of the search; the first one is taken up here if m has to be found out.
    """
    x = box.sample(rng, SCOUTS if size is None else size)
    cost = yield x
    if size is not None:
        return x, cost
    progress = next(iterations, 1.0)
    budget = SCOUTS / progress if progress > 0.0 else UNKNOWN_BUDGET
    more = box.sample(rng, int(np.clip(budget / effort, SCOUTS, MEMBERS_A_DIMENSION * box.dimension)) - SCOUTS)
    if len(more) == 0:
        return x, cost
    return np.concatenate([x, more]), np.concatenate([cost, (yield more)])


@dataclass
class Population:
    """m members, the best first; and some of those that better ones have replaced.

    Attributes:
        x: positions, (m, d).
        cost: of them, (m,), ascending.
        replaced: positions, (n, d).
    """

    x: FloatArray
    cost: FloatArray
    replaced: FloatArray

    @classmethod
    def of(cls, x: FloatArray, cost: FloatArray) -> Population:
        """A population that has replaced nobody yet."""
        order = np.argsort(cost, kind="stable")
        return cls(x[order], cost[order], np.empty((0, x.shape[1])))

    @property
    def size(self) -> int:
        """How many, m."""
        return len(self.x)

    def leaders(self, rng: np.random.Generator, share: float) -> FloatArray:
        """For each member one of the best ``share`` of all, two at the least; (m, d)."""
        best = max(2, round(share * self.size))
        leaders: FloatArray = self.x[rng.integers(min(best, self.size), size=self.size)]
        return leaders

    def differences(self, rng: np.random.Generator) -> FloatArray:
        """For each member the difference of two others, of which the second may have been replaced; (m, d)."""
        m, everyone = self.size, np.concatenate([self.x, self.replaced])
        own = np.arange(m)
        first = (own + rng.integers(1, m, size=m)) % m
        second = rng.integers(len(everyone), size=m)
        clash = (second == own) | (second == first)
        while clash.any():
            second[clash] = rng.integers(len(everyone), size=int(clash.sum()))
            clash = (second == own) | (second == first)
        difference: FloatArray = self.x[first] - everyone[second]
        return difference

    def replace(self, rng: np.random.Generator, better: BoolArray, x: FloatArray, cost: FloatArray, keep: int) -> None:
        """Put better candidates in the place of members; of the replaced ones ``keep`` at most are remembered."""
        replaced = np.concatenate([self.replaced, self.x[better]])
        self.replaced = replaced[rng.permutation(len(replaced))[:keep]] if len(replaced) > keep else replaced
        self.x = np.where(better[:, None], x, self.x)
        self.cost = np.where(better, cost, self.cost)

    def ranked(self, size: int) -> IndexArray:
        """Sort by cost and keep the best ``size``; returns which members those were."""
        order = np.argsort(self.cost, kind="stable")[:size]
        self.x, self.cost = self.x[order], self.cost[order]
        return order


def binomial_mask(rng: np.random.Generator, rate: FloatArray | float, shape: tuple[int, ...]) -> BoolArray:
    """Which components of each member change: each with probability ``rate``, one at the least. (m, d)."""
    mask = rng.random(shape) < rate
    mask[np.arange(shape[0]), rng.integers(shape[1], size=shape[0])] = True
    return mask


def midpoint_repair(box: Box, candidates: FloatArray, parents: FloatArray) -> FloatArray:
    """Components out of the box go halfway from the parent's to the bound. (m, d)."""
    inside = np.where(candidates < box.lower, (parents + box.lower) / 2.0, candidates)
    return np.where(inside > box.upper, (parents + box.upper) / 2.0, inside)


def linear_size(first: int, last: int, progress: float) -> int:
    """Members left when so much of the budget is used: linear from first to last."""
    return max(last, round(first + (last - first) * progress))
