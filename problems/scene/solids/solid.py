"""The common part of obstacles in space: where they are, and how they are turned."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, Operand, as_array, columns
from problems.base.ranges import COORDINATES, check_within, is_of_length_one
from problems.scene.obstacle import Obstacle
from problems.scene.solids.surface import Surface

TINY_SQUARED = 1e-30  # m^2: keeps the gradient of no distance finite


@dataclass(frozen=True, kw_only=True)
class Solid(Obstacle):
    """An obstacle in space, as seen by balls.

    Args:
        center: (x, y, z), m.
        quaternion: how it is turned, (x, y, z, w), of length 1; None where it is not.

    Raises:
        InvalidProblem: a number is out of range, or the quaternion is not of length 1.
    """

    numbers: ClassVar[tuple[str, ...]] = ("center", "quaternion")

    center: tuple[float, float, float]
    quaternion: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        check_within("center", self.center, COORDINATES, "m")
        if self.quaternion is not None and not is_of_length_one(self.quaternion):
            raise InvalidProblem("quaternion", f"{self.quaternion} is not of length 1")

    @property
    def dim(self) -> int:
        """3."""
        return 3

    @property
    def place(self) -> tuple[float, ...]:
        """Its centre, m."""
        return self.center

    @property
    def rotation(self) -> Matrix:
        """From its own axes to those outside, (3, 3)."""
        if self.quaternion is None:
            return ca.DM.eye(3)
        x, y, z, w = self.quaternion
        s: Operand = 2.0 / (x * x + y * y + z * z + w * w)
        return ca.vertcat(
            ca.horzcat(1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)),
            ca.horzcat(s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)),
            ca.horzcat(s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)),
        )

    def local(self, points: Matrix) -> list[Matrix]:
        """Points (n, 3) in its own axes, from its centre: x, y and z, each (n, 1), m."""
        away = [column - part for column, part in zip(columns(points), self.center, strict=True)]
        if self.quaternion is None:
            return away
        turned, (x, y, z) = self.rotation, away
        return [x * turned[0, axis] + y * turned[1, axis] + z * turned[2, axis] for axis in range(3)]

    @abstractmethod
    def point_clearance(self, points: Matrix) -> Matrix:
        """Signed distance of n points (n, 3), m, or less of it where it is positive: (n, 1)."""

    def contains(self, point: tuple[float, ...]) -> bool:
        """Whether a point (m) lies in or on it."""
        return bool(float(self.point_clearance(ca.DM([point]))) <= 0.0)

    def distance_of(self, start: tuple[float, ...], end: tuple[float, ...]) -> float:
        """The distance of a point, given twice, m; 0 or less where it is inside."""
        return float(self.point_clearance(ca.DM([start])))

    def distance_to(self, point: tuple[float, ...]) -> float:
        """A lower bound in m of the distance from a point."""
        return max(0.0, float(self.point_clearance(ca.DM([point]))))

    @abstractmethod
    def surface(self) -> Surface:
        """Its surface for drawing: vertices (n, 3), m; polygons of their numbers, counter-clockwise from outside."""

    @property
    @abstractmethod
    def half_extents(self) -> FloatArray:
        """Half the size of the smallest box around it with sides along the axes, (3,), m."""

    def outline(self, count: int = 96) -> FloatArray:
        """The vertices of its surface, (n, 3), m."""
        return self.surface()[0]

    def bounding_box(self) -> FloatArray:
        """The smallest box around it with sides along the axes: lower and upper corner, (2, 3), m."""
        return np.asarray(np.array(self.center) + np.outer((-1.0, 1.0), self.half_extents))

    @property
    def axes(self) -> FloatArray:
        """Its own axes as seen from outside, one in each column, (3, 3)."""
        return as_array(self.rotation)

    def placed(self, vertices: FloatArray) -> FloatArray:
        """Points (n, 3) of its own axes as seen from outside, m."""
        return np.asarray(vertices @ self.axes.T + np.array(self.center))
