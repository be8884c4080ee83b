"""How long a motion, or each of its segments, may take: the task's own bounds, kept by the finished motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray, Matrix, Operand
from problems.limits.constraint import Constraint


@dataclass(frozen=True)
class DurationBounds(Statement):
    """``shortest <= t_i <= longest`` for every duration t_i of a finished motion, after any time scaling.

    Args:
        name: of the constraint.
        symbol: of a duration; ``{}`` stands for its number where there are several.
        shortest: s.
        longest: s.
    """

    numbers: ClassVar[tuple[str, ...]] = ("shortest", "longest")

    name: str
    symbol: str
    shortest: float
    longest: float

    def at(self, durations: Matrix, margin: float = 0.0) -> Constraint:
        """The bounds of durations (1, n), s.

        Args:
            durations: of the motion or of its segments.
            margin: to keep below the longest, as a share of it: limits that a motion breaks between its samples
                slow it down afterwards.
        """
        count = int(durations.shape[1])
        symbols = tuple(self.symbol.format(number) for number in range(1, count + 1))
        return Constraint(
            name=self.name,
            unit="s",
            expression=durations,
            lower=ca.repmat(ca.horzcat(self.shortest), 1, count),
            upper=ca.repmat(ca.horzcat(self.with_margin(margin)), 1, count),
            columns=symbols,
            scale=ca.repmat(ca.horzcat(self.longest), 1, count),
            formula=f"shortest <= {', '.join(symbols)} <= longest, of the finished motion",
        )

    def with_margin(self, margin: float) -> Operand:
        """The longest duration less a margin, but never less than half-way from the shortest, s."""
        if margin == 0.0:
            return self.longest
        return ca.fmax(self.longest * (1.0 - margin), (self.shortest + self.longest) / 2.0)

    def search_box(self, margin: float) -> tuple[float, float]:
        """Bounds of a duration that is a decision variable, s."""
        return self.shortest, float(self.with_margin(margin))

    def time_scale(self, durations: FloatArray) -> float:
        """The smallest factor by which time must be multiplied for no duration (n,) in s to be too short."""
        return float(self.shortest / np.min(durations))
