"""Rigid transformations and orientations.

An entry of a transformation is a plain number or a matrix of n rows, one for each posture: products with the numbers 0
and 1 are left out, so that what a robot's geometry makes trivial does not appear in compiled code. Orientations are
numbers: quaternions, matrices, angles of roll, pitch and yaw.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from math import cos, sin
from typing import TypeAlias

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import ArrayLike, NDArray

from problems.base import FloatArray, InvalidProblem, Matrix, Operand, is_of_length_one

Point3: TypeAlias = tuple[float, float, float]
Matrix3: TypeAlias = tuple[Point3, Point3, Point3]  # rows
Vector: TypeAlias = tuple[Operand, Operand, Operand]
Rotation: TypeAlias = tuple[Vector, Vector, Vector]  # rows

IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN: Vector = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Transform:
    """A map of coordinates from one frame to another: ``x -> rotation x + translation``, m."""

    rotation: Rotation = IDENTITY
    translation: Vector = ORIGIN

    def __matmul__(self, other: Transform) -> Transform:
        """The transform that does the other first, then this."""
        return Transform(compose(self.rotation, other.rotation), self.apply(other.translation))

    def apply(self, point: Vector) -> Vector:
        """The coordinates of a point as seen from outside, m."""
        return _added(self.turn(point), self.translation)

    def turn(self, vector: Vector) -> Vector:
        """A vector as seen from outside."""
        x, y, z = (_dot(row, vector) for row in self.rotation)
        return x, y, z

    @property
    def inverse(self) -> Transform:
        """The inverse transform, from outside to the frame."""
        back = Transform(transposed(self.rotation))
        x, y, z = (times(part, -1.0) for part in back.turn(self.translation))
        return Transform(back.rotation, (x, y, z))


@dataclass(frozen=True)
class FixedFrame(Transform):
    """The pose of a frame that stands still in another one, in numbers; the same numbers are the same pose."""

    rotation: Matrix3 = IDENTITY
    translation: Point3 = (0.0, 0.0, 0.0)

    @classmethod
    def of(cls, pose: Transform) -> FixedFrame:
        """The pose without symbols, its rotation's entries next to 0, 1 or -1 exactly that."""
        place = as_point(np.array(pose.translation, dtype=float))
        return cls(snapped(np.array(pose.rotation, dtype=float)), place)


UNMOVED = FixedFrame()  # where the other frame is


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
    """The transform from the frame of a joint to that of the one before.

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
    """The cross product of two vectors."""
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
    """The scalar product of two vectors."""
    return _dot(a, b)


SNAPPED = 1e-12  # an entry nearer than this to 0, 1 or -1 is that number, so that it costs no operation

SURELY_TURNED = 1e-6  # a part of a quaternion beyond this has a sign that rounding does not decide


def matrix_of(quaternion: Sequence[float]) -> Matrix3:
    """The matrix of a quaternion.

    Raises:
        InvalidProblem: it is not of length 1.
    """
    if not is_of_length_one(quaternion):
        raise InvalidProblem("quaternion", f"{list(quaternion)} is not of length 1")
    return snapped(_matrices(_of_length_one(np.array(quaternion, dtype=np.float64))))


def from_angles(angles: Sequence[float]) -> Matrix3:
    """The matrix of roll, pitch and yaw, rad: turns about the fixed axes x, y and z in this order."""
    halves = [angle / 2.0 for angle in angles]
    about_x, about_y, about_z = (
        (*(sin(half) if axis == own else 0.0 for axis in range(3)), cos(half)) for own, half in enumerate(halves)
    )
    return snapped(_matrices(np.array(quaternion_product(about_z, quaternion_product(about_y, about_x)))))


def snapped(matrix: FloatArray) -> Matrix3:
    """A rotation matrix (3, 3) whose entries next to 0, 1 or -1 are exactly that."""
    nearest = np.round(matrix)
    one, two, three = np.where(np.abs(matrix - nearest) < SNAPPED, nearest, matrix).tolist()
    return tuple(one), tuple(two), tuple(three)


def quaternions_of(rotations: FloatArray) -> FloatArray:
    """Quaternions (n, 4) of matrices row by row (n, 9), each next to the one before.

    In the first, the last of x, y, z, w that is not next to 0 is positive.
    """
    found = _quaternions(np.asarray(rotations).reshape(-1, 3, 3))
    sign = np.sign(found[0, np.flatnonzero(np.abs(found[0]) > SURELY_TURNED)[-1]])
    flips = np.where(np.sum(found[1:] * found[:-1], axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(found * np.cumprod(np.append(sign, flips))[:, None])


def turned_by(turns: FloatArray) -> FloatArray:
    """Rotation matrices (n, 3, 3) of turns, axis times angle, (n, 3), rad: Rodrigues' formula."""
    angles = np.linalg.norm(turns, axis=1)[:, None, None]
    x, y, z = turns.T
    none = np.zeros_like(x)
    crossed = np.stack([none, -z, y, z, none, -x, -y, x, none], axis=1).reshape(-1, 3, 3)
    sine, versine = np.sinc(angles / np.pi), np.sinc(angles / (2.0 * np.pi)) ** 2 / 2.0  # over the angle, its square
    return np.asarray(np.eye(3) + sine * crossed + versine * crossed @ crossed)


