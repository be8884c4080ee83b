"""Boxes in space."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.base.ranges import LENGTHS, check_within
from problems.scene.solids.solid import TINY_SQUARED, Solid
from problems.scene.solids.surface import Surface

FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


@dataclass(frozen=True, kw_only=True)
class Box(Solid):
    """A filled box.

    Args:
        size: along its own axes, m, positive.
    """

    numbers: ClassVar[tuple[str, ...]] = (*Solid.numbers, "size")

    size: tuple[float, float, float]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_within("size", self.size, LENGTHS, "m")

    @property
    def width(self) -> float:
        """The shortest side, m."""
        return min(self.size)

    @property
    def half_extents(self) -> FloatArray:
        """Half the size of the smallest box around it with sides along the axes, (3,), m."""
        return np.asarray(np.abs(self.axes) @ np.array(self.size) / 2.0)

    def point_clearance(self, points: Matrix) -> Matrix:
        """Signed distances, exact."""
        beyond = [ca.fabs(part) - side / 2.0 for part, side in zip(self.local(points), self.size, strict=True)]
        deepest = ca.fmax(ca.fmax(beyond[0], beyond[1]), beyond[2])
        x, y, z = (ca.fmax(part, 0.0) for part in beyond)
        return ca.if_else(deepest > 0.0, ca.sqrt(x * x + y * y + z * z + TINY_SQUARED), deepest)

    def surface(self) -> Surface:
        """Eight corners and six faces."""
        corners = np.array(list(product((-0.5, 0.5), repeat=3))) * np.array(self.size)
        return self.placed(corners), FACES
