"""Solids in space: ball, box, capsule, cylinder, ellipsoid, half-space.

The distance from an ellipsoid has no closed form. In any direction n, a point p is beyond the ellipsoid by
n.p - |diag(a) n|, which is no more than the distance, and equals it where n is the normal at the nearest point. That is
n ~ p_i / (t + a_i^2) with |w(t)| = 1, w_i = a_i p_i / (t + a_i^2). A few steps of Newton's method on 1 / |w(t)|, almost
a straight line, find t from below; what is still missing makes the bound lower, never wrong. Measured with four steps,
it is no less than 0.999 of the distance at semi-axes up to 16:1, and 0.8 at 60:1.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import InitVar, dataclass, field
from enum import IntEnum
from functools import cached_property, reduce
from itertools import pairwise, product
from typing import ClassVar, TypeAlias

import casadi as ca
import numpy as np

from problems.base import (
    Coordinate,
    FloatArray,
    InvalidProblem,
    Length,
    Matrix,
    Operand,
    columns,
    is_of_length_one,
    rotation_of,
)
from problems.scene.obstacle import Obstacle

Surface: TypeAlias = tuple[FloatArray, list[list[int]]]  # vertices (n, 3), m; polygons, counter-clockwise from outside

SIDES = 24  # of the polygon in the place of a circle
BANDS = 6  # from the equator of a ball to its pole


def revolved(profile: FloatArray) -> Surface:
    """The surface that a curve draws around the z axis.

    Args:
        profile: (radius, z) from bottom to top, (m, 2), m; where it does not end on the axis, a disc closes it.
    """
    phase = 2.0 * np.pi * np.arange(SIDES) / SIDES
    circle = np.column_stack([np.cos(phase), np.sin(phase)])
    vertices: list[FloatArray] = []
    rings: list[list[int]] = []
    for radius, z in profile:
        points = radius * circle if radius > 0.0 else np.zeros((1, 2))
        first = sum(map(len, vertices))
        rings.append((first + np.arange(len(points))).tolist() * (SIDES // len(points)))
        vertices.append(np.column_stack([points, np.full(len(points), z)]))
    polygons = [_band_side(below, above, side) for below, above in pairwise(rings) for side in range(SIDES)]
    discs = [ring for ring in (rings[0][::-1], rings[-1]) if len(set(ring)) == SIDES]
    return np.concatenate(vertices), [*polygons, *discs]


def _band_side(below: list[int], above: list[int], side: int) -> list[int]:
    """The corners of one side between two rings, each once: a triangle where one of the rings is a point."""
    ahead = (side + 1) % SIDES
    return list(dict.fromkeys([below[side], below[ahead], above[ahead], above[side]]))


def quarter_circle() -> FloatArray:
    """Points (radius, z) on the unit circle from the equator to the pole, (BANDS + 1, 2)."""
    angle = 0.5 * np.pi * np.arange(BANDS + 1) / BANDS
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    points[-1] = 0.0, 1.0
    return points


def rounded(radius: float, half_length: float) -> FloatArray:
    """The profile of a capsule along z, or of a ball where its half length is 0; (radius, z) from bottom to top, m."""
    cap = radius * quarter_circle()
    top = cap + np.array([0.0, half_length])
    bottom = top[::-1] * np.array([1.0, -1.0])
    return np.concatenate([bottom, top if half_length > 0.0 else top[1:]])


TINY_SQUARED = 1e-30  # m^2: keeps the gradient of no distance finite


def about_z(angle: float) -> tuple[float, float, float, float] | None:
    """The quaternion of a turn about the z axis by an angle in rad; None where there is none."""
    half = float(angle) / 2.0
    return (0.0, 0.0, float(np.sin(half)), float(np.cos(half))) if half else None


class Shape(IntEnum):
    """The shapes that the compiled core knows; of others it asks for distances."""

    BALL = 0
    BOX = 1
    CAPSULE = 2
    CYLINDER = 3
    ELLIPSOID = 4
    HALF_SPACE = 5
    POLYTOPE = 6
    ASKED = 7


@dataclass(frozen=True, eq=False)
class PlainSolid:
    """A solid in its own axes as plain numbers.

    Attributes:
        shape: which.
        sizes: radius; half sides; radius and half the length; semi-axes, m; as many as the shape has.
        planes: of a hull around it, normal and how far along it, (n, 4).
        faces: of itself, likewise.
        edges: of these, where one begins and the way along it, (n, 6), m.
    """

    shape: Shape
    sizes: tuple[float, ...] = ()
    planes: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    faces: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    edges: FloatArray = field(default_factory=lambda: np.empty((0, 6)))


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

    center: tuple[Coordinate, Coordinate, Coordinate]
    quaternion: tuple[float, float, float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.quaternion is not None and not is_of_length_one(self.quaternion):
            raise InvalidProblem("quaternion", f"{self.quaternion} is not of length 1")

    @property
    def dim(self) -> int:
        return 3

    @property
    def place(self) -> tuple[float, ...]:
        return self.center

    @property
    def rotation(self) -> Matrix:
        """The rotation matrix from its own axes to those outside, (3, 3)."""
        if self.quaternion is None:
            return ca.DM.eye(3)
        return ca.vertcat(*(ca.horzcat(*row) for row in rotation_of(self.quaternion)))

    def local(self, points: Matrix) -> list[Matrix]:
        """Points (n, 3) in its own axes, from its centre: x, y and z, each (n, 1), m."""
        away = [column - part for column, part in zip(columns(points), self.center, strict=True)]
        if self.quaternion is None:
            return away
        turned, (x, y, z) = self.rotation, away
        return [x * turned[0, axis] + y * turned[1, axis] + z * turned[2, axis] for axis in range(3)]

    @property
    def plain(self) -> PlainSolid | None:
        """The numbers that the compiled core needs of it; None for a shape that it does not know."""
        return None

    @abstractmethod
    def point_clearance(self, points: Matrix) -> Matrix:
        """The signed distance of n points (n, 3), m, or less of it where it is positive: (n, 1)."""

    def contains(self, point: tuple[float, ...]) -> bool:
        return bool(float(self.point_clearance(ca.DM([point]))) <= 0.0)

    def distance_of(self, start: tuple[float, ...], end: tuple[float, ...]) -> float:
        """The distance of a point, given twice, m; 0 or less where it is inside."""
        return float(self.point_clearance(ca.DM([start])))

    @abstractmethod
    def local_surface(self) -> Surface:
        """The surface for drawing, in its own axes."""

    def surface(self) -> Surface:
        vertices, polygons = self.local_surface()
        return np.asarray(vertices @ self.axes.T + np.array(self.center)), polygons

    @property
    @abstractmethod
    def half_extents(self) -> FloatArray:
        """Half the size of the smallest box around it with sides along the axes, (3,), m."""

    def outline(self, count: int = 96) -> FloatArray:
        return self.surface()[0]

    def bounding_box(self) -> FloatArray:
        return np.asarray(np.array(self.center) + np.outer((-1.0, 1.0), self.half_extents))

    @cached_property
    def axes(self) -> FloatArray:
        """The solid's own axes as seen from outside, one in each column, (3, 3)."""
        return np.eye(3) if self.quaternion is None else np.array(rotation_of(self.quaternion), dtype=np.float64)


