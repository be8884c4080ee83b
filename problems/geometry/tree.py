"""Balls in a tree of balls: what is far from a node is far from all that it holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.geometry.proof import Balls

FANOUT = 4  # children of a node
RADIUS_ROUNDING = 1e-12  # relative: what a radius may lack


@dataclass(frozen=True, eq=False)
class BallTree:
    """A tree of balls, the root first, children side by side; a node without children is a given ball.

    Attributes:
        nodes: balls, each around those of its children.
        first: number of the first child of each, (n,).
        count: of the children, (n,); 0 of a ball itself.
    """

    nodes: Balls
    first: NDArray[np.intp]
    count: NDArray[np.intp]

    @classmethod
    def of(cls, balls: Balls) -> BallTree:
        """A tree of one ball or more, cut in halves repeatedly along the longest side of their centres' box."""
        members: list[NDArray[np.intp]] = [np.arange(len(balls))]
        first, count, number = [], [], 0
        while number < len(members):
            parts = _divided(members[number], balls.centers)
            first.append(len(members))
            count.append(len(parts))
            members += parts
            number += 1
        around = [_around(balls, own) for own in members]
        nodes = Balls(np.array([center for center, _ in around]), np.array([radius for _, radius in around]))
        return cls(nodes, np.array(first, dtype=np.intp), np.array(count, dtype=np.intp))

    @classmethod
    def combined(cls, trees: Sequence[BallTree]) -> BallTree:
        """Several trees in one list of nodes, one after the other."""
        starts = np.cumsum([0, *(len(tree.count) for tree in trees[:-1])])
        nodes = Balls(*(np.concatenate([getattr(t.nodes, name) for t in trees]) for name in ("centers", "radii")))
        first = np.concatenate([tree.first + start for tree, start in zip(trees, starts, strict=True)])
        return cls(nodes, first, np.concatenate([tree.count for tree in trees]))

    @property
    def leaves(self) -> NDArray[np.intp]:
        """Numbers of the nodes that are given balls."""
        return np.flatnonzero(self.count == 0)

    def children(self, nodes: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """The children of nodes (n,), and the place of the parent of each among the n; both (m,)."""
        counts = self.count[nodes]
        parents = np.repeat(np.arange(len(nodes)), counts)
        within = np.arange(len(parents)) - np.repeat(np.cumsum(counts) - counts, counts)
        return self.first[nodes][parents] + within, parents


def _divided(members: NDArray[np.intp], centers: FloatArray) -> list[NDArray[np.intp]]:
    """The members of a node in parts of which none is much larger; none where it is one ball."""
    if len(members) == 1:
        return []
    parts = [members]
    while len(parts) < FANOUT and max(map(len, parts)) > 1:
        largest = max(range(len(parts)), key=lambda number: len(parts[number]))
        own = parts.pop(largest)
        order = np.argsort(centers[own, int(np.argmax(np.ptp(centers[own], axis=0)))], kind="stable")
        parts += [own[order[: len(own) // 2]], own[order[len(own) // 2 :]]]
    return parts


def _around(balls: Balls, members: NDArray[np.intp]) -> tuple[FloatArray, float]:
    """Centre and radius of a ball that holds some balls, around the middle of their box."""
    centers, radii = balls.centers[members], balls.radii[members]
    if len(members) == 1:
        return centers[0], float(radii[0])
    low, high = (centers - radii[:, None]).min(axis=0), (centers + radii[:, None]).max(axis=0)
    middle = (low + high) / 2.0
    return middle, float((np.linalg.norm(centers - middle, axis=1) + radii).max()) * (1.0 + RADIUS_ROUNDING)
