"""How much more slowly motors need a motion: at 1/s of its speed it takes ``inertial / s^2 + viscous / s + held``.

With the room that ``held`` leaves of a limit, s is the larger root of a quadratic equation.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix


def time_scales(inertial: Matrix, viscous: Matrix, room: Matrix) -> Matrix:
    """The least s with ``inertial / s'^2 + viscous / s' <= room`` for all s' >= s; 0 where there is none.

    Symbolic or numeric, with room that is positive.
    """
    square = viscous * viscous + 4.0 * inertial * room
    return ca.fmax(0.0, (viscous + ca.sqrt(ca.fmax(0.0, square))) / (2.0 * room)) * (square >= 0.0)


def time_scales_of_arrays(inertial: FloatArray, viscous: FloatArray, room: FloatArray) -> FloatArray:
    """The same of arrays of one shape; infinite, or 0, where no room is left."""
    square = viscous * viscous + 4.0 * inertial * room
    with np.errstate(all="ignore"):
        root = (viscous + np.sqrt(np.maximum(square, 0.0))) / (2.0 * room)
    return np.where((square >= 0.0) & (root > 0.0), root, 0.0)
