"""Timing of searched shapes: how slowly a limit wants them run, and the cost that follows.

Where less time is never worse a motion runs as fast as its limits allow, and there is nothing to decide. Energy falls
with the duration at first; against gravity it rises again, without gravity it falls for ever, so that there is a most.

Where nothing moves, the fastest timing of a path is the best one. Where an obstacle moves it may pay to come later:
the speed limits are scaled along the path, and its timing keeps all limits whatever the scale is. A crawl is a wait.

Only among obstacles that move do they say something of when, too: how fast the path is run at most.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import log
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.assembly.encoding import Encoding, FeasibilityFirst, Variable
from problems.base import FloatArray, Matrix, Parametric, constant
from problems.limits import LARGEST_SLOWDOWN, SAMPLING_MARGIN, Constraint, Limit, StepLimit, minimum_time_scale, scaling
from problems.motions import PathSpline, Rates, TimedPath
from problems.objectives import MotionBounds, Objective
from problems.tasks import Task

MOST = 10.0  # times the least duration, where the task does not bound it


@dataclass(frozen=True)
class Slowness(Parametric):
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


KNOTS = 5
LEAST = 0.02  # of the speed limits: a crawl
FULL = 7.0  # how far a variable may be above 0, where it says nothing: half of a first population waits nowhere at all


@dataclass(frozen=True)
class Pace(Parametric):
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
    limit = StepLimit.for_robot(task.robot, task.obstacles)
    return () if limit is None else (limit,)
