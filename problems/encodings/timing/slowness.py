"""How much more slowly than it could a motion is run: one more variable of encodings whose timing follows.

Where less time is never worse a motion runs as fast as its limits allow, and there is nothing to decide. Energy falls
with the duration at first; against gravity it rises again, without gravity it falls for ever, so that there is a most.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import casadi as ca

from problems.base.arguments import Statement
from problems.base.matrix import Matrix
from problems.encodings.encoding import Variable
from problems.limits.limit import SAMPLING_MARGIN
from problems.objectives.objective import Objective
from problems.tasks.task import Task

MOST = 10.0  # times the least duration, where the task does not bound it


@dataclass(frozen=True)
class Slowness(Statement):
    """The last variable of a search vector: 0 for the least duration, 1 for the longest.

    Args:
        longest: duration of the motion, or of the longest of its parts, s; ``MOST`` times the least one where None.
    """

    numbers: ClassVar[tuple[str, ...]] = ("longest",)

    longest: float | None = None

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The one variable, whose square is what grows with the duration: a little slower is found more often."""
        return (Variable("slowness", 0.0, 1.0, "1"),)

    def factor(self, x: Matrix, least: Matrix) -> Matrix:
        """How many times longer than ``least`` (s, of the longest part) the motion of a search vector (d, 1) takes."""
        most = MOST if self.longest is None else ca.fmax(1.0, self.longest / least)
        return 1.0 + (most - 1.0) * x[-1] ** 2

    def longest_of(self, duration: float) -> float:
        """What a motion takes at most, s, if it takes at most ``duration`` without this variable."""
        return MOST * duration if self.longest is None else max(self.longest, duration)


def slowness_of(objective: Objective, task: Task) -> Slowness | None:
    """The variable where an objective needs it; none between moving ends, whose velocities are given."""
    if not objective.chooses_duration or task.end_velocities.any():
        return None
    bounds = task.duration_bounds
    return Slowness(None if bounds is None else bounds.search_box(SAMPLING_MARGIN)[1])


def variables_of(slowness: Slowness | None) -> tuple[Variable, ...]:
    """The variable, where there is one."""
    return () if slowness is None else slowness.variables
