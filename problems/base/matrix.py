"""Columns and rows of CasADi matrices, numeric or symbolic.

Every formula of this package is written once, in CasADi operations that take both. Given symbols it builds the
model that is compiled, differentiated and audited; given numbers it evaluates the very same formula.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Matrix: TypeAlias = ca.SX | ca.DM
Operand: TypeAlias = Matrix | float  # of a formula: a matrix, or a plain number in its place
FloatArray: TypeAlias = NDArray[np.float64]


def total(values: Operand) -> Matrix:
    """Sum of all entries, whatever the shape (a scalar, 0 for an empty matrix)."""
    return ca.sum1(ca.sum2(values))


def largest(values: Matrix) -> Matrix:
    """The largest of all entries, found in rounds like a tournament's, as in a chain each one waits for the last."""
    return _winner(values, ca.fmax)


def smallest(values: Matrix) -> Matrix:
    """The smallest of all entries, found in rounds like the largest."""
    return _winner(values, ca.fmin)


def _winner(values: Matrix, better: Callable[[Matrix, Matrix], Matrix]) -> Matrix:
    left: Matrix = ca.vec(values)
    while left.numel() > 1:
        half = left.numel() // 2
        left = ca.vertcat(better(left[:half], left[half : 2 * half]), left[2 * half :])
    return left


def columns(matrix: Matrix) -> list[Matrix]:
    """The columns of a (rows, n) matrix, each (rows, 1)."""
    return list(ca.horzsplit(matrix)) if matrix.shape[1] else []


def split(vector: Matrix, sizes: Sequence[int]) -> list[Matrix]:
    """A column vector cut into parts of the given sizes."""
    return list(ca.vertsplit(vector, np.cumsum([0, *sizes]).tolist()))


def row(values: Sequence[float] | FloatArray) -> ca.DM:
    """A (1, n) numeric row, to be broadcast with :func:`repeated`."""
    return ca.DM(np.asarray(values, dtype=float).reshape(1, -1))


def repeated(values: Sequence[float] | FloatArray, rows: int) -> ca.DM:
    """A numeric row repeated ``rows`` times: (rows, n)."""
    return ca.repmat(row(values), rows, 1)


def rotation_of(quaternion: Sequence[Operand]) -> list[list[Operand]]:
    """The rows of the rotation matrix of a quaternion (x, y, z, w) of any length."""
    x, y, z, w = quaternion
    s: Operand = 2.0 / (x * x + y * y + z * z + w * w)
    return [
        [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
    ]


def constant(array: FloatArray) -> ca.DM:
    """A constant matrix whose zeros are structural, so that they cost no operation in a product."""
    return ca.sparsify(ca.DM(array))


def as_array(matrix: Matrix) -> FloatArray:
    """A dense (rows, columns) NumPy array of a numeric matrix."""
    return np.asarray(ca.DM(matrix).full(), dtype=np.float64)
