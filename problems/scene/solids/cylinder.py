"""Cylinders in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.base.ranges import LENGTHS, check_within
from problems.scene.solids.solid import TINY_SQUARED, Solid
from problems.scene.solids.surface import Surface, revolved


@dataclass(frozen=True, kw_only=True)
class Cylinder(Solid):
    """A filled cylinder with flat ends.

    Args:
        radius: m, positive.
        length: along its own z axis, m, positive.
    """

    numbers: ClassVar[tuple[str, ...]] = (*Solid.numbers, "radius", "length")

    radius: float
    length: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check_within("radius", (self.radius,), LENGTHS, "m")
        check_within("length", (self.length,), LENGTHS, "m")

    @property
    def width(self) -> float:
        """The diameter or the length, m."""
        return min(2.0 * self.radius, self.length)

    @property
    def half_extents(self) -> FloatArray:
        """Half the size of the smallest box around it with sides along the axes, (3,), m."""
        along = np.abs(self.axes[:, 2])
        return np.asarray(along * self.length / 2.0 + self.radius * np.hypot(self.axes[:, 0], self.axes[:, 1]))

    def point_clearance(self, points: Matrix) -> Matrix:
        """Signed distances, exact."""
        x, y, z = self.local(points)
        around = ca.sqrt(x * x + y * y + TINY_SQUARED) - self.radius
        along = ca.fabs(z) - self.length / 2.0
        deepest, u, v = ca.fmax(around, along), ca.fmax(around, 0.0), ca.fmax(along, 0.0)
        return ca.if_else(deepest > 0.0, ca.sqrt(u * u + v * v + TINY_SQUARED), deepest)

    def surface(self) -> Surface:
        """The side, and a disc at either end."""
        half = self.length / 2.0
        vertices, polygons = revolved(np.array([[self.radius, -half], [self.radius, half]]))
        return self.placed(vertices), polygons
