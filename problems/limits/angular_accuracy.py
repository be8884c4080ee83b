"""How near the tool is turned to what a path says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from problems.base.arguments import Statement
from problems.base.matrix import Matrix
from problems.limits.constraint import Constraint, PenaltyKind

LEAST_SQUARE = 1e-30  # keeps the gradient of an angle finite where it is 0
TURNING_NUMBERS = 13  # of a line: rotation matrix at its start, axis, angle


@dataclass(frozen=True)
class AngularAccuracy(Statement):
    """The tool is turned otherwise by at most so much.

    Args:
        accuracy: the largest angle, rad.
    """

    numbers: ClassVar[tuple[str, ...]] = ("accuracy",)

    accuracy: float

    def along(self, turned: Matrix, shares: Matrix, lines: Matrix, margin: float) -> Constraint:
        """The limit at n points near lines.

        Args:
            turned: rotation matrices of the tool, row by row, (n, 9).
            shares: of the lines' lengths, where the nearest points are, (n, 1).
            lines: the rotation matrix at the start row by row, the axis in the tool's axes, and the angle (rad) by
                which it turns about it to the end, (n, 13).
            margin: to keep, as a share of the accuracy.
        """
        wanted = _turned(lines[:, :9], lines[:, 9:12], shares * lines[:, 12])
        away = turned - wanted
        half_sine = ca.sqrt((ca.sum2(away * away) + LEAST_SQUARE) / 8.0)
        return Constraint(
            name="angular accuracy",
            unit="rad",
            expression=2.0 * ca.asin(ca.fmin(1.0, half_sine)),
            lower=None,
            upper=ca.horzcat(self.accuracy * (1.0 - margin)),
            columns=("tip",),
            scale=ca.horzcat(self.accuracy),
            penalty=PenaltyKind.MAGNITUDE,
            formula="the angle from the tool at t_j to the orientation at the nearest point of the path <= accuracy",
        )


def _turned(start: Matrix, axis: Matrix, angle: Matrix) -> Matrix:
    """Rotations (n, 9) row by row, turned about axes (n, 3) of their own by angles (n, 1).

    R (I + s K + (1 - c) K^2), K the matrix of the cross product with the axis.
    """
    s, versine = ca.sin(angle), 1.0 - ca.cos(angle)
    found = []
    for i in range(3):
        row = start[:, 3 * i : 3 * i + 3]
        once = _crossed(row, axis)
        found.append(row + _scaled(s, once) + _scaled(versine, _crossed(once, axis)))
    return ca.horzcat(*found)


def _crossed(rows: Matrix, axis: Matrix) -> Matrix:
    """``rows @ K`` with K the matrix of the cross product with an axis: each row crossed with it; both (n, 3)."""
    pairs = ((1, 2), (2, 0), (0, 1))
    return ca.horzcat(*(rows[:, j] * axis[:, k] - rows[:, k] * axis[:, j] for j, k in pairs))


def _scaled(factor: Matrix, rows: Matrix) -> Matrix:
    return ca.repmat(factor, 1, rows.shape[1]) * rows
