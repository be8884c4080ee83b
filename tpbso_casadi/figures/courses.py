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
        corners = placed(self.obstacle, np.vstack([np.zeros(self.obstacle.dim), np.eye(self.obstacle.dim)]), self.times)
        return np.concatenate([corners[:, :1], corners[:, 1:] - corners[:, :1]], axis=1)

    @cached_property
    def outlines(self) -> FloatArray:
        """Points on its boundary at each time, (n, m, dim), m."""
        return placed(self.obstacle, self.obstacle.unmoved.outline(), self.times)

    @cached_property
    def middles(self) -> FloatArray:
        """Where its middle is at each time, (n, dim), m."""
        return placed(self.obstacle, self.obstacle.unmoved.bounding_box().mean(axis=0)[None], self.times)[:, 0]

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


def placed(obstacle: Obstacle, points: FloatArray, times: FloatArray) -> FloatArray:
    """Points (m, dim), m, that move with an obstacle, at times (n,) in s: (n, m, dim), m."""
    frames = obstacle.frames(times)
    return np.repeat(points[None], len(times), axis=0) if frames is None else frames.placed(points)


def courses_of(obstacles: Sequence[Obstacle], times: FloatArray) -> tuple[Course, ...]:
    """Those of the obstacles that move, at times (n,) in s."""
    return tuple(
        Course(number, obstacle, times) for number, obstacle in enumerate(obstacles, start=1) if obstacle.moves
    )
