"""Orientations: quaternions, matrices, angles of roll, pitch and yaw; frames as written in files."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from problems.base import FloatArray, InvalidProblem, is_of_length_one
from problems.robots.inertia import Matrix3, Point3
from problems.robots.transform import Transform

SNAPPED = 1e-12  # an entry nearer than this to 0, 1 or -1 is that number, so that it costs no operation

SURELY_TURNED = 1e-6  # a part of a quaternion beyond this has a sign that rounding does not decide


def matrix_of(quaternion: Sequence[float]) -> Matrix3:
    """The matrix of a quaternion.

    Raises:
        InvalidProblem: it is not of length 1.
    """
    if not is_of_length_one(quaternion):
        raise InvalidProblem("quaternion", f"{list(quaternion)} is not of length 1")
    return snapped(Rotation.from_quat(quaternion).as_matrix())


def from_angles(angles: Sequence[float]) -> Matrix3:
    """The matrix of roll, pitch and yaw, rad: turns about the fixed axes x, y and z in this order."""
    return snapped(Rotation.from_euler("xyz", angles).as_matrix())


def snapped(matrix: FloatArray) -> Matrix3:
    """A rotation matrix (3, 3) whose entries next to 0, 1 or -1 are exactly that."""
    nearest = np.round(matrix)
    one, two, three = np.where(np.abs(matrix - nearest) < SNAPPED, nearest, matrix).tolist()
    return tuple(one), tuple(two), tuple(three)


def quaternions_of(rotations: FloatArray) -> FloatArray:
    """Quaternions (n, 4) of matrices row by row (n, 9), each next to the one before.

    In the first, the last of x, y, z, w that is not next to 0 is positive.
    """
    found = Rotation.from_matrix(np.asarray(rotations).reshape(-1, 3, 3)).as_quat()
    sign = np.sign(found[0, np.flatnonzero(np.abs(found[0]) > SURELY_TURNED)[-1]])
    flips = np.where(np.sum(found[1:] * found[:-1], axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(found * np.cumprod(np.append(sign, flips))[:, None])


def numbers_of(pose: Transform) -> tuple[Point3, Matrix3]:
    """Translation, m, and rotation of a pose without symbols."""
    return as_point(np.array(pose.translation, dtype=float)), snapped(np.array(pose.rotation, dtype=float))


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
        self.at_points = Rotation.from_quat(quaternions)

    @cached_property
    def turns(self) -> FloatArray:
        """From each point to the next, in the tool's own axes: axis times angle, (n - 1, 3), rad."""
        return np.asarray((self.at_points[:-1].inv() * self.at_points[1:]).as_rotvec())

    @cached_property
    def angles(self) -> FloatArray:
        """By how much it turns from each point to the next, (n - 1,), rad."""
        return np.asarray(np.linalg.norm(self.turns, axis=1))

    @cached_property
    def axes(self) -> FloatArray:
        """About which axis, in the tool's own, (n - 1, 3); any one where it does not turn."""
        still = self.angles == 0.0
        axes = np.where(still[:, None], [1.0, 0.0, 0.0], self.turns)
        return np.asarray(axes / np.where(still, 1.0, self.angles)[:, None])

    @cached_property
    def matrices(self) -> FloatArray:
        """At the points, (n, 3, 3)."""
        return np.asarray(self.at_points.as_matrix())

    def along(self, segments: NDArray[np.intp], shares: FloatArray) -> FloatArray:
        """Rotation matrices (m, 3, 3) within m segments, at shares (m,) of their lengths."""
        turned = self.at_points[segments] * Rotation.from_rotvec(shares[:, None] * self.turns[segments])
        return np.asarray(turned.as_matrix())

    def between(self, known: FloatArray, wanted: FloatArray) -> FloatArray:
        """Quaternions (m, 4) at distances along the path (m,), given those of the points (n,), m."""
        segments = np.clip(np.searchsorted(known, wanted, side="right") - 1, 0, len(known) - 2)
        shares = (wanted - known[segments]) / np.diff(known)[segments]
        return np.asarray(Rotation.from_matrix(self.along(segments, shares)).as_quat())


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
    """By how much rotation matrices (n, 3, 3) differ, (n,), rad: exact for small angles as well as half turns."""
    half_sine = np.linalg.norm(first - second, axis=(1, 2)) / np.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(1.0, half_sine)))
