"""Places of balls in many postures at once, and distances between them there.

What is far from a ball is far from all that it holds: only what may matter is opened.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core.interface import MovingSolids
from problems.core.reference.model import Model, Numbers


class Postures:
    """A model in n postures, with the frames of its bodies.

    Args:
        model: of the robot and what is around.
        theta: (n, dof), rad.
        moving: how solids move; None where they stand still.
        errors: how far joints may be off, (n, dof), rad or m; None where they are not.

    Attributes:
        frames: rotation and translation of the base and of the frame of each joint, (3, 4, bodies, n).
    """

    def __init__(
        self, model: Model, theta: FloatArray, moving: MovingSolids | None = None, errors: FloatArray | None = None
    ) -> None:
        self.model, self.moving, self.count, self._errors = model, moving, len(theta), errors
        own, frames = model.joints.own(theta), np.empty((3, 4, model.dof + 1, len(theta)))
        frames[:, :, 0] = model.base[..., None]
        for k in range(model.dof):
            before, after = frames[:, :, k], own[:, :, k]
            place = before[:, 0:1] * after[0:1]
            place += before[:, 1:2] * after[1:2]
            place += before[:, 2:3] * after[2:3]
            place[:, 3] += before[:, 3]
            frames[:, :, k + 1] = place
        self.frames = frames

    def centers(self, nodes: Numbers, rows: Numbers) -> FloatArray:
        """Centres of nodes (m,) in postures (m,), (3, m), m."""
        own, at = self.model.nodes, self.model.nodes.body[nodes] * self.count + rows
        frames, points = self.frames.reshape(3, 4, -1)[:, :, at], own.centers[:, nodes]
        return np.asarray(frames[:, 0] * points[0] + frames[:, 1] * points[1] + frames[:, 2] * points[2] + frames[:, 3])

    def centers_everywhere(self, nodes: Numbers) -> FloatArray:
        """Centres of nodes (r,) in all postures, (3, r, n), m."""
        own = self.model.nodes
        frames, (x, y, z) = self.frames[:, :, own.body[nodes]], own.centers[:, nodes, None]
        return np.asarray(frames[:, 0] * x + frames[:, 1] * y + frames[:, 2] * z + frames[:, 3])

    @property
    def is_exact(self) -> bool:
        """Whether joints are where they are planned."""
        return self._errors is None

    @property
    def sides(self) -> float:
        """The number of radii of a node by which a ball in it has a larger margin at most."""
        return 2.0 if self.is_exact else 4.0

    def tubes(self, nodes: Numbers, rows: Numbers, standing: Numbers) -> FloatArray:
        """Errors of nodes (m,) in postures (m,) as seen from other bodies, (m,), m, at most.

        Of a node with others in it by so much more that it is no farther away than any of these.
        """
        assert self._errors is not None
        return self.moved(self._errors.T, nodes, rows, standing, self.model.nodes.openings[nodes])

    def moved(
        self, turns: FloatArray, nodes: Numbers, rows: Numbers, standing: Numbers, farther: FloatArray | None = None
    ) -> FloatArray:
        """Motions of the centres of nodes (m,) in postures (m,) as seen from other bodies, (m,), m, at most.

        Args:
            turns: of the joints, (dof, n), rad or m.
            nodes: that move.
            rows: numbers of their postures.
            standing: the other bodies, (m,).
            farther: from axes than the centres, (m,), m; none where None.
        """
        model, found = self.model, np.zeros(len(rows))
        body, points = model.nodes.body[nodes], self.centers(nodes, rows)
        for joint in range(model.dof, 0, -1):
            own = np.flatnonzero((joint <= body) & (joint > standing))
            row = rows[own]
            turn = turns[joint - 1, row]
            if model.joints.turns[joint - 1]:
                x, y, z = points[:, own] - self.frames[:, 3, joint][:, row]
                a, b, c = self.axes[:, joint - 1][:, row]
                u, v, w = b * z - c * y, c * x - a * z, a * y - b * x
                lever = np.sqrt(u * u + v * v + w * w)
                turn = turn * (lever if farther is None else lever + farther[own])
            found[own] += turn
        return found * A_LITTLE_MORE

    @cached_property
    def axes(self) -> FloatArray:
        """Directions of the joints' axes, (3, dof, n)."""
        return np.asarray(np.einsum("abkn,bk->akn", self.frames[:, :3, 1:], self.model.joints.axis))


