"""How near the tip passes the points of a path, (24)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from problems.base.arguments import Statement
from problems.base.matrix import Matrix
from problems.limits.constraint import Constraint, PenaltyKind

DISTANCE_OFFSET = 1e-15  # of the accuracy: keeps the gradient of a distance finite where it is 0


@dataclass(frozen=True)
class Accuracy(Statement):
    """(24): ``|P*(i) - P(i)| <= accuracy``, planned and given point at the same path parameter.

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
        """On the lengths of vectors (n, dim), m."""
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
    """Where on lines the nearest points to n others are: shares of their lengths, (n, 1); the rest (n, dim), m."""
    line = ends - starts
    share = ca.sum2((tool - starts) * line) / ca.sum2(line * line)
    return ca.fmin(1.0, ca.fmax(0.0, share))
