"""Rotations as unit quaternions (x, y, z, w) and as matrices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray
from problems.base.ranges import is_of_length_one
from problems.robots.rigid.inertia import Matrix3

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