class Items(NamedTuple):
    """Pairs of a node and a solid, or of two nodes, in postures.

    Attributes:
        row: number of the posture, (m,).
        top: number of the pair of first nodes in which it is, (m,).
        one: number of the node, (m,).
        two: number of the solid, or of the other node, (m,).
    """

    row: Numbers
    top: Numbers
    one: Numbers
    two: Numbers

    def taken(self, chosen: Numbers | NDArray[np.bool_] | slice) -> Items:
        """The chosen ones of the items."""
        return Items(*(part[chosen] for part in self))


def concatenated(parts: Sequence[Items]) -> Items:
    """The items of all parts in one."""
    return Items(*(np.concatenate(column) for column in zip(*parts, strict=True)))


A_LITTLE_MORE = 1.0 + 1e-12  # than rounding takes away
STEP = 1e-6  # m, of differences of distances
LEAST_LENGTH = 1e-12  # what ways are divided by
DISTANCE_ERROR = 1e-8  # m, more than distances are off by


@dataclass(frozen=True, eq=False)
class Side:
    """The pairs of one kind that have to keep a distance.

    Args:
        model: of which robot and what is around.

    Attributes:
        kind: 0 where the second is a solid, 1 where it is a node.
    """

    kind: ClassVar[int]

    model: Model

    @property
    @abstractmethod
    def tops(self) -> tuple[Numbers, Numbers]:
        """All pairs of first nodes, (t,) each."""

    @abstractmethod
    def first_margins(self, postures: Postures, enough: FloatArray) -> FloatArray:
        """The margins of all pairs of first nodes, (t, n), m; see :meth:`margins`; enough, (n,), m."""

    @abstractmethod
    def margins(self, postures: Postures, items: Items, enough: FloatArray) -> FloatArray:
        """Distances less what has to be kept, or any number above enough where they are above it, (m,), m."""

    @abstractmethod
    def openings(self, items: Items) -> FloatArray:
        """The radius of the node that could be opened, (m,), m; 0 of balls themselves."""

    @abstractmethod
    def opened(self, items: Items) -> Items:
        """The smaller parts of items that can be opened."""

    @abstractmethod
    def most(self, postures: Postures, items: Items, margins: FloatArray) -> FloatArray:
        """Bounds of the margins of all balls in items with margins (m,), (m,), m; infinite where unknown."""

    @abstractmethod
    def outward(self, postures: Postures, items: Items) -> FloatArray:
        """The unit vectors along which distances grow fastest where the first of both moves, (3, m)."""

    @abstractmethod
    def rates(self, items: Items, out: FloatArray, drifts: FloatArray) -> FloatArray:
        """The rates of margins, (m,), m/s; directions outward (3, m), drifts as of :class:`MovingSolids`."""

    @abstractmethod
    def standing(self, items: Items) -> Numbers:
        """The body that carries the second of both, 0 where it is not carried, (m,)."""

    @abstractmethod
    def paces(self, items: Items, drifts: FloatArray) -> FloatArray:
        """The largest speeds at which the second of both comes nearer by itself, (m,), m/s."""

    def first(self, postures: Postures, enough: FloatArray) -> tuple[Items, FloatArray]:
        """Pairs of first nodes with margins of no more than enough, (n,), m, and these margins."""
        margins = self.first_margins(postures, enough)
        top, row = np.nonzero(~(margins >= enough))
        one, two = self.tops
        return Items(row, top, one[top], two[top]), margins[top, row]

    def smaller(self, postures: Postures, items: Items, enough: FloatArray) -> tuple[Items, FloatArray]:
        """Smaller parts of items with margins of no more than enough in their posture, (n,), m, and these margins."""
        items = self.opened(items)
        most = enough[items.row]
        margins = self.margins(postures, items, most)
        kept = np.flatnonzero(~(margins >= most))
        return items.taken(kept), margins[kept]


