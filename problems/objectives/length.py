"""Travel length of the tip, (10)."""

from __future__ import annotations

from typing import ClassVar

import casadi as ca

from problems.base.matrix import Matrix
from problems.motions.samples import Samples
from problems.objectives.objective import MotionBounds, Objective

SMOOTHING_LENGTH = 1e-3  # m: rounds the corner of a tip that stands still; costs 1e-4 of a length


class TipTravel(Objective):
    """(10): length of the line through the tip's positions at the samples; m."""

    name: ClassVar[str] = "length"
    symbol: ClassVar[str] = "F_d"
    equation: ClassVar[str] = "(10)"
    unit: ClassVar[str] = "m"
    timed: ClassVar[bool] = False
    sooner_is_better: ClassVar[bool] = True
    norm: ClassVar[float] = 1.0
    program_steps: ClassVar[int | None] = 12

    def between(self, before: Samples, after: Samples) -> Matrix:
        """The length of each step."""
        step = after.tool - before.tool
        return ca.sqrt(ca.sum2(step * step))

    def upper_bound(self, bounds: MotionBounds) -> float:
        """The tip moves no farther than the farthest it can be from the base times what the joints turn."""
        return bounds.radius * bounds.rotation

    def smooth(self, samples: Samples, slack: Matrix) -> Matrix:
        """The same with corners rounded off by ``SMOOTHING_LENGTH``."""
        before, after = samples.steps
        step = after.tool - before.tool
        return ca.sum1(ca.sqrt(ca.sum2(step * step) + SMOOTHING_LENGTH**2) - SMOOTHING_LENGTH)
