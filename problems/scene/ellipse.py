"""Elliptic obstacles and how far a link keeps from them, (14).

The plane is mapped so that the ellipse becomes the unit circle; there the closest point of a link, a straight
segment, is a clamped projection. That is exact where points sampled along the link, the paper's way, miss what
lies between them, and it costs less.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import Matrix, columns

SHORTEST = 1e-12  # squared dimensionless length below which a segment is a point; keeps 0 / 0 and its gradient away
CORE = 1e-3  # squared dimensionless radius of the core in which the logarithm levels off
CENTRAL = 1e-30  # squared dimensionless distance from the centre that keeps the square root's gradient finite


@dataclass(frozen=True)
class Ellipse:
    """An obstacle: a filled ellipse.

    Args:
        center: (x, y), m.
        semi_axes: half the width and half the height before turning, m, positive.
        angle: how far it is turned counter-clockwise, rad.

    Raises:
        InvalidProblem: a number is not finite or a semi-axis not positive.
    """

    center: tuple[float, float]
    semi_axes: tuple[float, float]
    angle: float = 0.0

    def __post_init__(self) -> None:
        if not np.isfinite([*self.center, self.angle]).all():
            raise InvalidProblem("center", f"{self.center} at angle {self.angle} is not finite")
        if not (np.isfinite(self.semi_axes).all() and min(self.semi_axes) > 0.0):
            raise InvalidProblem("semi_axes", f"{self.semi_axes} are not positive numbers")

    def to_unit_circle(self, x: Matrix, y: Matrix) -> tuple[Matrix, Matrix]:
        """Map points of the plane (m) so that this ellipse becomes the unit circle (dimensionless)."""
        dx, dy = x - self.center[0], y - self.center[1]
        if self.angle != 0.0:
            cosine, sine = float(np.cos(self.angle)), float(np.sin(self.angle))
            dx, dy = cosine * dx + sine * dy, cosine * dy - sine * dx
        return dx * (1.0 / self.semi_axes[0]), dy * (1.0 / self.semi_axes[1])

    def contains(self, point: tuple[float, float]) -> bool:
        """Whether a point (m) lies in or on the ellipse."""
        u, v = self.to_unit_circle(*point)
        return bool(u * u + v * v <= 1.0)

    def segment_clearance(self, x: Matrix, y: Matrix) -> Matrix:
        """Clearance of straight segments.

        Args:
            x: of the two ends of n segments, (n, 2), m.
            y: likewise.

        Returns:
            (n, 1), m: negative when the segment enters the ellipse, 0 when it touches, else a lower bound of the
            distance between them (the dimensionless distance times the smaller semi-axis).
        """
        u, v = self.to_unit_circle(x, y)
        (u0, u1), (v0, v1) = columns(u), columns(v)
        du, dv = u1 - u0, v1 - v0
        length = ca.fmax(du * du + dv * dv, SHORTEST)
        along = ca.fmin(1.0, ca.fmax(0.0, -(u0 * du + v0 * dv) / length))
        nearest_u, nearest_v = u0 + along * du, v0 + along * dv
        distance = ca.sqrt(nearest_u * nearest_u + nearest_v * nearest_v + CENTRAL)
        return (distance - 1.0) * min(self.semi_axes)

    def log_distance(self, clearance: Matrix) -> Matrix:
        """The logarithm of the dimensionless distance from the centre that a clearance in m stands for.

        Its gradient does not fade inside the ellipse, where an optimiser has to find its way out.
        """
        return 0.5 * ca.log((clearance / min(self.semi_axes) + 1.0) ** 2 + CORE)

    def distance_to_base(self) -> float:
        """A lower bound in m of the distance from the base; links that reach less can never touch."""
        return float(max(0.0, np.hypot(*self.center) - max(self.semi_axes)))
