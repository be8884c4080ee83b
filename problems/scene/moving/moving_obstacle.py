"""Obstacles that move: any obstacle, standing still in a frame that does not."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, Operand
from problems.base.ranges import COORDINATES, check_within
from problems.scene.moving.frames import Frames
from problems.scene.moving.obstacle_motion import ObstacleMotion
from problems.scene.obstacle import Obstacle


@dataclass(frozen=True)
class MovingObstacle(Obstacle):
    """An obstacle in a frame that moves. What is asked of it without a time is answered for ``now``.

    Args:
        still: the obstacle as seen from the frame.
        motion: of the frame.
        margin_rate: how much more is kept from it with every second, m/s: of an obstacle whose motion is predicted.
        now: the time for which it is drawn, and checked as if it stood still, s.

    Raises:
        InvalidProblem: obstacle and motion are not of one dimension, or the rate is negative.
    """

    numbers: ClassVar[tuple[str, ...]] = ("margin_rate",)
    zero_is_structure: ClassVar[tuple[str, ...]] = ("margin_rate",)

    still: Obstacle
    motion: ObstacleMotion
    margin_rate: float = 0.0
    now: float = 0.0

    def __post_init__(self) -> None:
        if self.motion.dim != self.still.dim:
            reason = f"it has {self.motion.dim} coordinates, the obstacle {self.still.dim}"
            raise InvalidProblem("velocity", reason)
        check_within("margin_rate", (self.margin_rate,), (0.0, COORDINATES[1]), "m/s")

    @property
    def moves(self) -> bool:
        """It does."""
        return True

    @property
    def unmoved(self) -> Obstacle:
        """As seen from its frame."""
        return self.still

    def seen(self, points: Matrix, times: Matrix | None) -> Matrix:
        """Points (n, dim), m, as seen from its frame at times (n, 1), s."""
        if times is None:
            raise ValueError("of an obstacle that moves it matters at which times")
        return self.motion.seen(points, times)

    def frames(self, times: FloatArray) -> Frames:
        """That of its motion."""
        return self.motion.frames(times)

    def without_growth(self) -> Self:
        """The same as it is predicted, without doubt."""
        return replace(self, margin_rate=0.0)

    @property
    def growth_rate(self) -> float:
        """The rate."""
        return self.margin_rate

    def growth(self, times: Matrix | None) -> Operand:
        """What is kept from it at times, (n, 1), m, on top of what is kept from any obstacle."""
        return 0.0 if times is None else self.margin_rate * times

    def travel(self, cells: FloatArray, around: float) -> FloatArray:
        """How much a distance can change within cells (n, 2), s, because it moves: (n,), m."""
        first, last = cells.min(initial=0.0), cells.max(initial=0.0)
        extent = min(self.still.extent, around + self.motion.offset(first, last))
        half = (cells[:, 1] - cells[:, 0]) / 2.0
        return np.asarray(self.motion.travel(cells, extent) + self.margin_rate * half)

    def at(self, time: float) -> Self:
        """The same, drawn and checked for another time in s."""
        return replace(self, now=time)

    def later(self, seconds: float) -> Self:
        """The same on a clock that starts so many seconds later."""
        return replace(self, motion=self.motion.later(seconds), now=0.0)

    def during(self, first: float, last: float) -> Self:
        """The same with its motion during that time."""
        return replace(self, motion=self.motion.during(first, last))

    def less_certain(self, rate: float) -> Self:
        """As much more is kept from it with every second."""
        return replace(self, margin_rate=self.margin_rate + rate)

    # For ``now``

    def _local(self, points: Matrix) -> Matrix:
        return self.motion.seen(points, ca.DM(self.now))

    def _local_point(self, point: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(ca.DM(self._local(ca.DM([point]))).full()[0].tolist())

    @property
    def dim(self) -> int:
        """That of the obstacle."""
        return self.still.dim

    @property
    def place(self) -> tuple[float, ...]:
        """A point of it, m, for messages."""
        return tuple(self.motion.placed(np.array([self.still.place]), self.now)[0].tolist())

    @property
    def width(self) -> float:
        """The least distance in m between two parallel planes that hold it."""
        return self.still.width

    @property
    def extent(self) -> float:
        """The largest distance of a point from the frame's origin, m."""
        return self.still.extent

    def contains(self, point: tuple[float, ...]) -> bool:
        """Whether a point (m) lies in or on it."""
        return self.still.contains(self._local_point(point))

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """Clearance of n straight segments, m."""
        return self.still.segment_clearance(self._local(start), self._local(end))

    def segment_distance(self, start: Matrix, end: Matrix) -> Matrix:
        """The same with a sharper lower bound."""
        return self.still.segment_distance(self._local(start), self._local(end))

    def point_clearance(self, points: Matrix) -> Matrix:
        """Clearance of n points (n, dim), m: (n, 1)."""
        return self.still.point_clearance(self._local(points))

    def distance_of(self, start: tuple[float, ...], end: tuple[float, ...]) -> float:
        """The distance of one segment in m."""
        return self.still.distance_of(self._local_point(start), self._local_point(end))

    def distance_to(self, point: tuple[float, ...]) -> float:
        """None at some time, maybe: whatever reaches anywhere may touch it."""
        return 0.0

    def smooth(self, clearance: Matrix) -> Matrix:
        """The obstacle's own."""
        return self.still.smooth(clearance)

    def outline(self, count: int = 96) -> FloatArray:
        """Points on the boundary for drawing, (n, dim), m."""
        return self.motion.placed(self.still.outline(count), self.now)

    def bounding_box(self) -> FloatArray:
        """A box around it with sides along the axes: lower and upper corner, (2, dim), m."""
        outline = self.outline()
        return np.array([outline.min(axis=0), outline.max(axis=0)])

    def surface(self) -> tuple[FloatArray, list[list[int]]]:
        """Of one in space: vertices (n, 3), m; polygons of their numbers."""
        vertices, polygons = self.still.surface()
        return self.motion.placed(vertices, self.now), polygons