class FromSolids(Side):
    """Pairs of links and solids."""

    kind: ClassVar[int] = 0

    @cached_property
    def tops(self) -> tuple[Numbers, Numbers]:
        return self.model.watched[:, 0], self.model.watched[:, 1]

    @cached_property
    def _links(self) -> tuple[Numbers, Numbers]:
        """The nodes among the first of all pairs, (r,), and which of these each pair's is, (t,)."""
        nodes, links = np.unique(self.tops[0], return_inverse=True)
        return nodes, links

    def first_margins(self, postures: Postures, enough: FloatArray) -> FloatArray:
        model, (nodes, links), solids = self.model, self._links, self.tops[1]
        kept = (model.nodes.radii[nodes] + model.margins[0])[None, :, None]
        if not postures.is_exact:
            one, row = np.repeat(nodes, postures.count), np.tile(np.arange(postures.count), len(nodes))
            kept = kept + postures.tubes(one, row, np.zeros_like(one)).reshape(1, -1, postures.count)
        moving = postures.moving
        if moving is not None:
            kept = kept + moving.more[:, None]
        displacements = None if moving is None else moving.displacements
        points = postures.centers_everywhere(nodes)
        return np.asarray((model.solids.from_all(points, displacements, enough + kept) - kept)[solids, links])

    def margins(self, postures: Postures, items: Items, enough: FloatArray) -> FloatArray:
        kept = self.model.nodes.radii[items.one] + self.model.margins[0]
        if postures.moving is not None:
            kept += postures.moving.more[items.two, items.row]
        if not postures.is_exact:
            kept += postures.tubes(items.one, items.row, self.standing(items))
        return np.asarray(self.model.solids.distances(items.two, self.seen(postures, items), enough + kept) - kept)

    @staticmethod
    def seen(postures: Postures, items: Items) -> FloatArray:
        """Centres as seen from where solids have moved to, (3, m), m."""
        points = postures.centers(items.one, items.row)
        return points if postures.moving is None else points - postures.moving.displacements[:, items.two, items.row]

    def openings(self, items: Items) -> FloatArray:
        return self.model.nodes.openings[items.one]

    def opened(self, items: Items) -> Items:
        children, parents = self.model.nodes.children(items.one)
        return Items(items.row[parents], items.top[parents], children, items.two[parents])

    def most(self, postures: Postures, items: Items, margins: FloatArray) -> FloatArray:
        """Bounds by the far side of nodes; bounds of distances from ellipsoids say less."""
        found = margins + postures.sides * self.model.nodes.radii[items.one] + DISTANCE_ERROR
        return np.where(self.model.solids.is_exact[items.two], found, np.inf)

    def outward(self, postures: Postures, items: Items) -> FloatArray:
        seen, m = self.seen(postures, items), len(items.row)
        around = np.repeat(seen[:, None], 6, axis=1)  # (3, 6, m)
        for axis in range(3):
            around[axis, 2 * axis] += STEP
            around[axis, 2 * axis + 1] -= STEP
        there = self.model.solids.distances(np.tile(items.two, 6), around.reshape(3, -1), np.full(6 * m, np.inf))
        there = there.reshape(3, 2, m)
        return _unit(there[:, 0] - there[:, 1])

    def rates(self, items: Items, out: FloatArray, drifts: FloatArray) -> FloatArray:
        own = drifts[items.two]
        return np.asarray(-(own[:, 3:6] * out.T).sum(axis=1) - own[:, 6])

    def standing(self, items: Items) -> Numbers:
        return np.zeros(len(items.row), dtype=np.intp)

    def paces(self, items: Items, drifts: FloatArray) -> FloatArray:
        return np.asarray(_length(drifts[:, 3:6].T) + drifts[:, 6])[items.two]