def turn_of(rotation: FloatArray) -> FloatArray:
    """The turn of a rotation matrix (3, 3), axis times angle, (3,), rad, half a turn at most."""
    *axis, cosine = quaternions_of(rotation.reshape(1, 9))[0]
    sine = float(np.linalg.norm(axis))
    angle = 2.0 * float(np.arctan2(sine, abs(cosine)))
    return np.asarray(np.copysign(angle / sine if sine else 2.0, cosine) * np.array(axis))


def _of_length_one(quaternions: FloatArray) -> FloatArray:
    """Quaternions (..., 4), scaled to length 1."""
    x, y, z, w = np.moveaxis(quaternions, -1, 0)
    return np.asarray(quaternions / np.sqrt(x * x + y * y + z * z + w * w)[..., None])


def _matrices(quaternions: FloatArray) -> FloatArray:
    """The matrices of quaternions (..., 4) of length 1: (..., 3, 3)."""
    x, y, z, w = np.moveaxis(quaternions, -1, 0)
    xx, yy, zz, ww = x * x, y * y, z * z, w * w
    rows = (
        *(xx - yy - zz + ww, 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        *(2.0 * (x * y + z * w), -xx + yy - zz + ww, 2.0 * (y * z - x * w)),
        *(2.0 * (x * z - y * w), 2.0 * (y * z + x * w), -xx - yy + zz + ww),
    )
    return np.stack(rows, axis=-1).reshape(*quaternions.shape[:-1], 3, 3)


def _quaternions(rotations: FloatArray) -> FloatArray:
    """Quaternions (n, 4) of rotation matrices (n, 3, 3), by the formula that the largest part makes exact."""
    trace = rotations[:, 0, 0] + rotations[:, 1, 1] + rotations[:, 2, 2]
    largest = np.argmax(np.column_stack([np.diagonal(rotations, axis1=1, axis2=2), trace]), axis=1)
    found = np.empty((len(rotations), 4))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        rows = rotations[largest == i]
        found[np.ix_(largest == i, (i, j, k, 3))] = np.column_stack(
            [
                1.0 - trace[largest == i] + 2.0 * rows[:, i, i],
                *(rows[:, j, i] + rows[:, i, j], rows[:, k, i] + rows[:, i, k], rows[:, k, j] - rows[:, j, k]),
            ]
        )
    turned = [rotations[:, k, j] - rotations[:, j, k] for j, k in ((1, 2), (2, 0), (0, 1))]
    of_trace = np.column_stack([*turned, 1.0 + trace])
    return _of_length_one(np.where((largest == 3)[:, None], of_trace, found))


def quaternion_product(
    first: Sequence[float] | FloatArray, second: Sequence[float] | FloatArray
) -> tuple[float, float, float, float]:
    """The product of two quaternions, or of one with columns of others: first the second turn, then the first."""
    (a, b, c, w), (x, y, z, v) = first, second
    crossed = (b * z - c * y, c * x - a * z, a * y - b * x)
    i, j, k = (w * there + v * here + part for here, there, part in zip((a, b, c), (x, y, z), crossed, strict=True))
    return i, j, k, w * v - a * x - b * y - c * z


def as_point(values: Sequence[float] | FloatArray) -> Point3:
    """Three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z


LARGEST_TURN = 3.0  # rad from one point to the next: at pi nobody knows about which axis


class Orientations:
    """Orientations at n points, and between them.

    Args:
        quaternions: (n, 4), each (x, y, z, w), of length 1.
    """

    def __init__(self, quaternions: FloatArray) -> None:
        self.at_points = scipy.spatial.transform.Rotation.from_quat(quaternions)

    @cached_property
    def turns(self) -> FloatArray:
        """Turns from each point to the next, in the tool's own axes: axis times angle, (n - 1, 3), rad."""
        return np.asarray((self.at_points[:-1].inv() * self.at_points[1:]).as_rotvec())

    @cached_property
    def angles(self) -> FloatArray:
        """Angles by which it turns from each point to the next, (n - 1,), rad."""
        return np.asarray(np.linalg.norm(self.turns, axis=1))

    @cached_property
    def axes(self) -> FloatArray:
        """Axes of these turns, in the tool's own axes, (n - 1, 3); any one where it does not turn."""
        still = self.angles == 0.0
        axes = np.where(still[:, None], [1.0, 0.0, 0.0], self.turns)
        return np.asarray(axes / np.where(still, 1.0, self.angles)[:, None])

    @cached_property
    def matrices(self) -> FloatArray:
        """The rotation matrices at the points, (n, 3, 3)."""
        return np.asarray(self.at_points.as_matrix())

    def along(self, segments: NDArray[np.intp], shares: FloatArray) -> FloatArray:
        """Rotation matrices (m, 3, 3) within m segments, at shares (m,) of their lengths."""
        parts = scipy.spatial.transform.Rotation.from_rotvec(shares[:, None] * self.turns[segments])
        turned = self.at_points[segments] * parts
        return np.asarray(turned.as_matrix())

    def between(self, known: FloatArray, wanted: FloatArray) -> FloatArray:
        """Quaternions (m, 4) at distances along the path (m,), given those of the points (n,), m."""
        segments = np.clip(np.searchsorted(known, wanted, side="right") - 1, 0, len(known) - 2)
        shares = (wanted - known[segments]) / np.diff(known)[segments]
        return np.asarray(scipy.spatial.transform.Rotation.from_matrix(self.along(segments, shares)).as_quat())


def unit_quaternions(given: ArrayLike | Sequence[Sequence[float]]) -> FloatArray:
    """Quaternions (n, 4), scaled to length 1.

    Raises:
        InvalidProblem: one is not of length 1, or further than ``LARGEST_TURN`` from the one before.
    """
    quaternions = np.asarray(given, dtype=np.float64)
    lengths = np.linalg.norm(quaternions, axis=1)
    for index, quaternion in enumerate(quaternions):
        if not is_of_length_one(quaternion):
            raise InvalidProblem("points", f"points[{index}]: its quaternion {quaternion} is not of length 1")
    unit = quaternions / lengths[:, None]
    for index, angle in enumerate(Orientations(unit).angles[: len(unit) - 1]):
        if angle > LARGEST_TURN:
            reason = f"the tool turns by {angle:.4g} rad; at most {LARGEST_TURN:g} rad from point to point"
            raise InvalidProblem("points", f"points[{index}] and points[{index + 1}]: {reason}")
    return np.asarray(unit)


def angles_between(first: FloatArray, second: FloatArray) -> FloatArray:
    """Angles between rotation matrices (n, 3, 3), (n,), rad: exact for small angles as well as half turns."""
    half_sine = np.linalg.norm(first - second, axis=(1, 2)) / np.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(1.0, half_sine)))
