"""How a pose of the tool differs from the one that is wanted, in numbers that are zero there alone."""

from __future__ import annotations

import casadi as ca

from problems.base.matrix import Matrix, Operand, columns

ASIDE = 1e-9  # rad, added to a turn whose axis is not known
TINY = 1e-60  # keeps a root's derivative finite


def rotation_rows(quaternion: tuple[Operand, ...]) -> Matrix:
    """The rotation of a quaternion (x, y, z, w), row by row, (1, 9)."""
    x, y, z, w = quaternion
    s: Operand = 2.0 / (x * x + y * y + z * z + w * w)
    return ca.horzcat(
        *(1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)),
        *(s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)),
        *(s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)),
    )


def turn_between(wanted: Matrix, rotation: Matrix) -> Matrix:
    """The turn from a wanted rotation (1, 9) to others (n, 9), all row by row: axis times size, (n, 3).

    The size is the sine of the angle, and beyond a quarter turn 2 - sine: the sine alone is zero for half a turn too.
    """
    entries, wanted_entries = columns(rotation), columns(wanted)
    x, y, z = entries[0:3], entries[3:6], entries[6:9]
    u, v, w = wanted_entries[0:3], wanted_entries[3:6], wanted_entries[6:9]
    crossed = [_dot(z, v) - _dot(y, w), _dot(x, w) - _dot(z, u), _dot(y, u) - _dot(x, v)]
    sine = ca.horzcat(*crossed) / 2.0
    within_quarter = _dot(x, u) + _dot(y, v) + _dot(z, w) >= 1.0
    aside = ca.horzcat(sine[:, 0] + ASIDE, sine[:, 1:])  # for half a turn any axis will do
    size = ca.sqrt(ca.sum2(aside**2) + TINY)
    factor = ca.repmat((2.0 - size) / size, 1, 3)
    return ca.if_else(ca.repmat(within_quarter, 1, 3), sine, factor * aside)


def _dot(first: list[Matrix], second: list[Matrix]) -> Matrix:
    return sum((a * b for a, b in zip(first, second, strict=True)), ca.DM(0.0))