class FromEachOther(Side):
    """Pairs of links of the robot."""

    kind: ClassVar[int] = 1

    @cached_property
    def tops(self) -> tuple[Numbers, Numbers]:
        return self.model.groups[:, 0], self.model.groups[:, 1]

    @cached_property
    def _links(self) -> tuple[Numbers, Numbers]:
        """The nodes among the first of all pairs, (r,), and the numbers of both of each pair among them, (2, t)."""
        nodes, links = np.unique(self.model.groups[:, :2].T, return_inverse=True)
        return nodes, links.reshape(2, -1)

    @cached_property
    def _kept(self) -> FloatArray:
        radii, (one, two) = self.model.nodes.radii, self.tops
        return np.asarray(radii[one] + radii[two] + self.model.margins[1])

    def first_margins(self, postures: Postures, enough: FloatArray) -> FloatArray:
        nodes, (one, two) = self._links
        points = postures.centers_everywhere(nodes)
        apart = points[:, one] - points[:, two]
        found = np.asarray(_length(apart) - self._kept[:, None])
        if postures.is_exact:
            return found
        (first, second), count = self.tops, postures.count
        standing, row = np.repeat(self.model.nodes.body[second], count), np.tile(np.arange(count), len(first))
        return found - postures.tubes(np.repeat(first, count), row, standing).reshape(-1, count)

    def margins(self, postures: Postures, items: Items, enough: FloatArray) -> FloatArray:
        radii = self.model.nodes.radii
        apart = postures.centers(items.one, items.row) - postures.centers(items.two, items.row)
        found = np.asarray(_length(apart) - (radii[items.one] + radii[items.two] + self.model.margins[1]))
        return found if postures.is_exact else found - postures.tubes(items.one, items.row, self.standing(items))

    @cached_property
    def _listed(self) -> NDArray[np.bool_]:
        """Whether the pairs of balls of each group are listed."""
        return np.asarray(self.model.groups[:, 2] < self.model.groups[:, 3])

    def openings(self, items: Items) -> FloatArray:
        """The larger of the two radii; of listed pairs that of all of them together."""
        nodes = self.model.nodes
        found = np.maximum(nodes.openings[items.one], nodes.openings[items.two])
        if not self._listed.any():
            return found
        one, two = (first[items.top] for first in self.tops)
        whole = (items.one == one) & (items.two == two)
        both = np.where(whole, nodes.radii[items.one] + nodes.radii[items.two], 0.0)
        return np.where(self._listed[items.top], both, found)

    def opened(self, items: Items) -> Items:
        nodes = self.model.nodes
        listed = self._listed[items.top]
        second = nodes.openings[items.one] < nodes.openings[items.two]
        parts = [self._children(items.taken(~listed & ~second)), self._swapped(items.taken(~listed & second))]
        if listed.any():
            parts.append(self._pairs(items.taken(listed)))
        return concatenated(parts)

    def _children(self, items: Items) -> Items:
        children, parents = self.model.nodes.children(items.one)
        return Items(items.row[parents], items.top[parents], children, items.two[parents])

    def _swapped(self, items: Items) -> Items:
        children, parents = self.model.nodes.children(items.two)
        return Items(items.row[parents], items.top[parents], items.one[parents], children)

    def _pairs(self, items: Items) -> Items:
        begin, end = self.model.groups[items.top, 2], self.model.groups[items.top, 3]
        parents = np.repeat(np.arange(len(items.row)), end - begin)
        within = np.arange(len(parents)) - np.repeat(np.cumsum(end - begin) - (end - begin), end - begin)
        one, two = self.model.pairs[begin[parents] + within].T
        return Items(items.row[parents], items.top[parents], one, two)

    def most(self, postures: Postures, items: Items, margins: FloatArray) -> FloatArray:
        return (
            margins
            + postures.sides * (self.model.nodes.radii[items.one] + self.model.nodes.radii[items.two])
            + DISTANCE_ERROR
        )

    def outward(self, postures: Postures, items: Items) -> FloatArray:
        return _unit(postures.centers(items.one, items.row) - postures.centers(items.two, items.row))

    def rates(self, items: Items, out: FloatArray, drifts: FloatArray) -> FloatArray:
        return np.zeros(len(items.row))

    def standing(self, items: Items) -> Numbers:
        return self.model.nodes.body[items.two]

    def paces(self, items: Items, drifts: FloatArray) -> FloatArray:
        return np.zeros(len(items.row))


def _unit(displacements: FloatArray) -> FloatArray:
    return np.asarray(displacements / np.maximum(_length(displacements), LEAST_LENGTH))


def _length(apart: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2]))
