"""Execution time, (8), (19)."""

from __future__ import annotations

from typing import ClassVar

from problems.base.matrix import Matrix
from problems.objectives.objective import MotionBounds, Objective


class ExecutionTime(Objective):
    """(8) T = t_1 + t_2, (19) T = t_T; s."""

    name: ClassVar[str] = "time"
    symbol: ClassVar[str] = "T"
    equation: ClassVar[str] = "(8)"
    unit: ClassVar[str] = "s"
    sooner_is_better: ClassVar[bool] = True
    is_duration: ClassVar[bool] = True

    def terminal(self, duration: Matrix) -> Matrix:
        """The duration itself."""
        return duration

    def upper_bound(self, bounds: MotionBounds) -> float:
        """The longest duration."""
        return bounds.duration
