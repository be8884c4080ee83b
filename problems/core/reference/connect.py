"""Paths between two postures: RRT-Connect (Kuffner and LaValle, 2000), then shortcuts.

The compiled core draws the same numbers and finds the same ways.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from problems.base import FloatArray
from problems.core.interface import MovingSolids, PathSearch
from problems.core.reference.clearance import any_below
from problems.core.reference.model import Model
from problems.core.reference.postures import Postures, Side

POSTURES_AT_ONCE = 64  # postures along an edge
FIRST_NODES = 64  # for which a tree has room; twice as many whenever that is not enough


class SplitMix64:
    """A generator of random numbers (Steele, Lea and Flood, 2014).

    Args:
        seed: where they begin.
    """

    MASK = 0xFFFFFFFFFFFFFFFF

    def __init__(self, seed: int) -> None:
        self._state = seed & self.MASK

    def uniform(self) -> float:
        """The next number from 0 up to 1."""
        self._state = (self._state + 0x9E3779B97F4A7C15) & self.MASK
        z = self._state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & self.MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & self.MASK
        return float((z ^ (z >> 31)) >> 11) * 2.0**-53


def _square(way: FloatArray) -> FloatArray:
    """The squares of lengths, (...,) of (..., dof), added one after the other."""
    squares = way * way
    total = squares[..., 0].copy()
    for joint in range(1, way.shape[-1]):
        total += squares[..., joint]
    return total


class Tree:
    """A tree of postures that are reached from the first.

    Args:
        root: the first, (dof,), rad.
    """

    def __init__(self, root: FloatArray) -> None:
        self._values, self._parents = np.tile(root, (FIRST_NODES, 1)), [-1]

    def at(self, node: int) -> FloatArray:
        """The posture of a node, (dof,)."""
        return np.asarray(self._values[node])

    def add(self, theta: FloatArray, parent: int) -> int:
        """Add a posture and return its number."""
        if len(self._parents) == len(self._values):
            self._values = np.concatenate([self._values, self._values])
        self._values[len(self._parents)] = theta
        self._parents.append(parent)
        return len(self._parents) - 1

    def nearest(self, theta: FloatArray) -> int:
        """The number of the posture that is nearest."""
        return int(_square(self._values[: len(self._parents)] - theta).argmin())

    def chain(self, node: int) -> list[FloatArray]:
        """The postures from one back to the first."""
        found = []
        while node >= 0:
            found.append(self._values[node])
            node = self._parents[node]
        return found


class Connect:
    """A search for paths of one robot among solids.

    Args:
        model: of both.
        sides: what has to keep a distance.
        search: how.
    """

    def __init__(self, model: Model, sides: Sequence[Side], search: PathSearch) -> None:
        self._model, self._sides, self._search, self._random = model, sides, search, SplitMix64(search.seed)

    def __call__(self, start: FloatArray, goal: FloatArray) -> list[FloatArray]:
        """Postures from start to goal with clear straight lines between them; none where none was found."""
        (lower, upper), drawn = self._search.box, goal
        trees = Tree(start), Tree(goal)
        for number in range(self._search.extensions):
            side = number % 2
            if number:
                shares = np.array([self._random.uniform() for _ in start])
                drawn = lower + shares * (upper - lower)
            own = self._extended(trees[side], drawn)
            if own < 0:
                continue
            toward, other, node = trees[side].at(own), -1, 0
            while node >= 0:
                node = self._extended(trees[1 - side], toward)
                other = node if node >= 0 else other
                if node >= 0 and (toward == trees[1 - side].at(node)).all():
                    ends = (other, own) if side else (own, other)
                    return self._shortened(trees[0].chain(ends[0])[::-1] + trees[1].chain(ends[1])[1:])
        return []

    def _moving(self, theta: FloatArray) -> MovingSolids | None:
        """The solids where they are when postures (n, dof) are passed, approximately."""
        search = self._search
        if search.drifts is None:
            return None
        times = np.zeros(len(theta))
        if search.schedule is not None:
            *slopes, offset, first, last = search.schedule.numbers.tolist()
            times += offset
            for joint, slope in enumerate(slopes):
                times += slope * theta[:, joint]
            times = np.clip(times, first, last)
        return MovingSolids(search.drifts, times)

    def _clear(self, start: FloatArray, end: FloatArray) -> bool:
        """Whether all postures between two, the first excluded, have larger margins than given."""
        way = end - start
        count = max(1, math.ceil(float(np.abs(way).max()) / self._search.step))
        batches = -(-count // POSTURES_AT_ONCE)
        for batch in range(batches):  # postures far apart at once: contact is found early
            shares = np.arange(batch + 1, count + 1, batches) / count
            theta = start + shares[:, None] * way
            errors = None if self._search.errors is None else np.tile(self._search.errors, (len(theta), 1))
            postures = Postures(self._model, theta, self._moving(theta), errors)
            if any(any_below(side, postures, self._search.extra_margin) for side in self._sides):
                return False
        return True

    def _extended(self, tree: Tree, toward: FloatArray) -> int:
        """A new node at a posture, or as near to it as an edge may reach; negative where the edge is not clear."""
        near = tree.nearest(toward)
        start = tree.at(near)
        length = math.sqrt(float(_square(toward - start)))
        if length == 0.0:
            return near
        end = toward if length <= self._search.reach else start + self._search.reach / length * (toward - start)
        return tree.add(end, near) if self._clear(start, end) else -1

    def _shortened(self, path: list[FloatArray]) -> list[FloatArray]:
        """The path with straight lines between two points drawn at random, where they are clear."""
        for _ in range(self._search.shortcuts):
            if len(path) <= 2:
                break
            last = len(path) - 1
            first, second = sorted([self._random.uniform() * last, self._random.uniform() * last])
            if int(first) == int(second):
                continue
            one, two = _between(path, first), _between(path, second)
            if self._clear(one, two):
                path = [*path[: int(first) + 1], one, two, *path[int(second) + 1 :]]
        return path


def _between(path: Sequence[FloatArray], place: float) -> FloatArray:
    """The point of a path at a place: number of an edge, and a share of it."""
    before = min(int(place), len(path) - 2)
    return path[before] + (place - before) * (path[before + 1] - path[before])
