"""Ellipsoids in space.

The distance from an ellipsoid has no closed form. In any direction n, a point p is beyond the ellipsoid by
n.p - |diag(a) n|, which is no more than the distance, and equals it where n is the normal at the nearest point. That is
n ~ p_i / (t + a_i^2) with |w(t)| = 1, w_i = a_i p_i / (t + a_i^2). A few steps of Newton's method on 1 / |w(t)|, almost
a straight line, find t from below; what is still missing makes the bound lower, never wrong. Measured with four steps,
it is no less than 0.999 of the distance at semi-axes up to 16:1, and 0.8 at 60:1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, Operand
from problems.base.ranges import LENGTHS, check_within
from problems.scene.solids.solid import TINY_SQUARED, Solid
from problems.scene.solids.surface import Surface, revolved, rounded

NEWTON_STEPS = 4


@dataclass(frozen=True, kw_only=True)
class Ellipsoid(Solid):
    """A filled ellipsoid.

    Args:
        semi_axes: along its own axes, m, positive.
    """

    numbers: ClassVar[tuple[str, ...]] = (*Solid.numbers, "semi_axes")

    semi_axes: tuple[float, float, float]

    def __post_init__(self) -> None:
        super().__post_init__()
        check_within("semi_axes", self.semi_axes, LENGTHS, "m")

    @property
    def width(self) -> float:
        """Twice the shortest semi-axis, m."""
        return 2.0 * min(self.semi_axes)

    @property
    def half_extents(self) -> FloatArray:
        """Half the size of the smallest box around it with sides along the axes, (3,), m."""
        return np.asarray(np.linalg.norm(self.axes * np.array(self.semi_axes), axis=1))

    def point_clearance(self, points: Matrix) -> Matrix:
        """Signed: exact in sign; outside no more than the distance, and mostly that to many digits."""
        p, squares = self.local(points), [a * a for a in self.semi_axes]
        t: Operand = ca.fmax(
            0.0, reduce(ca.fmax, (a * ca.fabs(x) - a * a for a, x in zip(self.semi_axes, p, strict=True)))
        )
        for _ in range(NEWTON_STEPS):
            shares = [a * x / (t + s) for a, x, s in zip(self.semi_axes, p, squares, strict=True)]
            square = _sum([w * w for w in shares]) + TINY_SQUARED
            slope = _sum([w * w / (t + s) for w, s in zip(shares, squares, strict=True)]) + TINY_SQUARED
            t = ca.fmax(0.0, t + (ca.sqrt(square) - 1.0) * square / slope)
        normal = [x / (t + s) for x, s in zip(p, squares, strict=True)]
        extent = ca.sqrt(_sum([s * n * n for s, n in zip(squares, normal, strict=True)]) + TINY_SQUARED)
        length = ca.sqrt(_sum([n * n for n in normal]) + TINY_SQUARED / reduce(ca.fmin, squares))
        return (_sum([n * x for n, x in zip(normal, p, strict=True)]) - extent) / length

    def surface(self) -> Surface:
        """A ball's, stretched."""
        vertices, polygons = revolved(rounded(1.0, 0.0))
        return self.placed(vertices * np.array(self.semi_axes)), polygons


def _sum(terms: list[Matrix]) -> Matrix:
    return reduce(lambda a, b: a + b, terms)