@dataclass(frozen=True, kw_only=True)
class Ball(Solid):
    """A filled sphere about its centre.

    Args:
        radius: m, positive.
    """

    not_stated: ClassVar[tuple[str, ...]] = ("quaternion",)

    radius: Length

    @property
    def width(self) -> float:
        return 2.0 * self.radius

    @property
    def half_extents(self) -> FloatArray:
        return np.full(3, self.radius)

    @property
    def plain(self) -> PlainSolid:
        return PlainSolid(Shape.BALL, (self.radius,))

    def point_clearance(self, points: Matrix) -> Matrix:
        x, y, z = self.local(points)
        return ca.sqrt(x * x + y * y + z * z + TINY_SQUARED) - self.radius

    def local_surface(self) -> Surface:
        return revolved(rounded(self.radius, 0.0))


FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]


@dataclass(frozen=True, kw_only=True)
class Box(Solid):
    """A filled box about its centre.

    Args:
        size: along its own axes, m, positive.
    """

    size: tuple[Length, Length, Length]

    @property
    def width(self) -> float:
        return min(self.size)

    @property
    def half_extents(self) -> FloatArray:
        return np.asarray(np.abs(self.axes) @ np.array(self.size) / 2.0)

    @property
    def plain(self) -> PlainSolid:
        return PlainSolid(Shape.BOX, tuple(side / 2.0 for side in self.size))

    def point_clearance(self, points: Matrix) -> Matrix:
        beyond = [ca.fabs(part) - side / 2.0 for part, side in zip(self.local(points), self.size, strict=True)]
        deepest = ca.fmax(ca.fmax(beyond[0], beyond[1]), beyond[2])
        x, y, z = (ca.fmax(part, 0.0) for part in beyond)
        return ca.if_else(deepest > 0.0, ca.sqrt(x * x + y * y + z * z + TINY_SQUARED), deepest)

    def local_surface(self) -> Surface:
        corners = np.array(list(product((-0.5, 0.5), repeat=3))) * np.array(self.size)
        return corners, FACES


@dataclass(frozen=True, kw_only=True)
class Capsule(Solid):
    """All points near a straight line.

    Args:
        radius: how near, m, positive.
        length: of the line, along its own z axis, m, positive.
    """

    radius: Length
    length: Length

    @property
    def width(self) -> float:
        return 2.0 * self.radius

    @property
    def half_extents(self) -> FloatArray:
        return np.asarray(np.abs(self.axes[:, 2]) * self.length / 2.0 + self.radius)

    @property
    def plain(self) -> PlainSolid:
        return PlainSolid(Shape.CAPSULE, (self.radius, self.length / 2.0))

    def point_clearance(self, points: Matrix) -> Matrix:
        x, y, z = self.local(points)
        beyond = ca.fmax(ca.fabs(z) - self.length / 2.0, 0.0)
        return ca.sqrt(x * x + y * y + beyond * beyond + TINY_SQUARED) - self.radius

    def local_surface(self) -> Surface:
        return revolved(rounded(self.radius, self.length / 2.0))


