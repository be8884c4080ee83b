"""Accuracy along a path: of the tool's position and of its orientation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from problems.base import Matrix, Parametric
from problems.limits.limit import Constraint, PenaltyKind

DISTANCE_OFFSET = 1e-15  # of the accuracy: keeps the gradient of a distance finite where it is 0


@dataclass(frozen=True)
class Accuracy(Parametric):
    """The limit (24), ``|P*(i) - P(i)| <= accuracy``, of planned and given points at the same path parameter.

    Args:
        accuracy: the largest distance, m.
    """

    numbers: ClassVar[tuple[str, ...]] = ("accuracy",)

    accuracy: float

    def at(self, tool: Matrix, points: Matrix, margin: float = 0.0) -> Constraint:
        """The limit at n points of the path: planned and given positions, both (n, dim), m.

        Args:
            tool: planned positions.
            points: given ones.
            margin: to keep, as a share of the accuracy.
        """
        return self._constraint(tool - points, "|P*_i - tip(theta(u_i))| <= accuracy, at every given point i", margin)

    def along(self, tool: Matrix, starts: Matrix, ends: Matrix, margin: float) -> Constraint:
        """The limit between points of the path: the tool stays near the straight lines that join them.

        Args:
            tool: planned positions, (n, dim), m.
            starts: where the lines begin, likewise.
            ends: where they end.
            margin: to keep, as a share of the accuracy.
        """
        nearest = starts + ca.repmat(shares_along(tool, starts, ends), 1, tool.shape[1]) * (ends - starts)
        formula = "the distance from the tip at t_j to the line between two given points <= accuracy"
        return self._constraint(tool - nearest, formula, margin)

    def _constraint(self, away: Matrix, formula: str, margin: float) -> Constraint:
        """The constraint on the lengths of vectors (n, dim), m."""
        return Constraint(
            name="accuracy",
            equation="(24)",
            unit="m",
            expression=ca.sqrt(ca.sum2(away * away) + (DISTANCE_OFFSET * self.accuracy) ** 2),
            lower=None,
            upper=ca.horzcat(self.accuracy if margin == 0.0 else self.accuracy * (1.0 - margin)),
            columns=("tip",),
            scale=ca.horzcat(self.accuracy),
            penalty=PenaltyKind.MAGNITUDE,
            transform=lambda distance: (distance / self.accuracy) ** 2,
            formula=formula,
        )


def shares_along(tool: Matrix, starts: Matrix, ends: Matrix) -> Matrix:
    """Places on lines nearest to n points: shares of the lengths, (n, 1); vectors from there, (n, dim), m."""
    line = ends - starts
    share = ca.sum2((tool - starts) * line) / ca.sum2(line * line)
    return ca.fmin(1.0, ca.fmax(0.0, share))


LEAST_SQUARE = 1e-30  # keeps the gradient of an angle finite where it is 0


@dataclass(frozen=True)
class AngularAccuracy(Parametric):
    """The limit on the angle between the tool's planned and given orientation.

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
        wanted = turned_along(shares, lines)
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


def turned_along(shares: Matrix, lines: Matrix) -> Matrix:
    """Rotations (n, 9) row by row at shares (n, 1) of the lengths of lines that turn, (n, 13)."""
    return _turned(lines[:, :9], lines[:, 9:12], shares * lines[:, 12])


def rotation_away(wanted: ca.SX, rotation: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The rotation from one (3, 3) to another: the axis times the sine of the angle, (3, 1), and the cosine."""
    away = wanted.T @ rotation
    sine = ca.vertcat(away[2, 1] - away[1, 2], away[0, 2] - away[2, 0], away[1, 0] - away[0, 1]) / 2.0
    return sine, (ca.trace(away) - 1.0) / 2.0


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
    """The product ``rows @ K`` with K the matrix of the cross product with an axis: both (n, 3)."""
    pairs = ((1, 2), (2, 0), (0, 1))
    return ca.horzcat(*(rows[:, j] * axis[:, k] - rows[:, k] * axis[:, j] for j, k in pairs))


def _scaled(factor: Matrix, rows: Matrix) -> Matrix:
    return ca.repmat(factor, 1, rows.shape[1]) * rows
