"""Obstacles that move: any shape in a frame that is carried along."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, ClassVar, Self, TypeAlias

import casadi as ca
import numpy as np

from problems.base import (
    COORDINATES,
    Coordinate,
    FloatArray,
    InvalidProblem,
    Matrix,
    Operand,
    Parametric,
    Quantity,
    check_fields,
    columns,
)
from problems.scene.obstacle import Frames, Obstacle

Velocity: TypeAlias = Annotated[float, Quantity(COORDINATES, "m/s")]


class ObstacleMotion(Parametric, ABC):
    """The motion of a frame in which an obstacle stands still. A subclass is a frozen dataclass.

    Times are absolute: at t = 0 the robot starts.
    """

    @property
    @abstractmethod
    def dim(self) -> int:
        """The dimension: 2 in the plane, 3 in space."""

    @abstractmethod
    def seen(self, points: Matrix, times: Matrix) -> Matrix:
        """Points (n, dim), m, at times (n, 1) in s, or all at one, as seen from the frame at that time: (n, dim), m."""

    @abstractmethod
    def frames(self, times: FloatArray) -> Frames:
        """Poses of the frame at times (n,) in s."""

    def placed(self, points: FloatArray, time: float) -> FloatArray:
        """Points (n, dim) of the frame as seen from outside at a time in s: (n, dim), m."""
        return np.asarray(self.frames(np.array([time])).placed(points)[0])

    @abstractmethod
    def travel(self, cells: FloatArray, extent: float) -> FloatArray:
        """Bounds of how far points of the frame are from where they are in the middle of cells of time.

        Args:
            cells: start and end of each, (n, 2), s.
            extent: no point is farther from the frame's origin, m.

        Returns:
            (n,), m: an upper bound.
        """

    @abstractmethod
    def offset(self, first: float, last: float) -> float:
        """An upper bound of how far the frame's origin is from that of the world from one time in s to another, m."""

    def quiet_after(self, around: float) -> float:
        """The time in s after which the frame stands still, or its origin is farther than so many m from the world's.

        Infinite by default: no such time is known.
        """
        return np.inf

    @abstractmethod
    def later(self, seconds: float) -> Self:
        """The motion on a clock that starts so many seconds later."""

    def during(self, first: float, last: float) -> Self:
        """The motion for times from ``first`` to ``last`` in s alone; the whole one by default."""
        return self


@dataclass(frozen=True)
class ConstantVelocity(ObstacleMotion):
    """A frame that moves in a straight line and does not turn.

    Args:
        velocity: m/s, of each coordinate.
        origin: where the frame is at t = 0, m; in the world's origin where empty.

    Raises:
        InvalidProblem: a number is out of range, or origin and velocity are not of one dimension.
    """

    numbers: ClassVar[tuple[str, ...]] = ("velocity", "origin")

    velocity: tuple[Velocity, ...]
    origin: tuple[Coordinate, ...] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        if not self.origin:
            object.__setattr__(self, "origin", (0.0,) * len(self.velocity))
        if len(self.origin) != len(self.velocity):
            raise InvalidProblem("velocity", f"{len(self.velocity)} numbers for {len(self.origin)} coordinates")

    @property
    def dim(self) -> int:
        return len(self.velocity)

    def seen(self, points: Matrix, times: Matrix) -> Matrix:
        each: zip[tuple[Matrix, Operand, Operand]] = zip(columns(points), self.origin, self.velocity, strict=True)
        return ca.horzcat(*(column - (origin + rate * times) for column, origin, rate in each))

    def _place(self, time: float) -> FloatArray:
        return np.asarray(np.array(self.origin) + time * np.array(self.velocity))

    def frames(self, times: FloatArray) -> Frames:
        return Frames(np.array(self.origin) + times[:, None] * np.array(self.velocity))

    def travel(self, cells: FloatArray, extent: float) -> FloatArray:
        return np.asarray(np.linalg.norm(self.velocity) * (cells[:, 1] - cells[:, 0]) / 2.0)

    def offset(self, first: float, last: float) -> float:
        return float(max(np.linalg.norm(self._place(time)) for time in (first, last)))

    def quiet_after(self, around: float) -> float:
        p, v = np.array(self.origin), np.array(self.velocity)
        if not v.any():
            return 0.0
        speed = float(np.hypot.reduce(v))  # of the least numbers too, whose squares are zero
        way = v / speed
        beside = float(np.linalg.norm(p - (p @ way) * way))
        nearest = -float(p @ way) / speed  # s
        return max(0.0, nearest + float(np.sqrt(max(0.0, around**2 - beside**2))) / speed)

    def later(self, seconds: float) -> Self:
        return replace(self, origin=tuple(self._place(seconds).tolist()))