@dataclass(frozen=True, kw_only=True)
class Cylinder(Solid):
    """A filled cylinder with flat ends.

    Args:
        radius: m, positive.
        length: along its own z axis, m, positive.
    """

    radius: Length
    length: Length

    @property
    def width(self) -> float:
        return min(2.0 * self.radius, self.length)

    @property
    def half_extents(self) -> FloatArray:
        along = np.abs(self.axes[:, 2])
        return np.asarray(along * self.length / 2.0 + self.radius * np.hypot(self.axes[:, 0], self.axes[:, 1]))

    @property
    def plain(self) -> PlainSolid:
        return PlainSolid(Shape.CYLINDER, (self.radius, self.length / 2.0))

    def point_clearance(self, points: Matrix) -> Matrix:
        x, y, z = self.local(points)
        around = ca.sqrt(x * x + y * y + TINY_SQUARED) - self.radius
        along = ca.fabs(z) - self.length / 2.0
        deepest, u, v = ca.fmax(around, along), ca.fmax(around, 0.0), ca.fmax(along, 0.0)
        return ca.if_else(deepest > 0.0, ca.sqrt(u * u + v * v + TINY_SQUARED), deepest)

    def local_surface(self) -> Surface:
        half = self.length / 2.0
        return revolved(np.array([[self.radius, -half], [self.radius, half]]))


NEWTON_STEPS = 4


@dataclass(frozen=True, kw_only=True)
class Ellipsoid(Solid):
    """A filled ellipsoid about its centre.

    Args:
        semi_axes: along its own axes, m, positive.
    """

    semi_axes: tuple[Length, Length, Length]

    @property
    def width(self) -> float:
        return 2.0 * min(self.semi_axes)

    @property
    def half_extents(self) -> FloatArray:
        return np.asarray(np.linalg.norm(self.axes * np.array(self.semi_axes), axis=1))

    @property
    def plain(self) -> PlainSolid:
        return PlainSolid(Shape.ELLIPSOID, self.semi_axes)

    def point_clearance(self, points: Matrix) -> Matrix:
        """The clearance, exact in sign; outside no more than the distance, and mostly that to many digits."""
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

    def local_surface(self) -> Surface:
        vertices, polygons = revolved(rounded(1.0, 0.0))
        return vertices * np.array(self.semi_axes), polygons


def _sum(terms: list[Matrix]) -> Matrix:
    return reduce(lambda a, b: a + b, terms)


def _turned_up_to(normal: tuple[float, float, float]) -> tuple[float, float, float, float] | None:
    """The shortest turn from the z axis to a normal of any length; None where there is nothing to turn."""
    length = float(np.linalg.norm(normal))
    if not length > 0.0:
        raise InvalidProblem("normal", "a vector of no length has no direction")
    x, y, z = (part / length for part in normal)
    if x == y == 0.0:
        return None if z > 0.0 else (1.0, 0.0, 0.0, 0.0)
    w = float(np.sqrt((1.0 + z) / 2.0)) if z > 0.0 else float(np.hypot(x, y) / np.sqrt(2.0 * (1.0 - z)))
    return -y / (2.0 * w), x / (2.0 * w), 0.0, w


DRAWN = 2.0  # m: the side of the square that is drawn of its face


@dataclass(frozen=True, kw_only=True)
class HalfSpace(Solid):
    """Everything on one side of a plane: below its centre, a point of the plane, as seen along its own z axis.

    Args:
        normal: what the z axis is to be, (x, y, z) of any length, in place of a quaternion.

    Raises:
        InvalidProblem: both are given, or the normal has no length.
    """

    normal: InitVar[tuple[Coordinate, Coordinate, Coordinate] | None] = None

    def __post_init__(self, normal: tuple[float, float, float] | None) -> None:
        if normal is not None:
            if self.quaternion is not None:
                raise InvalidProblem("normal", "the quaternion says already how the half-space is turned")
            object.__setattr__(self, "quaternion", _turned_up_to(normal))
        super().__post_init__()

    @property
    def width(self) -> float:
        return float(np.inf)

    @property
    def extent(self) -> float:
        return float(np.inf)

    @property
    def half_extents(self) -> FloatArray:
        return np.asarray(np.abs(self.axes[:, :2]).sum(axis=1) * DRAWN / 2.0)

    @property
    def plain(self) -> PlainSolid:
        return PlainSolid(Shape.HALF_SPACE)

    def point_clearance(self, points: Matrix) -> Matrix:
        return self.local(points)[2]

    def local_surface(self) -> Surface:
        corners = np.array([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]])
        return DRAWN * corners, [[0, 1, 2, 3]]
