"""Rectangular obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.arguments import is_zero
from problems.base.matrix import FloatArray, Matrix
from problems.base.ranges import ANGLES, COORDINATES, LENGTHS, check_within
from problems.scene.convex import convex_clearance
from problems.scene.obstacle import Obstacle
from problems.scene.segments import Point

SIGNS = ((-1, -1), (1, -1), (1, 1), (-1, 1))  # of the corners, counter-clockwise


@dataclass(frozen=True)
class Rectangle(Obstacle):
    """A filled rectangle in the plane.

    Args:
        center: (x, y), m.
        size: width and height before turning, m, positive.
        angle: how far it is turned counter-clockwise, rad.

    Raises:
        InvalidProblem: a number is out of range, or a size not positive.
    """

    numbers: ClassVar[tuple[str, ...]] = ("center", "size", "angle")
    zero_is_structure: ClassVar[tuple[str, ...]] = ("angle",)

    center: tuple[float, float]
    size: tuple[float, float]
    angle: float = 0.0

    def __post_init__(self) -> None:
        check_within("center", self.center, COORDINATES, "m")
        check_within("angle", (self.angle,), ANGLES, "rad")
        check_within("size", self.size, LENGTHS, "m")

    @property
    def place(self) -> tuple[float, ...]:
        """Its centre, m."""
        return self.center

    @property
    def width(self) -> float:
        """The shorter side, m."""
        return min(self.size)

    @property
    def corners(self) -> tuple[Point, ...]:
        """Counter-clockwise, m."""
        (x, y), (dx, dy) = self.center, self.size
        halves = [(0.5 * i * dx, 0.5 * j * dy) for i, j in SIGNS]
        if not is_zero(self.angle):
            cosine, sine = ca.cos(self.angle), ca.sin(self.angle)
            halves = [(cosine * u - sine * v, sine * u + cosine * v) for u, v in halves]
        return tuple((x + u, y + v) for u, v in halves)

    def contains(self, point: tuple[float, ...]) -> bool:
        """Whether a point (m) lies in or on it."""
        away, turn = np.array(point) - self.center, np.exp(-1j * self.angle)
        local = complex(*away) * turn
        return bool(2.0 * abs(local.real) <= self.size[0] and 2.0 * abs(local.imag) <= self.size[1])

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """Signed distances of straight segments, exact; (n, 1), m."""
        return convex_clearance(self.corners, start, end)

    def distance_to(self, point: tuple[float, ...]) -> float:
        """The distance from a point, m; 0 inside."""
        return max(0.0, self.distance_of(point, point))

    def outline(self, count: int = 96) -> FloatArray:
        """The corners, counter-clockwise, (4, 2), m."""
        return np.array([[float(part) for part in corner] for corner in self.corners])

    def bounding_box(self) -> FloatArray:
        """The smallest box around it with sides along the axes: lower and upper corner, (2, 2), m."""
        corners = self.outline()
        return np.array([corners.min(axis=0), corners.max(axis=0)])
