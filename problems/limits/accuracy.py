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

    def at(self, tool: Matrix, points: Matrix) -> Constraint:
        """The limit at n points of the path: planned and given positions, both (n, dim), m."""
        away = tool - points
        return Constraint(
            name="accuracy",
            equation="(24)",
            unit="m",
            expression=ca.sqrt(ca.sum2(away * away) + (DISTANCE_OFFSET * self.accuracy) ** 2),
            lower=None,
            upper=ca.horzcat(self.accuracy),
            columns=("tip",),
            scale=ca.horzcat(self.accuracy),
            penalty=PenaltyKind.MAGNITUDE,
            transform=lambda distance: (distance / self.accuracy) ** 2,
            formula="|P*_i - tip(theta(u_i))| <= accuracy, at every given point i",
        )
