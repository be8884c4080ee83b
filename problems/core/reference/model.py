"""A robot and its obstacles as arrays, read from the description that the compiled core reads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core.reference.shapes import SolidNumbers, Solids

Numbers = NDArray[np.intp]


class Reader:
    """A reader of the numbers of a description, one after the other.

    Args:
        counts: whole numbers.
        numbers: the others.
    """

    def __init__(self, counts: NDArray[np.int64], numbers: FloatArray) -> None:
        self._counts, self._numbers, self._at = iter(counts.tolist()), numbers, 0

    def count(self) -> int:
        """The next whole number."""
        return int(next(self._counts))

    def table(self, rows: int, columns: int) -> Numbers:
        """The next whole numbers, row by row."""
        return np.array([[self.count() for _ in range(columns)] for _ in range(rows)], dtype=np.intp).reshape(
            rows, columns
        )

    def fill(self, *shape: int) -> FloatArray:
        """The next numbers as an array."""
        begin, self._at = self._at, self._at + int(np.prod(shape))
        return self._numbers[begin : self._at].reshape(shape)


@dataclass(frozen=True, eq=False)
class Joints:
    """The transforms of joints to the frames before: rotation and translation side by side.

    Attributes:
        turns: which turn, (k,); the others slide.
        fixed: what does not change, (3, 4, k).
        by_sine: what the sine of an angle adds, likewise.
        by_cosine: likewise.
        by_sliding: what sliding adds.
        axis: in the joint's own frame, (3, k).
    """

    turns: NDArray[np.bool_]
    fixed: FloatArray
    by_sine: FloatArray
    by_cosine: FloatArray
    by_sliding: FloatArray
    axis: FloatArray

    @classmethod
    def read(cls, reader: Reader, count: int) -> Joints:
        """Joints that are described; a rotation about a unit axis k is 1 + sin [k] + (1 - cos) [k]^2."""
        turns = np.array([reader.count() != 0 for _ in range(count)], dtype=bool)
        fixed, by_sine, by_cosine, by_sliding = (np.zeros((3, 4, count)) for _ in range(4))
        axes = np.zeros((3, count))
        for k in range(count):
            rotation, translation, axis = reader.fill(3, 3), reader.fill(3), reader.fill(3)
            x, y, z = axis
            crossed = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            fixed[:, :3, k], fixed[:, 3, k], axes[:, k] = rotation, translation, axis
            if turns[k]:
                by_sine[:, :3, k], square = rotation @ crossed, rotation @ crossed @ crossed
                by_cosine[:, :3, k] = -square
                fixed[:, :3, k] += square
            else:
                by_sliding[:, 3, k] = rotation @ axis
        return cls(turns, fixed, by_sine, by_cosine, by_sliding, axes)

    def own(self, theta: FloatArray) -> FloatArray:
        """The poses of frames as seen from those before in postures (n, k), (3, 4, k, n)."""
        angles = np.ascontiguousarray(theta.T)
        parts = np.sin(angles) * self.by_sine[..., None] + np.cos(angles) * self.by_cosine[..., None]
        parts += self.fixed[..., None]
        return parts if self.turns.all() else parts + angles * self.by_sliding[..., None]


@dataclass(frozen=True, eq=False)
class Nodes:
    """The balls of all trees.

    Attributes:
        body: that carries each, (n,).
        first: number of its first child.
        count: of its children, which lie side by side.
        centers: in the frame of the body, (3, n), m.
        radii: (n,), m.
    """

    body: Numbers
    first: Numbers
    count: Numbers
    centers: FloatArray
    radii: FloatArray

    @cached_property
    def openings(self) -> FloatArray:
        """The radii of nodes with children, (n,), m; 0 of the others."""
        return np.where(self.count > 0, self.radii, 0.0)

    def children(self, nodes: Numbers) -> tuple[Numbers, Numbers]:
        """The children of nodes (m,), and the place of the parent of each among the m."""
        counts = self.count[nodes]
        parents = np.repeat(np.arange(len(nodes)), counts)
        within = np.arange(len(parents)) - np.repeat(np.cumsum(counts) - counts, counts)
        return self.first[nodes][parents] + within, parents


@dataclass(frozen=True, eq=False)
class Model:
    """A robot among solids as arrays.

    Attributes:
        base: rotation and translation of the base, (3, 4).
        margins: kept from solids and from each other, m, (2,).
        rounding: no computed distance is farther than that from what exact arithmetic gives, m.
        joints: of the robot.
        nodes: of its links' trees.
        watched: first node of a link and number of a solid that must keep apart, (w, 2).
        groups: two nodes that must keep apart, the one that more joints move first, and from where to where pairs of
            their balls are meant, (g, 4); all where the two are equal.
        pairs: of balls, (p, 2).
        solids: around.
    """

    base: FloatArray
    margins: FloatArray
    rounding: float
    joints: Joints
    nodes: Nodes
    watched: Numbers
    groups: Numbers
    pairs: Numbers
    solids: Solids

    @classmethod
    def read(cls, counts: NDArray[np.int64], numbers: FloatArray) -> Model:
        """The model that a description states."""
        reader = Reader(counts, numbers)
        dof, nodes, watched, groups, pairs, solids = (reader.count() for _ in range(6))
        rotation, translation = reader.fill(3, 3), reader.fill(3)
        margins, rounding = reader.fill(2), float(reader.fill(1)[0])
        joints = Joints.read(reader, dof)
        (body, first, count), balls = reader.table(nodes, 3).T, reader.fill(nodes, 4)
        return cls(
            base=np.column_stack([rotation, translation]),
            margins=margins,
            rounding=rounding,
            joints=joints,
            nodes=Nodes(body, first, count, np.ascontiguousarray(balls[:, :3].T), balls[:, 3]),
            watched=reader.table(watched, 2),
            groups=reader.table(groups, 4),
            pairs=reader.table(pairs, 2),
            solids=Solids.of(_solids(reader, solids)),
        )

    @property
    def dof(self) -> int:
        """The number of joints."""
        return len(self.joints.turns)


def _solids(reader: Reader, count: int) -> Iterator[SolidNumbers]:
    """Shape, axes, centre, sizes, and the tables of a polytope, of each solid."""
    for _ in range(count):
        shape, *rows = (reader.count() for _ in range(4))
        axes, center, sizes = reader.fill(3, 3), reader.fill(3), reader.fill(3)
        widths = (4, 4, 6)
        yield shape, axes, center, sizes, tuple(reader.fill(*size) for size in zip(rows, widths, strict=True))
