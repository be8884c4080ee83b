"""In which order to visit stops that leave it free: least in free space, over all postures of every stop.

Up to a dozen stops the order is the best there is, by dynamic programming over the sets that are visited (Held and
Karp, 1962), with a state for each posture of the last stop. Beyond, orders are improved by turning parts of them round
and by moving parts elsewhere, until nothing of the kind is better; the bound is then what it takes to reach each stop
from the nearest other one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from problems.base import FloatArray

EXACT = 12  # stops
LONGEST_PART = 3  # stops that are moved elsewhere together
ROUNDS = 200  # of improvements


def shortest_way(costs: Sequence[FloatArray], cyclic: bool) -> tuple[float, list[int]] | None:
    """The cheapest way from layer to layer: what it costs, and the number of its node in each layer.

    Args:
        costs: from each node of a layer to each of the next, (n, m); infinite where there is no way.
        cyclic: whether it ends in the node of that number in which it began.

    Returns:
        None where there is none.
    """
    starts = range(len(costs[0])) if cyclic else [None]
    found = [way for start in starts if (way := _shortest_from(costs, start)) is not None]
    return min(found, key=lambda way: way[0], default=None)


def _shortest_from(costs: Sequence[FloatArray], start: int | None) -> tuple[float, list[int]] | None:
    """The shortest way from one node back to it; from any to any where None."""
    least, origins = np.zeros(len(costs[0])), []
    if start is not None:
        least = np.where(np.arange(least.size) == start, 0.0, np.inf)
    for cost in costs:
        sums = least[:, None] + cost
        origins.append(sums.argmin(axis=0))
        least = sums.min(axis=0)
    last = int(least.argmin()) if start is None else start
    if not np.isfinite(least[last]):
        return None
    chain = [last]
    for origin in reversed(origins):
        chain.append(int(origin[chain[-1]]))
    return float(least[last]), chain[::-1]


@dataclass(frozen=True, eq=False)
class Visits:
    """Stops with postures, all of which are visited once, after a start.

    Attributes:
        sizes: how many postures start and stops have, (m + 1,), the start's first.
        costs: from each posture of start and stops to each, (n, n), s; infinite where there is no way.
        cyclic: whether the way ends in the posture in which it began.
    """

    sizes: tuple[int, ...]
    costs: FloatArray
    cyclic: bool

    @property
    def count(self) -> int:
        """m, without the start."""
        return len(self.sizes) - 1

    def rows(self, stop: int) -> slice:
        """The rows of a stop's postures; 0 is the start."""
        first = sum(self.sizes[:stop])
        return slice(first, first + self.sizes[stop])

    def best_order(self) -> tuple[list[int], float]:
        """Stops from 1 on in the order of the least cost that is found, and a lower bound of any order's, s."""
        if self.count <= EXACT:
            return self._exact()
        orders = [self._improved(order) for order in self._first_orders()]
        return min(orders, key=self.cost), self._reaching()

    def cost(self, order: Sequence[int]) -> float:
        """The least cost of an order over all postures, s."""
        stops = [self.rows(stop) for stop in (0, *order, *([0] if self.cyclic else []))]
        found = shortest_way([self.costs[before, after] for before, after in pairwise(stops)], self.cyclic)
        return np.inf if found is None else found[0]

    def _exact(self) -> tuple[list[int], float]:
        found = [self._exact_from(start) for start in (range(self.sizes[0]) if self.cyclic else [None])]
        return min(found, key=lambda one: one[1])

    def _exact_from(self, start: int | None) -> tuple[list[int], float]:
        """Held and Karp's recursion."""
        n, whole = len(self.costs), (1 << self.count) - 1
        least = np.full((whole + 1, n), np.inf)
        origin = np.zeros((whole + 1, n), dtype=np.int32)
        least[0, self.rows(0)] = 0.0 if start is None else np.where(np.arange(self.sizes[0]) == start, 0.0, np.inf)
        for visited in range(whole):
            for stop in range(1, self.count + 1):
                if visited & (1 << (stop - 1)):
                    continue
                rows, then = self.rows(stop), visited | (1 << (stop - 1))
                sums = least[visited][:, None] + self.costs[:, rows]
                least[then, rows], origin[then, rows] = sums.min(axis=0), sums.argmin(axis=0)
        ends = least[whole] + (0.0 if start is None else self.costs[:, start])
        last = int(ends.argmin())
        return self._traced(origin, whole, last), float(ends[last])

    def _traced(self, origin: np.ndarray, visited: int, node: int) -> list[int]:
        of_node = np.repeat(np.arange(len(self.sizes)), self.sizes)
        order = []
        while visited:
            stop = int(of_node[node])
            order.append(stop)
            node = int(origin[visited, node])
            visited &= ~(1 << (stop - 1))
        return order[::-1]

    def _between(self) -> FloatArray:
        """The least cost from any posture of a stop to any of another, (m + 1, m + 1)."""
        stops = range(len(self.sizes))
        return np.array([[self.costs[self.rows(a), self.rows(b)].min() for b in stops] for a in stops])

    def _first_orders(self) -> Iterator[list[int]]:
        """The nearest stop next, from the start; and as they are given."""
        between, left, order = self._between(), set(range(1, self.count + 1)), [0]
        while left:
            order.append(min(left, key=lambda stop: (between[order[-1], stop], stop)))
            left.remove(order[-1])
        yield order[1:]
        yield list(range(1, self.count + 1))

    def _improved(self, order: list[int]) -> list[int]:
        """Until no change of one part makes it better."""
        cost = self.cost(order)
        for _ in range(ROUNDS):
            better = next((other for other in _changed(order) if self.cost(other) < cost - 1e-12), None)
            if better is None:
                return order
            order, cost = better, self.cost(better)
        return order

    def _reaching(self) -> float:
        """The least time to reach every stop from the nearest other one, and to come back, s."""
        between = self._between()
        np.fill_diagonal(between, np.inf)
        least = between.min(axis=0)
        return float(least[1:].sum() + (least[0] if self.cyclic else 0.0))


def _changed(order: list[int]) -> Iterator[list[int]]:
    """Orders with one part turned round, or moved elsewhere."""
    n = len(order)
    for first in range(n - 1):
        for last in range(first + 2, n + 1):
            yield order[:first] + order[first:last][::-1] + order[last:]
    for length in range(1, LONGEST_PART + 1):
        for first in range(n - length + 1):
            part, rest = order[first : first + length], order[:first] + order[first + length :]
            yield from (rest[:place] + part + rest[place:] for place in range(len(rest) + 1) if place != first)
