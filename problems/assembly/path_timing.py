"""Time scales that are searched: of a whole motion, and along a path.

Where less time is never worse a motion runs as fast as its limits allow, and there is nothing to decide. Energy falls
with the duration at first; against gravity it rises again, without gravity it falls for ever, so that there is a most.
The time scale is then one more variable.

Where nothing moves, the fastest timing of a path is the best one. Where an obstacle moves it may pay to come later: the
speed limits are scaled along the path, and its timing keeps all limits whatever the scale is. A crawl is a wait.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import log

import casadi as ca
import numpy as np

from problems.assembly.encoding import Encoding, FeasibilityFirst, SearchedTimeScale, Variable
from problems.base import FloatArray, Matrix, Parametric, constant
from problems.limits import LARGEST_SLOWDOWN, Constraint, Limit, StepLimit, minimum_time_scale, scaling
from problems.motions import PathSpline, Rates, TimedPath
from problems.tasks import Task

KNOTS = 5
LEAST_SHARE = 0.02  # of the speed limits: a crawl
FULL = 7.0  # how far a variable may be above 0, where it says nothing: half of a first population waits nowhere at all


@dataclass(frozen=True)
class LocalTimeScale(Parametric):
    """A share of the speed limits along a path, its logarithm linear between a few equally spaced knots.

    Args:
        moving_ends: whether start and goal are passed at a velocity, with the speed limits as they are.
    """

    moving_ends: tuple[bool, bool] = (False, False)

    @classmethod
    def where_needed(cls, task: Task) -> LocalTimeScale | None:
        """The variables where an obstacle moves."""
        return cls(moving_ends(task)) if task.is_timed else None

    @property
    def _free(self) -> range:
        start, goal = self.moving_ends
        return range(int(start), KNOTS - int(goal))

    @property
    def variables(self) -> tuple[Variable, ...]:
        """One for each knot that is free: from 0 on for all of the speed limits, -1 for a crawl."""
        return tuple(Variable(f"local_time_scale_{knot + 1}", -1.0, FULL, "1") for knot in self._free)

    def logarithms(self, own: Matrix) -> Matrix:
        """Logarithms of the shares at the knots, (KNOTS, 1), of the variables (n, 1)."""
        found: list[Matrix] = [ca.DM(0.0)] * KNOTS
        for place, knot in enumerate(self._free):
            found[knot] = log(LEAST_SHARE) * ca.fmax(0.0, -own[place])
        return ca.vertcat(*found)


def moving_ends(task: Task) -> tuple[bool, bool]:
    """Whether start and goal of a task are passed at a velocity that is not zero."""
    start, goal = task.end_velocities
    return bool(start.any()), bool(goal.any())


GRID_ALLOWANCE = 1.1  # for what a grid makes of a shortest time
KEPT_BY_TIMING = (1, 2, 3)  # orders of the derivatives whose limits the timing of a path keeps


@dataclass(frozen=True)
class PathTiming(FeasibilityFirst, Encoding[TimedPath]):
    """Paths that are run as fast as speed, acceleration and jerk limits allow.

    Args:
        task: what is to be done.
        motion: that is decoded.
        time_scale: the last variable, where the duration is one.
        local_time_scale: the variables before it, where obstacles move.

    Attributes:
        moving_ends: whether start and goal are passed at a velocity that is not zero.
        step_limits: with obstacles, that none is jumped over from one sample to the next.
    """

    task: Task
    motion: PathSpline
    time_scale: SearchedTimeScale | None = field(default=None, kw_only=True)
    local_time_scale: LocalTimeScale | None = field(default=None, kw_only=True)
    moving_ends: tuple[bool, bool] = field(init=False)
    step_limits: tuple[StepLimit, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "moving_ends", moving_ends(self.task))
        object.__setattr__(self, "step_limits", step_limits(self.task))

    @property
    def timing_variables(self) -> tuple[Variable, ...]:
        """The last variables: [the local time scale,] [the time scale]."""
        return (*(() if self.local_time_scale is None else self.local_time_scale.variables), *self.time_scale_variables)

    def speed_share_logarithms(self, x: Matrix) -> Matrix | None:
        """Logarithms of the shares of the speed limits, at their knots; None where all are made use of."""
        if self.local_time_scale is None:
            return None
        last = x.shape[0] - len(self.time_scale_variables)
        return self.local_time_scale.logarithms(x[last - len(self.local_time_scale.variables) : last])

    def speed_shares(self, x: Matrix) -> Matrix | None:
        """The shares themselves, at the grid points, (n, 1)."""
        logarithms = self.speed_share_logarithms(x)
        return None if logarithms is None else ca.exp(ca.mtimes(constant(self.share_rows), logarithms))

    @property
    def share_rows(self) -> FloatArray:
        """Weights of the knots of the local time scale at the grid points, (n, KNOTS)."""
        return np.maximum(0.0, 1.0 - np.abs(self.motion.parameters_u[:, None] * (KNOTS - 1) - np.arange(KNOTS)))

    @abstractmethod
    def path(self, x: Matrix) -> tuple[Matrix, Rates]:
        """Control points (N, dof), rad, and (du/dt)^2 at both ends."""

    @property
    def may_miss(self) -> bool:
        """Whether a candidate may not be where it has to be; not by default."""
        return False

    def path_and_arrival(self, x: Matrix) -> tuple[Matrix, Rates, Constraint | None]:
        """The results of :meth:`path`, and the condition of arrival; None where arrival is certain."""
        return *self.path(x), None

    @property
    def at_rest(self) -> bool:
        """Whether both ends are at rest, so that a motion may be run more slowly."""
        return not any(self.moving_ends)

    def restored(self, limits: Sequence[Limit]) -> list[Limit]:
        """Speed, acceleration and jerk, which the timing keeps; between ends at rest whatever running slowly keeps."""
        slowing = scaling(limits) if self.at_rest else []
        return [limit for limit in limits if limit.order in KEPT_BY_TIMING or limit in slowing]

    def slowing(self, limits: Sequence[Limit]) -> list[Limit]:
        return [limit for limit in self._beyond_derivatives(limits) if not limit.ensured_by_scan]

    def _beyond_derivatives(self, limits: Sequence[Limit]) -> list[Limit]:
        return [limit for limit in self.restored(limits) if limit.order not in KEPT_BY_TIMING]

    def timed(self, shape: TimedPath, limits: Sequence[Limit], peaks: Sequence[Matrix], x: Matrix) -> TimedPath:
        """The motion run more slowly where further limits, given their peaks, the task or the search vector ask it."""
        bounds = self.task.duration_bounds if self.at_rest else None
        factor = ca.fmax(1.0, minimum_time_scale(limits, peaks)) if limits else 1.0
        least = shape.time_scaled(factor, 0.0 if bounds is None else bounds.shortest)
        return least if self.time_scale is None else least.time_scaled(self.time_scale.factor(x, least.duration), 0.0)

    def longest(self, duration: float, limits: Sequence[Limit]) -> float:
        """The longest duration that counts of any candidate, s, given that by speed and acceleration alone."""
        duration *= 1.0 if self.local_time_scale is None else 1.0 / LEAST_SHARE
        if self._beyond_derivatives(limits):
            duration *= LARGEST_SLOWDOWN
        bounds = self.task.duration_bounds
        return self.longest_with_time_scale(duration if bounds is None else max(bounds.shortest, duration))


def step_limits(task: Task) -> tuple[StepLimit, ...]:
    """Limits with which no obstacle is jumped over from one sample to the next; none without obstacles."""
    limit = StepLimit.for_robot(task.robot, task.obstacles)
    return () if limit is None else (limit,)
