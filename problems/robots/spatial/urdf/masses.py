"""Masses of bodies that are fixed to each other, as those of one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.base.matrix import FloatArray
from problems.robots.rigid.inertia import Inertia, Matrix3
from problems.robots.rigid.transform import Transform
from problems.robots.spatial.pose import as_point


def moved_inertia(inertia: Inertia, pose: Transform) -> Inertia:
    """A body's mass as seen from the frame in which its own frame has this pose."""
    turn = np.array(pose.rotation, dtype=float)
    center = turn @ np.array(inertia.center) + np.array(pose.translation, dtype=float)
    return Inertia(mass=inertia.mass, center=as_point(center), matrix=_matrix(turn @ np.array(inertia.matrix) @ turn.T))


def joined(parts: Sequence[Inertia]) -> Inertia | None:
    """Several masses in one frame as one (parallel axes theorem); None where there are none."""
    if not parts:
        return None
    mass = sum(part.mass for part in parts)
    if mass == 0.0:
        return Inertia(mass=0.0)
    center = np.sum([part.mass * np.array(part.center) for part in parts], axis=0) / mass
    matrix = np.sum(
        [np.array(part.matrix) + part.mass * _spread(np.array(part.center) - center) for part in parts], axis=0
    )
    return Inertia(mass=mass, center=as_point(center), matrix=_matrix(matrix))


def _spread(offset: FloatArray) -> FloatArray:
    """The inertia of 1 kg at an offset from the axes' origin, m^2."""
    return float(offset @ offset) * np.eye(3) - np.outer(offset, offset)


def _matrix(matrix: FloatArray) -> Matrix3:
    one, two, three = (as_point(row) for row in matrix)
    return one, two, three
