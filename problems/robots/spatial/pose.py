"""Poses in plain numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.base.matrix import FloatArray
from problems.robots.rigid.inertia import Matrix3, Point3
from problems.robots.rigid.transform import Transform
from problems.robots.spatial.rotations import snapped


def numbers_of(pose: Transform) -> tuple[Point3, Matrix3]:
    """Translation, m, and rotation of a pose without symbols."""
    return as_point(np.array(pose.translation, dtype=float)), snapped(np.array(pose.rotation, dtype=float))


def as_point(values: Sequence[float] | FloatArray) -> Point3:
    """Three numbers as a tuple."""
    x, y, z = (float(value) for value in values)
    return x, y, z
