"""The ellipse.

The plane is mapped so that the ellipse becomes the unit circle; there the closest point of a link, a straight
segment, is a clamped projection. That is exact where points sampled along the link, the paper's way, miss what
lies between them, and it costs less.

How far the link is away is another matter: the distance from an ellipse has no closed form. Where it counts, a bound
takes its place: how far the two are apart in a direction n, min(n.start, n.end) - h(n) with the ellipse's extent h(n),
which is no more than the distance whatever the direction. The first one is the normal of the ellipse towards the point
found above, the next ones turn towards the line between the nearest points. Measured against dense points, the best of
``DIRECTIONS`` = 3 is never less than 0.97 of the distance at semi-axes of 5:3, 0.9 at 3:1 and 0.79 at 10:1, and mostly
within 1 %; of a circle it is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import (
    Angle,
    Coordinate,
    FloatArray,
    Length,
    Matrix,
    Operand,
    bounded_minimum,
    columns,
    is_zero,
)
from problems.scene.obstacle import Obstacle
from problems.scene.solids import Ellipsoid, Solid, about_z

# All three are squared and dimensionless: in units of the semi-axes.
POINT_LENGTH_SQUARED = 1e-12  # a shorter segment counts as a point; avoids 0 / 0 and its gradient
CORE_RADIUS_SQUARED = 1e-3  # within this radius of the centre the logarithm levels off
SHARE_RESOLUTION = 1e-5  # of a segment, to which its nearest point is found
DIRECTIONS = 3  # in which the ellipse and a segment are separated
TINY_SQUARED = 1e-200  # m^2: keeps the direction of no vector, and its gradient, finite
CENTRE_DISTANCE_SQUARED = 1e-30  # added to the distance from the centre: keeps the square root's gradient finite


@dataclass(frozen=True)
class Ellipse(Obstacle):
    """A filled ellipse in the plane.

    Args:
        center: (x, y), m.
        semi_axes: half the width and half the height before turning, m, positive.
        angle: how far it is turned counter-clockwise, rad.

    Raises:
        InvalidProblem: a number is out of range, or a semi-axis not positive.
    """

    zero_is_structure: ClassVar[tuple[str, ...]] = ("angle",)

    center: tuple[Coordinate, Coordinate]
    semi_axes: tuple[Length, Length]
    angle: Angle = 0.0

    @property
    def place(self) -> tuple[float, ...]:
        return self.center

    @property
    def in_space(self) -> tuple[Solid, ...]:
        axes = (*self.semi_axes, min(self.semi_axes))
        return (Ellipsoid(center=(*self.center, 0.0), quaternion=about_z(self.angle), semi_axes=axes),)

    @property
    def smaller_axis(self) -> Operand:
        """The smaller semi-axis, m."""
        return ca.fmin(*self.semi_axes)

    @property
    def width(self) -> float:
        return 2.0 * min(self.semi_axes)

    def to_unit_circle(self, points: Matrix) -> tuple[Matrix, Matrix]:
        """Points (n, 2) in m mapped so that this ellipse is the unit circle; both (n, 1), dimensionless."""
        dx, dy = self._local(points)
        return dx * (1.0 / self.semi_axes[0]), dy * (1.0 / self.semi_axes[1])

    def _local(self, points: Matrix) -> tuple[Matrix, Matrix]:
        """Vectors from the centre to points (n, 2), along the semi-axes; both (n, 1), m."""
        x, y = columns(points)
        dx, dy = x - self.center[0], y - self.center[1]
        if not is_zero(self.angle):
            cosine, sine = ca.cos(self.angle), ca.sin(self.angle)
            dx, dy = cosine * dx + sine * dy, cosine * dy - sine * dx
        return dx, dy

    def contains(self, point: tuple[float, ...]) -> bool:
        u, v = self.to_unit_circle(ca.DM([point]))
        return bool(u * u + v * v <= 1.0)

    def segment_clearance(self, start: Matrix, end: Matrix) -> Matrix:
        """The clearance of straight segments, exact in sign.

        Returns:
            (n, 1), m: negative when the segment enters the ellipse, 0 when it touches, else a lower bound of the
            distance between them (the dimensionless distance times the smaller semi-axis).
        """
        u, v = self._nearest(start, end)
        distance = ca.sqrt(u * u + v * v + CENTRE_DISTANCE_SQUARED)
        return (distance - 1.0) * self.smaller_axis

    def _nearest(self, start: Matrix, end: Matrix) -> tuple[Matrix, Matrix]:
        """The point of each segment that is nearest to the centre where the ellipse is the unit circle; both (n, 1)."""
        (u0, v0), (u1, v1) = self.to_unit_circle(start), self.to_unit_circle(end)
        du, dv = u1 - u0, v1 - v0
        length = ca.fmax(du * du + dv * dv, POINT_LENGTH_SQUARED)
        along = ca.fmin(1.0, ca.fmax(0.0, -(u0 * du + v0 * dv) / length))
        return u0 + along * du, v0 + along * dv

    def segment_distance(self, start: Matrix, end: Matrix) -> Matrix:
        """The clearance of straight segments, with a sharper lower bound of their distance: see this module."""
        (a, b), clearance = self.semi_axes, self.segment_clearance(start, end)
        (x0, y0), (x1, y1) = (self._local(points) for points in (start, end))
        dx, dy = x1 - x0, y1 - y0
        length = ca.fmax(dx * dx + dy * dy, POINT_LENGTH_SQUARED * self.smaller_axis**2)
        u, v = self._nearest(start, end)
        nx, ny = _unit(u / a, v / b)
        bound = clearance
        for count in range(1, DIRECTIONS + 1):
            extent = ca.sqrt((a * nx) ** 2 + (b * ny) ** 2 + TINY_SQUARED)
            bound = ca.fmax(bound, ca.fmin(nx * x0 + ny * y0, nx * x1 + ny * y1) - extent)
            if count < DIRECTIONS:
                far_x, far_y = a * a * nx / extent, b * b * ny / extent  # of the ellipse, farthest that way
                along = ca.fmin(1.0, ca.fmax(0.0, ((far_x - x0) * dx + (far_y - y0) * dy) / length))
                mx, my = _unit(x0 + along * dx - far_x, y0 + along * dy - far_y)
                nx, ny = _unit(nx + mx, ny + my)
        return ca.if_else(clearance > 0.0, bound, clearance)

    def distance_of(self, start: tuple[float, ...], end: tuple[float, ...]) -> float:
        clearance = float(self.segment_clearance(ca.DM([start]), ca.DM([end])))
        if clearance <= 0.0:
            return clearance
        first, way = np.array(start), np.array(end) - np.array(start)
        _, inner = bounded_minimum(lambda s: self._point_distance(first + s * way), 0.0, 1.0, SHARE_RESOLUTION)
        return min(self._point_distance(first), self._point_distance(first + way), inner)

    def _point_distance(self, point: FloatArray) -> float:
        """The distance of a point outside, m: along the normal of the ellipse on which it lies, by a root."""
        place = np.abs([float(part) for part in self._local(ca.DM(point[None]))])
        square = np.array(self.semi_axes) ** 2

        def beyond(t: float) -> float:
            return float(((place * np.sqrt(square) / (t + square)) ** 2).sum() - 1.0)

        if beyond(0.0) <= 0.0:
            return 0.0
        root = scipy.optimize.brentq(beyond, 0.0, float(np.sqrt(square.max()) * np.hypot(*place)))
        return float(np.hypot(*(place - square * place / (root + square))))

    def smooth(self, clearance: Matrix) -> Matrix:
        """The logarithm of the dimensionless distance from the centre that a clearance in m stands for.

        Its gradient does not fade inside the ellipse, where an optimiser has to find its way out.
        """
        return 0.5 * ca.log((clearance / self.smaller_axis + 1.0) ** 2 + CORE_RADIUS_SQUARED)

    def distance_to(self, point: tuple[float, ...]) -> float:
        """A lower bound in m of the distance from a point: that of the circle around the ellipse."""
        away = np.hypot(self.center[0] - point[0], self.center[1] - point[1])
        return float(max(0.0, away - max(self.semi_axes)))

    def outline(self, count: int = 96) -> FloatArray:
        """Points on the boundary, in order and counter-clockwise, (count, 2), m."""
        phase = 2.0 * np.pi * np.arange(count) / count
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        turned = np.array([[cosine, sine], [-sine, cosine]])
        local = np.column_stack([self.semi_axes[0] * np.cos(phase), self.semi_axes[1] * np.sin(phase)])
        return np.asarray(self.center + local @ turned)

    def bounding_box(self) -> FloatArray:
        a, b = self.semi_axes
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        half = np.array([np.hypot(a * cosine, b * sine), np.hypot(a * sine, b * cosine)])
        return np.asarray(self.center + np.array([-half, half]))


def _unit(x: Matrix, y: Matrix) -> tuple[Matrix, Matrix]:
    """Unit vectors; vectors of length 0 where there is no direction."""
    length = ca.sqrt(x * x + y * y + TINY_SQUARED)
    return x / length, y / length
