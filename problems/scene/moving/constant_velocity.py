"""Motion at a constant velocity."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, Operand, columns
from problems.base.ranges import COORDINATES, check_within
from problems.scene.moving.frames import Frames
from problems.scene.moving.obstacle_motion import ObstacleMotion


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

    velocity: tuple[float, ...]
    origin: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not self.origin:
            object.__setattr__(self, "origin", (0.0,) * len(self.velocity))
        if len(self.origin) != len(self.velocity):
            raise InvalidProblem("velocity", f"{len(self.velocity)} numbers for {len(self.origin)} coordinates")
        check_within("velocity", self.velocity, COORDINATES, "m/s")
        check_within("origin", self.origin, COORDINATES, "m")

    @property
    def dim(self) -> int:
        """That of the velocity."""
        return len(self.velocity)

    def seen(self, points: Matrix, times: Matrix) -> Matrix:
        """Points less where the frame is."""
        each: zip[tuple[Matrix, Operand, Operand]] = zip(columns(points), self.origin, self.velocity, strict=True)
        return ca.horzcat(*(column - (origin + rate * times) for column, origin, rate in each))

    def _place(self, time: float) -> FloatArray:
        return np.asarray(np.array(self.origin) + time * np.array(self.velocity))

    def frames(self, times: FloatArray) -> Frames:
        """On a line, not turned."""
        return Frames(np.array(self.origin) + times[:, None] * np.array(self.velocity))

    def travel(self, cells: FloatArray, extent: float) -> FloatArray:
        """Half a cell at the speed."""
        return np.asarray(np.linalg.norm(self.velocity) * (cells[:, 1] - cells[:, 0]) / 2.0)

    def offset(self, first: float, last: float) -> float:
        """That of one of the two: on a line nothing in between is farther."""
        return float(max(np.linalg.norm(self._place(time)) for time in (first, last)))

    def quiet_after(self, around: float) -> float:
        """When it has left the ball for good."""
        p, v = np.array(self.origin), np.array(self.velocity)
        if not v.any():
            return 0.0
        speed = float(np.hypot.reduce(v))  # of the least numbers too, whose squares are zero
        way = v / speed
        beside = float(np.linalg.norm(p - (p @ way) * way))
        nearest = -float(p @ way) / speed  # s
        return max(0.0, nearest + float(np.sqrt(max(0.0, around**2 - beside**2))) / speed)

    def later(self, seconds: float) -> Self:
        """From where it is then."""
        return replace(self, origin=tuple(self._place(seconds).tolist()))
