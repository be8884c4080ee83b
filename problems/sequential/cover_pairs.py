"""Balls of an arm's cover that come too near something: what a proof would fail at, for a descent to keep clear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.limits import (
    BodyPair,
    Clearance,
    CoverClearance,
    CoverLimit,
    Nodes,
    Postures,
    Proximity,
    SelfClearance,
    cover_limits,
    pairs_among,
)
from problems.robots import Body, SpatialArm, Sphere
from problems.scene import Obstacle
from problems.sequential.nearness import Nearness

OWN_SHARE = 0.25  # of what obstacles are kept from: many links are near each other in every posture


@dataclass(frozen=True, eq=False)
class CoverPairs:
    """Pairs that a descent keeps apart: balls inside the links, and those of the cover that came too near.

    The first forbid nothing that is free, and show the way out of what is deep inside; proofs judge the others.

    Args:
        robot: an arm with a cover.
        obstacles: among which it moves.
        found: for each of its limits, which balls came too near, and to what, (m, 2): as of the limit's items.
    """

    robot: SpatialArm
    obstacles: tuple[Obstacle, ...]
    found: tuple[NDArray[np.intp], ...]

    @classmethod
    def of(cls, robot: SpatialArm, obstacles: Sequence[Obstacle]) -> CoverPairs:
        """Those of which none is found yet."""
        none = np.empty((0, 2), dtype=np.intp)
        return cls(robot, tuple(obstacles), (none,) * len(cover_limits(robot, obstacles)))

    @cached_property
    def _limits(self) -> tuple[CoverLimit, ...]:
        return cover_limits(self.robot, self.obstacles)

    @property
    def count(self) -> int:
        """How many are found."""
        return sum(map(len, self.found))

    def joined(self, theta: FloatArray, times: FloatArray, spare: float) -> CoverPairs:
        """With those that come too near in some postures.

        Of each part of a link that is the ball that comes nearest.

        Args:
            theta: (n, dof), rad.
            times: of the postures, (n,), s.
            spare: what is kept on top of the margin, m.
        """
        postures, found = Postures.of(self.robot, theta, times), []
        for limit, known in zip(self._limits, self.found, strict=True):
            kept = limit.margin + spare * (1.0 if isinstance(limit, CoverClearance) else OWN_SHARE)
            parts = limit.parted(limit.roots(len(theta)))
            own = parts._replace(row=np.arange(len(parts.row)))
            nearest = limit.nearest_of(own, postures.taken(parts.row), below=kept)
            near = nearest.items.taken(nearest.clearance < kept)
            found.append(np.unique(np.concatenate([known, np.column_stack([near.node, near.other])]), axis=0))
        return replace(self, found=tuple(found))

    @cached_property
    def nearness(self) -> Nearness:
        """The clearances of all these pairs."""
        limits = zip(self._limits, self.found, strict=True)
        return Nearness(self._arm, tuple(self._of(limit, found.tolist()) for limit, found in limits), OWN_SHARE)

    def _of(self, limit: CoverLimit, found: list[list[int]]) -> Proximity:
        robot, balls = self.robot, self._balls
        if isinstance(limit, CoverClearance):
            inner = [body for body in robot.inner_bodies if robot.moved_by(body) > 0]
            each = [(body, number) for number in range(len(self.obstacles)) for body in inner]
            each += [(balls[node], number) for node, number in found]
            return Clearance(self._arm, pairs_among(robot, each, self.obstacles))
        own = [*robot.own_pairs, *((robot.among_own(balls[b]), robot.among_own(balls[a])) for a, b in found)]
        return SelfClearance(self._arm, tuple(BodyPair(*pair).tracked(self._arm) for pair in own))

    @cached_property
    def _nodes(self) -> list[int]:
        """Numbers of the balls that are found."""
        columns = [
            found[:, :1] if isinstance(limit, CoverClearance) else found
            for limit, found in zip(self._limits, self.found, strict=True)
        ]
        return sorted({int(node) for each in columns for node in each.ravel()})

    @cached_property
    def _arm(self) -> SpatialArm:
        """The robot with these balls besides its spheres."""
        assert self.robot.cover is not None
        nodes = Nodes.of(self.robot.cover, self.robot.chain)
        balls = nodes.tree.nodes
        spheres = [
            Sphere(int(nodes.body[n]), (x, y, z), float(balls.radii[n]), f"ball {n}")
            for n, (x, y, z) in zip(self._nodes, balls.centers[self._nodes].tolist(), strict=True)
        ]
        return replace(self.robot, spheres=(*self.robot.spheres, *spheres))

    @cached_property
    def _balls(self) -> dict[int, Body]:
        """They as bodies of that, by their numbers."""
        return dict(zip(self._nodes, self._arm.bodies[len(self.robot.spheres) :], strict=True))