@dataclass(frozen=True)
class MovingObstacle(Obstacle):
    """An obstacle in a moving frame. What is asked of it without a time is answered for ``now``.

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
    margin_rate: Annotated[float, Quantity((0.0, COORDINATES[1]), "m/s")] = 0.0
    now: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.motion.dim != self.still.dim:
            reason = f"it has {self.motion.dim} coordinates, the obstacle {self.still.dim}"
            raise InvalidProblem("velocity", reason)

    @property
    def moves(self) -> bool:
        return True

    @property
    def unmoved(self) -> Obstacle:
        return self.still

    def seen(self, points: Matrix, times: Matrix | None) -> Matrix:
        if times is None:
            raise ValueError("of an obstacle that moves it matters at which times")
        return self.motion.seen(points, times)

    def frames(self, times: FloatArray) -> Frames:
        return self.motion.frames(times)

    def without_growth(self) -> Self:
        return replace(self, margin_rate=0.0)

    @property
    def growth_rate(self) -> float:
        return self.margin_rate

    def growth(self, times: Matrix | None) -> Operand:
        return 0.0 if times is None else self.margin_rate * times

    def travel(self, cells: FloatArray, around: float) -> FloatArray:
        first, last = cells.min(initial=0.0), cells.max(initial=0.0)
        extent = min(self.extent, around + self.motion.offset(first, last))
        half = (cells[:, 1] - cells[:, 0]) / 2.0
        return np.asarray(self.motion.travel(cells, extent) + self.margin_rate * half)

    def quiet_after(self, around: float) -> float:
        return np.inf if self.margin_rate else self.motion.quiet_after(around + self.still.extent)

    def at(self, time: float) -> Self:
        return replace(self, now=time)

    def later(self, seconds: float) -> Self:
        return replace(self, motion=self.motion.later(seconds), now=0.0)

    def during(self, first: float, last: float) -> Self:
        return replace(self, motion=self.motion.during(first, last))

    def less_certain(self, rate: float) -> Self:
        return replace(self, margin_rate=self.margin_rate + rate)

    # For ``now``

    def _local(self, points: Matrix) -> Matrix:
        return self.motion.seen(points, ca.DM(self.now))

    def _local_point(self, point: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(ca.DM(self._local(ca.DM([point]))).full()[0].tolist())

    @property
    def dim(self) -> int:
        return self.still.dim

    @property
    def place(self) -> tuple[float, ...]:
        return tuple(self.motion.placed(np.array([self.still.place]), self.now)[0].tolist())

    @property
    def width(self) -> float:
        return self.still.width

    @cached_property
    def extent(self) -> float:
        return self.still.extent

    def contains(self, point: tuple[float, ...]) -> bool:
        return self.still.contains(self._local_point(point))

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        return self.still.segment_clearance(self._local(start), self._local(end))

    def segment_distance(self, start: Matrix, end: Matrix) -> Matrix:
        return self.still.segment_distance(self._local(start), self._local(end))

    def point_clearance(self, points: Matrix) -> Matrix:
        return self.still.point_clearance(self._local(points))

    def distance_of(self, start: tuple[float, ...], end: tuple[float, ...]) -> float:
        return self.still.distance_of(self._local_point(start), self._local_point(end))

    def distance_to(self, point: tuple[float, ...]) -> float:
        """A bound of 0: what reaches anywhere may touch it at some time."""
        return 0.0

    def smooth(self, clearance: Matrix) -> Matrix:
        return self.still.smooth(clearance)

    def outline(self, count: int = 96) -> FloatArray:
        return self.motion.placed(self.still.outline(count), self.now)

    def surface(self) -> tuple[FloatArray, list[list[int]]]:
        vertices, polygons = self.still.surface()
        return self.motion.placed(vertices, self.now), polygons
