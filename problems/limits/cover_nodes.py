"""Nodes of all links' trees of balls in one list, their places in postures, and pairs that may come near."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import CACHE_SIZE, FloatArray
from problems.evaluation import RowFunction
from problems.geometry import BallTree
from problems.robots import ArmCover, Chain, SpatialArm

POSTURES_AT_ONCE = 128  # postures that are computed at once
LEVER_ROUNDING = 1.0 + 1e-12  # rounding must not make a lever shorter

Numbers: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True)
class Nodes:
    """The nodes of all links' trees in one list.

    Attributes:
        cover: whose.
        chain: that moves them.
    """

    cover: ArmCover
    chain: Chain

    @classmethod
    @lru_cache(maxsize=CACHE_SIZE)
    def of(cls, cover: ArmCover, chain: Chain) -> Nodes:
        """The nodes of an arm, the same object for the same arm."""
        return cls(cover, chain)

    @cached_property
    def roots(self) -> Numbers:
        """The number of each link's first node, (links,)."""
        sizes = [len(link.tree.count) for link in self.cover.links]
        return np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.intp)

    @cached_property
    def tree(self) -> BallTree:
        """The trees of all links as one, in the frames of their bodies."""
        return BallTree.combined([link.tree for link in self.cover.links])

    @cached_property
    def link(self) -> Numbers:
        """The number of each node's link, (nodes,)."""
        return np.repeat(np.arange(len(self.cover.links)), [len(link.tree.count) for link in self.cover.links])

    @cached_property
    def body(self) -> Numbers:
        """The number of the body that carries each node, (nodes,)."""
        return np.array([link.body for link in self.cover.links], dtype=np.intp)[self.link]

    @cached_property
    def levers(self) -> FloatArray:
        """Distances of each node's centre from each joint's axis, (nodes, dof), m, at most; 1 if it slides."""
        each = [self.chain.levers(link.body, link.tree.nodes.centers) for link in self.cover.links]
        return np.concatenate(each) * LEVER_ROUNDING


class Postures(NamedTuple):
    """Poses of the bodies of an arm in n postures.

    Attributes:
        times: (n,), s.
        rotations: of the base and of all joints' frames, (n, bodies, 3, 3).
        translations: likewise, (n, bodies, 3), m.
    """

    times: FloatArray
    rotations: FloatArray
    translations: FloatArray

    @classmethod
    def of(cls, arm: SpatialArm, theta: FloatArray, times: FloatArray) -> Postures:
        """The poses at joint angles (n, dof), rad, at times (n,), s."""
        columns = _frames(arm)(np.ascontiguousarray(theta.T)).T.reshape(len(theta), -1, 12)
        return cls(times, columns[:, :, :9].reshape(len(theta), -1, 3, 3), columns[:, :, 9:])

    def concatenated(self, other: Postures) -> Postures:
        """The poses of both in one."""
        return Postures(*(np.concatenate(parts) for parts in zip(self, other, strict=True)))

    def taken(self, chosen: Numbers) -> Postures:
        """The chosen ones of the postures."""
        return Postures(*(part[chosen] for part in self))

    def points(self, rows: Numbers, bodies: Numbers, points: FloatArray) -> FloatArray:
        """Places of points (m, 3) of bodies in some of the postures, (m, 3), m."""
        turned = np.einsum("mij,mj->mi", self.rotations[rows, bodies], points)
        return np.asarray(turned + self.translations[rows, bodies])


@lru_cache(maxsize=CACHE_SIZE)
def _frames(arm: SpatialArm) -> RowFunction:
    """Rotation row by row and translation of every body's frame, (12 bodies,), in a posture (dof,)."""
    theta = ca.SX.sym("theta", arm.dof)
    frames = arm.chain.frames(theta.T, arm.base_frame)
    entries = [entry for frame in frames for entry in (*(e for row in frame.rotation for e in row), *frame.translation)]
    return RowFunction(ca.Function("frames", [theta], [ca.densify(ca.vertcat(*map(ca.SX, entries)))]), POSTURES_AT_ONCE)


class Items(NamedTuple):
    """Nodes that may come near something, in some of many postures.

    Attributes:
        row: number of the posture, (m,).
        node: of the arm, (m,).
        other: what it may come near: an obstacle's number, or another node, (m,).
    """

    row: Numbers
    node: Numbers
    other: Numbers

    def taken(self, chosen: Numbers | NDArray[np.bool_]) -> Items:
        """The chosen ones of the items."""
        return Items(*(part[chosen] for part in self))

    @classmethod
    def concatenated(cls, parts: Sequence[Items]) -> Items:
        """The items of all parts in one."""
        return cls(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
