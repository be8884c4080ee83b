"""Balls in space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.base.ranges import LENGTHS, check_within
from problems.scene.solids.solid import TINY_SQUARED, Solid
from problems.scene.solids.surface import Surface, revolved, rounded


@dataclass(frozen=True, kw_only=True)
class Ball(Solid):
    """A filled sphere.

    Args:
        radius: m, positive.
    """

    numbers: ClassVar[tuple[str, ...]] = (*Solid.numbers, "radius")

    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        check_within("radius", (self.radius,), LENGTHS, "m")

    @property
    def width(self) -> float:
        """The diameter, m."""
        return 2.0 * self.radius

    @property
    def half_extents(self) -> FloatArray:
        """Its radius, three times, m."""
        return np.full(3, self.radius)

    def point_clearance(self, points: Matrix) -> Matrix:
        """Signed distances, exact."""
        x, y, z = self.local(points)
        return ca.sqrt(x * x + y * y + z * z + TINY_SQUARED) - self.radius

    def surface(self) -> Surface:
        """Bands from pole to pole."""
        vertices, polygons = revolved(rounded(self.radius, 0.0))
        return self.placed(vertices), polygons
