"""The common part of encodings whose search vectors say where a path leads: its timing follows.

Only among obstacles that move do they say something of when, too: how fast the path is run at most.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import casadi as ca

from problems.base.matrix import FloatArray, Matrix, constant
from problems.encodings.encoding import Encoding, Variable
from problems.encodings.penalty import FeasibilityFirst
from problems.encodings.timing.pace import Pace, pace_rows
from problems.encodings.timing.slowness import Slowness, variables_of
from problems.limits.constraint import Constraint
from problems.limits.distances.step import StepLimit
from problems.limits.limit import Limit
from problems.limits.time_scale import LARGEST_SLOWDOWN, minimum_time_scale, scaling
from problems.motions.path_spline import PathSpline, Rates, TimedPath
from problems.objectives.objective import MotionBounds
from problems.tasks.task import Task

GRID_ALLOWANCE = 1.1  # for what a grid makes of a shortest time
KEPT_BY_TIMING = (1, 2, 3)  # orders of the derivatives whose limits the timing of a path keeps


class PathTiming(FeasibilityFirst, Encoding[TimedPath]):
    """Paths that are run as fast as speed, acceleration and jerk limits allow.

    Attributes:
        task: what is to be done.
        moving_ends: whether start and goal are passed at a velocity that is not zero.
        step_limits: with obstacles, that none is jumped over from one sample to the next.
        slowness: the last variable, where the duration is one.
        pace: the variables before it, where obstacles move.
    """

    name: ClassVar[str] = "reduced"
    scales_time: ClassVar[bool] = True

    task: Task
    motion: PathSpline
    moving_ends: tuple[bool, bool]
    step_limits: tuple[StepLimit, ...]
    slowness: Slowness | None
    pace: Pace | None

    @property
    def timing_variables(self) -> tuple[Variable, ...]:
        """The last variables: [pace,] [slowness]."""
        return (*(() if self.pace is None else self.pace.variables), *variables_of(self.slowness))

    def pace_logarithms(self, x: Matrix) -> Matrix | None:
        """Logarithms of the shares of the speed limits, at the knots of the pace; None where all are made use of."""
        if self.pace is None:
            return None
        last = x.shape[0] - len(variables_of(self.slowness))
        return self.pace.logarithms(x[last - len(self.pace.variables) : last])

    def pace_at_samples(self, x: Matrix) -> Matrix | None:
        """The shares themselves, at the grid points, (n, 1)."""
        logarithms = self.pace_logarithms(x)
        return None if logarithms is None else ca.exp(ca.mtimes(constant(self.pace_rows), logarithms))

    @property
    def pace_rows(self) -> FloatArray:
        """Weights of the knots of the pace at the grid points."""
        return pace_rows(self.motion.parameters_u)

    @abstractmethod
    def path(self, x: Matrix) -> tuple[Matrix, Rates]:
        """Control points (N, dof), rad, and (du/dt)^2 at both ends."""

    @property
    def may_miss(self) -> bool:
        """Whether a candidate may not be where it has to be; not by default."""
        return False

    def path_and_arrival(self, x: Matrix) -> tuple[Matrix, Rates, Constraint | None]:
        """Those of :meth:`path`, and that the candidate is where it has to be; None where that is certain."""
        return *self.path(x), None

    @abstractmethod
    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds of the motions of the search box."""

    @property
    def at_rest(self) -> bool:
        """Whether both ends are at rest, so that a motion may be run more slowly."""
        return not any(self.moving_ends)

    def restored(self, limits: Sequence[Limit]) -> list[Limit]:
        """Speed, acceleration and jerk, which the timing keeps; between ends at rest whatever running slowly keeps."""
        slowing = scaling(limits) if self.at_rest else []
        return [limit for limit in limits if limit.order in KEPT_BY_TIMING or limit in slowing]

    def penalised(self, limits: Sequence[Limit]) -> list[Limit]:
        """What timing cannot restore, and the length of steps."""
        return [*super().penalised(limits), *self.step_limits]

    def slowing(self, limits: Sequence[Limit]) -> list[Limit]:
        """The limits that running more slowly than the timing says makes hold."""
        return [limit for limit in self._beyond_derivatives(limits) if not limit.kept_by_scan]

    def _beyond_derivatives(self, limits: Sequence[Limit]) -> list[Limit]:
        return [limit for limit in self.restored(limits) if limit.order not in KEPT_BY_TIMING]

    def timed(self, shape: TimedPath, limits: Sequence[Limit], peaks: Sequence[Matrix], x: Matrix) -> TimedPath:
        """The motion run more slowly where further limits, given their peaks, the task or the search vector ask it."""
        bounds = self.task.duration_bounds if self.at_rest else None
        factor = ca.fmax(1.0, minimum_time_scale(limits, peaks)) if limits else 1.0
        least = shape.slowed(factor, 0.0 if bounds is None else bounds.shortest)
        return least if self.slowness is None else least.slowed(self.slowness.factor(x, least.duration), 0.0)

    def longest(self, duration: float, limits: Sequence[Limit]) -> float:
        """The longest duration that counts of any candidate, s, given that by speed and acceleration alone."""
        duration *= 1.0 if self.pace is None else self.pace.most_slowdown
        if self._beyond_derivatives(limits):
            duration *= LARGEST_SLOWDOWN
        bounds = self.task.duration_bounds
        least = duration if bounds is None else max(bounds.shortest, duration)
        return least if self.slowness is None else self.slowness.longest_of(least)


def step_limits(task: Task) -> tuple[StepLimit, ...]:
    """That no obstacle is jumped over from one sample to the next, where there are any."""
    limit = StepLimit.holding(task.robot, task.obstacles)
    return () if limit is None else (limit,)
