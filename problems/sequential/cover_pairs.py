"""Balls of an arm's cover that come too near something: a descent keeps them clear, so that proofs succeed."""

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
from problems.sequential.pair_clearances import PairClearances

OWN_SHARE = 0.25  # of the proof margin of obstacles, for own links: many are near each other in every posture


@dataclass(frozen=True, eq=False)
class CoverPairs:
    """Pairs that a descent keeps apart: balls inside the links, and those of the cover that came too near.

    The first forbid nothing that is free, and have gradients that lead out of deep contacts; proofs judge the others.

    Args:
        robot: an arm with a cover.
        obstacles: among which it moves.
        near: for each of its limits, numbers of balls that came too near, and of what they came near to, (m, 2).
    """

    robot: SpatialArm
    obstacles: tuple[Obstacle, ...]
    near: tuple[NDArray[np.intp], ...]

    @classmethod
    def of(cls, robot: SpatialArm, obstacles: Sequence[Obstacle]) -> CoverPairs:
        """The pairs of a robot among obstacles before any ball of the cover came too near."""
        none = np.empty((0, 2), dtype=np.intp)
        return cls(robot, tuple(obstacles), (none,) * len(cover_limits(robot, obstacles)))

    @cached_property
    def _limits(self) -> tuple[CoverLimit, ...]:
        return cover_limits(self.robot, self.obstacles)

    @property
    def count(self) -> int:
        """The number of balls that came too near."""
        return sum(map(len, self.near))

    def joined(self, theta: FloatArray, times: FloatArray, proof_margin: float) -> CoverPairs:
        """The pairs with the balls that come too near in some postures, of each part of a link the nearest ball.

        Args:
            theta: (n, dof), rad.
            times: of the postures, (n,), s.
            proof_margin: kept on top of the margin, m.
        """
        postures, every = Postures.of(self.robot, theta, times), []
        for limit, known in zip(self._limits, self.near, strict=True):
            least = limit.margin + proof_margin * (1.0 if isinstance(limit, CoverClearance) else OWN_SHARE)
            parts = limit.parted(limit.roots(len(theta)))
            rows = parts._replace(row=np.arange(len(parts.row)))
            nearest = limit.nearest_of(rows, postures.taken(parts.row), below=least)
            near = nearest.items.taken(nearest.clearance < least)
            every.append(np.unique(np.concatenate([known, np.column_stack([near.node, near.other])]), axis=0))
        return replace(self, near=tuple(every))

    @cached_property
    def nearness(self) -> PairClearances:
        """The clearances of all these pairs."""
        limits = zip(self._limits, self.near, strict=True)
        return PairClearances(self._arm, tuple(self._of(limit, near.tolist()) for limit, near in limits), OWN_SHARE)

    def _of(self, limit: CoverLimit, near: list[list[int]]) -> Proximity:
        bodies, balls = self.robot.bodies, self._balls
        if isinstance(limit, CoverClearance):
            inner = [body for body in bodies.inner if bodies.moved_by(body) > 0]
            each = [(body, number) for number in range(len(self.obstacles)) for body in inner]
            each += [(balls[node], number) for node, number in near]
            return Clearance(self._arm, pairs_among(self.robot, each, self.obstacles))
        pairs = [*bodies.pairs, *((bodies.among_own(balls[b]), bodies.among_own(balls[a])) for a, b in near)]
        return SelfClearance(self._arm, tuple(BodyPair(*pair).tracked(self._arm) for pair in pairs))

    @cached_property
    def _nodes(self) -> list[int]:
        """Numbers of the balls that came too near."""
        columns = [
            near[:, :1] if isinstance(limit, CoverClearance) else near
            for limit, near in zip(self._limits, self.near, strict=True)
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
        """The balls that came too near as bodies of this arm, by their numbers."""
        return dict(zip(self._nodes, self._arm.bodies.each[len(self.robot.spheres) :], strict=True))
