"""Where obstacles that move are at the times of a picture, as plain arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from problems.base.matrix import FloatArray
from problems.scene.obstacle import Obstacle


@dataclass(frozen=True)
class Course:
    """An obstacle that moves.

    Attributes:
        number: of the obstacle, 1, 2, ...
        obstacle: itself.
        times: at which it is looked at, (n,), s.
    """

    number: int
    obstacle: Obstacle
    times: FloatArray

    @cached_property
    def frames(self) -> FloatArray:
        """Where its frame is at each time: origin and axes in rows, (n, dim + 1, dim), m and unit vectors."""
        dim = self.obstacle.dim
        corners = np.vstack([np.zeros(dim), np.eye(dim)])
        seen = np.array([self.obstacle.moved(corners, time) for time in self.times]).reshape(-1, dim + 1, dim)
        seen[:, 1:] -= seen[:, :1]
        return seen

    def placed(self, points: FloatArray) -> FloatArray:
        """Points (m, dim) of its frame as they are at each time, (n, m, dim), m."""
        return np.asarray(self.frames[:, :1] + points @ self.frames[:, 1:])

    @cached_property
    def outlines(self) -> FloatArray:
        """Points on its boundary at each time, (n, m, dim), m."""
        return self.placed(self.obstacle.unmoved.outline())

    @cached_property
    def middles(self) -> FloatArray:
        """Where its middle is at each time, (n, dim), m."""
        return self.placed(self.obstacle.unmoved.bounding_box().mean(axis=0)[None])[:, 0]

    def within(self, lower: FloatArray, upper: FloatArray) -> FloatArray:
        """What is seen of it in a box: lower and upper corner of that over all times, (2, dim), m; (0, dim) if nothing.

        Args:
            lower: corner of the box, (dim,), m.
            upper: likewise.
        """
        lows, highs = self.outlines.min(axis=1), self.outlines.max(axis=1)
        meets = ((highs >= lower) & (lows <= upper)).all(axis=1)
        if not meets.any():
            return np.empty((0, len(lower)))
        return np.asarray(np.clip([lows[meets].min(axis=0), highs[meets].max(axis=0)], lower, upper))


def courses_of(obstacles: Sequence[Obstacle], times: FloatArray) -> tuple[Course, ...]:
    """Those of the obstacles that move, at times (n,) in s."""
    return tuple(
        Course(number, obstacle, times) for number, obstacle in enumerate(obstacles, start=1) if obstacle.moves
    )
