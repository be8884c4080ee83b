"""Rigid transformations as symbolic or numeric 3 x 3 rows and a translation.

An entry is a plain number or a matrix of n rows, one for each posture: products with the numbers 0 and 1 are left out,
so that what a robot's geometry makes trivial does not appear in compiled code.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TypeAlias

import casadi as ca

from problems.base import Matrix, Operand

Vector: TypeAlias = tuple[Operand, Operand, Operand]
Rotation: TypeAlias = tuple[Vector, Vector, Vector]  # rows

IDENTITY: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Transform:
    """From the coordinates of one frame to those of another: ``x -> rotation x + translation``, m."""

    rotation: Rotation = IDENTITY
    translation: Vector = ORIGIN

    def __matmul__(self, other: Transform) -> Transform:
        """First the other, then this."""
        return Transform(compose(self.rotation, other.rotation), self.apply(other.translation))

    def apply(self, point: Vector) -> Vector:
        """Where a point is seen from outside, m."""
        return _added(self.turn(point), self.translation)

    def turn(self, vector: Vector) -> Vector:
        """A vector as seen from outside."""
        x, y, z = (_dot(row, vector) for row in self.rotation)
        return x, y, z


def compose(first: Rotation, second: Rotation) -> Rotation:
    """The product of two rotations."""
    columns = tuple(zip(*second, strict=True))
    one, two, three = ((_dot(r, columns[0]), _dot(r, columns[1]), _dot(r, columns[2])) for r in first)
    return one, two, three


def about(axis: Sequence[float], angle: Operand) -> Rotation:
    """The rotation by an angle (rad) about a unit axis."""
    c, s = ca.cos(angle), ca.sin(angle)
    x, y, z = (float(part) for part in axis)
    cross = ((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0))
    k = (x, y, z)
    one, two, three = (tuple(_turning(i == j, k[i] * k[j], cross[i][j], c, s) for j in range(3)) for i in range(3))
    return one, two, three  # type: ignore[return-value]


def moved(pose: Transform, axis: Sequence[float], turns: bool, value: Operand) -> Transform:
    """From the frame of a joint to that of the one before.

    Args:
        pose: where it is at zero.
        axis: unit vector.
        turns: whether it is revolute; else it slides.
        value: (n, 1), rad or m.
    """
    if turns:
        return pose @ Transform(about(axis, value))
    x, y, z = (times(part, value) for part in axis)
    return pose @ Transform(translation=(x, y, z))


def _turning(diagonal: bool, square: float, cross: float, c: Matrix, s: Matrix) -> Operand:
    """Cos + (1 - cos) k_i k_j + sin [k]_ij, entry by entry."""
    along = square + (float(diagonal) - square) * c if square != float(diagonal) else square
    if square == 0.0:
        along = c if diagonal else 0.0
    return plus(along, times(cross, s))


def times(a: Operand, b: Operand) -> Operand:
    """A product, without an operation where one factor is the number 0, 1 or -1."""
    for one, other in ((a, b), (b, a)):
        if isinstance(one, (int, float)) and one in (0.0, 1.0, -1.0):
            return 0.0 if one == 0.0 else (other if one == 1.0 else -other)
    return a * b


def plus(a: Operand, b: Operand) -> Operand:
    """A sum, without an operation where one term is the number 0."""
    for one, other in ((a, b), (b, a)):
        if isinstance(one, (int, float)) and one == 0.0:
            return other
    return a + b


def _dot(a: Sequence[Operand], b: Sequence[Operand]) -> Operand:
    products = [times(x, y) for x, y in zip(a, b, strict=True)]
    return reduce(plus, products)


def _added(a: Vector, b: Vector) -> Vector:
    x, y, z = (plus(p, q) for p, q in zip(a, b, strict=True))
    return x, y, z


def as_rows(values: Sequence[Operand], rows: int) -> Matrix:
    """Numbers and columns (rows, 1) side by side, (rows, len(values))."""
    parts = [ca.repmat(ca.DM(v), rows, 1) if isinstance(v, (int, float)) else v for v in values]
    return ca.horzcat(*(ca.repmat(part, rows, 1) if part.shape[0] != rows else part for part in parts))


def transposed(rotation: Rotation) -> Rotation:
    """The inverse of a rotation."""
    one, two, three = zip(*rotation, strict=True)
    return one, two, three


def rotated(rotation: Rotation, vector: Vector) -> Vector:
    """A matrix times a vector."""
    x, y, z = (_dot(row, vector) for row in rotation)
    return x, y, z


def cross(a: Vector, b: Vector) -> Vector:
    """The cross product."""
    return (
        plus(times(a[1], b[2]), -times(a[2], b[1])),
        plus(times(a[2], b[0]), -times(a[0], b[2])),
        plus(times(a[0], b[1]), -times(a[1], b[0])),
    )


def added(*vectors: Vector) -> Vector:
    """The sum of vectors."""
    return reduce(_added, vectors)


def scaled(vector: Vector, factor: Operand) -> Vector:
    """A vector times a number."""
    x, y, z = (times(part, factor) for part in vector)
    return x, y, z


def outer(a: Vector, b: Vector) -> Rotation:
    """The matrix a b^T."""
    one, two, three = (scaled(b, part) for part in a)
    return one, two, three


def dot(a: Vector, b: Vector) -> Operand:
    """The scalar product."""
    return _dot(a, b)
