"""Capsules in space: cylinders with a half ball at either end."""

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
class Capsule(Solid):
    """All points near a straight line.

    Args:
        radius: how near, m, positive.
        length: of the line, along its own z axis, m, positive.
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
        """The diameter, m."""
        return 2.0 * self.radius

    @property
    def half_extents(self) -> FloatArray:
        """Half the size of the smallest box around it with sides along the axes, (3,), m."""
        return np.asarray(np.abs(self.axes[:, 2]) * self.length / 2.0 + self.radius)

    def point_clearance(self, points: Matrix) -> Matrix:
        """Signed distances, exact."""
        x, y, z = self.local(points)
        beyond = ca.fmax(ca.fabs(z) - self.length / 2.0, 0.0)
        return ca.sqrt(x * x + y * y + beyond * beyond + TINY_SQUARED) - self.radius

    def surface(self) -> Surface:
        """Bands from pole to pole."""
        vertices, polygons = revolved(rounded(self.radius, self.length / 2.0))
        return self.placed(vertices), polygons
