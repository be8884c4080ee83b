"""Poses in plain numbers."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np

from problems.robots.spatial.chain import UNTURNED, Matrix3, Point3
from problems.robots.spatial.transform import Transform

EXACT = 1e-12  # an entry of a rotation this near to 0, 1 or -1 is that number


def from_angles(angles: Point3) -> Matrix3:
    """The rotation by roll, pitch and yaw, rad, about the fixed axes x, y and z in this order."""
    if angles == (0.0, 0.0, 0.0):
        return UNTURNED
    (cr, sr), (cp, sp), (cy, sy) = ((cos(angle), sin(angle)) for angle in angles)
    return (
        exact((cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr)),
        exact((sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr)),
        exact((-sp, cp * sr, cp * cr)),
    )


def exact(vector: Point3) -> Point3:
    """A vector whose entries near 0, 1 and -1 are these numbers, so that products with them cost nothing."""
    return as_point([float(round(part)) if abs(part - round(part)) < EXACT else part for part in vector])


def numbers_of(pose: Transform) -> tuple[Point3, Matrix3]:
    """Translation, m, and rotation of a pose without symbols."""
    one, two, three = (exact(as_point(row)) for row in np.array(pose.rotation, dtype=float))
    return as_point(np.array(pose.translation, dtype=float)), (one, two, three)


def as_point(values: Sequence[float] | np.ndarray) -> Point3:
    """Three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z
