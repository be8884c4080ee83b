"""How fast a path is run, of what speed limits allow: variables of searches among obstacles that move.

Where nothing moves, the fastest timing of a path is the best one. Where an obstacle moves it may pay to come later:
the speed limits are scaled along the path, and its timing keeps all limits whatever the scale is. A crawl is a wait.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log

import casadi as ca
import numpy as np

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray, Matrix
from problems.encodings.encoding import Variable
from problems.tasks.task import Task

KNOTS = 5
LEAST = 0.02  # of the speed limits: a crawl
FULL = 7.0  # how far a variable may be above 0, where it says nothing: half of a first population waits nowhere at all


@dataclass(frozen=True)
class Pace(Statement):
    """A share of the speed limits along a path, its logarithm linear between a few equally spaced knots.

    Args:
        moving_ends: whether start and goal are passed at a velocity, with the speed limits as they are.
    """

    moving_ends: tuple[bool, bool] = (False, False)

    @property
    def knots(self) -> int:
        """How many there are, also where some are not free."""
        return KNOTS

    @property
    def _free(self) -> range:
        start, goal = self.moving_ends
        return range(int(start), KNOTS - int(goal))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """One for each knot: from 0 on for all of the speed limits, -1 for a crawl."""
        return tuple(Variable(f"pace_{knot + 1}", -1.0, FULL, "1") for knot in self._free)

    def logarithms(self, own: Matrix) -> Matrix:
        """Logarithms of the shares at the knots, (KNOTS, 1), of the variables (n, 1)."""
        found: list[Matrix] = [ca.DM(0.0)] * KNOTS
        for place, knot in enumerate(self._free):
            found[knot] = log(LEAST) * ca.fmax(0.0, -own[place])
        return ca.vertcat(*found)

    @property
    def most_slowdown(self) -> float:
        """How many times longer a motion takes at most."""
        return 1.0 / LEAST


def pace_rows(u: FloatArray) -> FloatArray:
    """Weights (n, KNOTS) of the knots at path parameters (n,)."""
    return np.maximum(0.0, 1.0 - np.abs(u[:, None] * (KNOTS - 1) - np.arange(KNOTS)))


def pace_of(task: Task, moving_ends: tuple[bool, bool] = (False, False)) -> Pace | None:
    """The variables where an obstacle moves."""
    return Pace(moving_ends) if task.is_timed else None
