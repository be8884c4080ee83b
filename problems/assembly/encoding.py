"""What an encoding is: decision variables with bounds and units, the motion of a vector, its cost with penalties.

(15) adds lambda_1 times the broken limits to the objective and replaces both by lambda_2 (k_s + k_f) where the arm
cannot reach. With round values (100; 10,000) the order is inverted: most points that are reachable but too
fast cost more than unreachable ones, and a search settles on the latter. Here lambda_1 and lambda_2 follow from
bounds of the terms that they multiply, so that always: feasible < breaks a limit < unreachable.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Generic, TypeVar

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Parametric, largest
from problems.limits import SAMPLING_MARGIN, Constraint, Limit, PenaltyKind, StepLimit, scaling
from problems.motions import Motion
from problems.objectives import MotionBounds, Objective
from problems.tasks import Task

P = TypeVar("P")


@dataclass(frozen=True)
class Variable:
    """One decision variable: name, box and unit."""

    name: str
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Decoded(Generic[P]):
    """The motion that a search vector stands for.

    Attributes:
        parameters: of the motion.
        reach: condition of inverse kinematics, part of the cost; None where every vector can be reached.
    """

    parameters: P
    reach: Constraint | None = None


@dataclass(frozen=True, kw_only=True)
class CostWeights(Parametric):
    """The numbers of a cost, which follow from what no candidate can exceed.

    Attributes:
        objective_upper_bound: no feasible candidate costs more, every infeasible one does.
        limit: lambda_1 of (15) and (25), on broken limits.
        reach: lambda_2 of (15), where the arm cannot reach.
    """

    numbers: ClassVar[tuple[str, ...]] = ("objective_upper_bound", "limit", "reach")

    objective_upper_bound: float
    limit: float
    reach: float


LARGEST_TIME_SCALE = 10.0  # of the least duration, where the task does not bound it


@dataclass(frozen=True)
class SearchedTimeScale(Parametric):
    """The last variable of a search vector: 0 for the least duration, 1 for the longest.

    Args:
        longest: duration of the motion, or of the longest of its parts, s; ``LARGEST_TIME_SCALE`` times the least one
            where None.
    """

    numbers: ClassVar[tuple[str, ...]] = ("longest",)

    longest: float | None = None

    @classmethod
    def where_needed(cls, objective: Objective, task: Task) -> SearchedTimeScale | None:
        """The variable where an objective needs it; none between moving ends, whose velocities are given."""
        if not objective.chooses_duration or task.end_velocities.any():
            return None
        bounds = task.duration_bounds
        return cls(None if bounds is None else bounds.search_box(SAMPLING_MARGIN)[1])

    def factor(self, x: Matrix, least: Matrix) -> Matrix:
        """How many times longer than ``least`` (s, of the longest part) the motion of a search vector (d, 1) takes.

        The variable's square is what grows with the duration: a little slower is found more often.
        """
        most = LARGEST_TIME_SCALE if self.longest is None else ca.fmax(1.0, self.longest / least)
        return 1.0 + (most - 1.0) * x[-1] ** 2


class Encoding(Parametric, ABC, Generic[P]):
    """The mapping from a search vector to the parameters P of a motion. A subclass is a frozen dataclass.

    Attributes:
        name: of the formulation, as in a scenario file.
        motion: whose parameters it decodes.
        scales_time: whether what is decoded is a shape, which is then run as fast as the limits allow.
        time_scale: the last variable, where time is scaled and the duration is one.
        step_limits: of steps from one sample to the next, besides the limits of the problem.
    """

    name: ClassVar[str]
    scales_time: ClassVar[bool]
    motion: Motion[P]
    time_scale: SearchedTimeScale | None = None
    step_limits: tuple[StepLimit, ...] = ()

    @property
    @abstractmethod
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables, in order."""

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the search box, both (d,)."""
        lower, upper = zip(*((v.lower, v.upper) for v in self.variables), strict=True)
        return np.array(lower), np.array(upper)

    @property
    def time_scale_variables(self) -> tuple[Variable, ...]:
        """The time scale, where it is a variable."""
        return () if self.time_scale is None else (Variable("time_scale", 0.0, 1.0, "1"),)

    def longest_with_time_scale(self, duration: float) -> float:
        """The longest duration, s, of motions that take at most ``duration`` where the time scale is no variable."""
        if self.time_scale is None:
            return duration
        longest = self.time_scale.longest
        return LARGEST_TIME_SCALE * duration if longest is None else max(longest, duration)

    @abstractmethod
    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds that no candidate of the search box exceeds."""

    @abstractmethod
    def decode(self, x: Matrix) -> Decoded[P]:
        """The motion of a search vector (d, 1), or its shape where time is scaled afterwards."""

    def restored(self, limits: Sequence[Limit]) -> list[Limit]:
        """The limits that scaling time makes hold at the samples; none where time is not scaled."""
        return scaling(limits) if self.scales_time else []

    def slowing(self, limits: Sequence[Limit]) -> list[Limit]:
        """The limits whose peaks :meth:`timed` has to know; those that it restores by default."""
        return self.restored(limits)

    def penalised(self, limits: Sequence[Limit]) -> list[Limit]:
        """The limits that a decoded motion can break: not restored, what is left of those that are, and of steps."""
        restored = self.restored(limits)
        broken = [limit for limit in limits if limit not in restored]
        return [*broken, *(static for limit in restored for static in limit.static_limits), *self.step_limits]

    def timed(self, shape: P, limits: Sequence[Limit], peaks: Sequence[Matrix], x: Matrix) -> P:
        """The shape run as fast as the limits allow, given their peaks, or slower where the search vector x says so.

        Unchanged where time is not scaled.
        """
        return shape

    @abstractmethod
    def penalty(self, constraint: Constraint) -> Matrix:
        """The penalty for the rows of a constraint that are broken; scalar, 0 where all hold."""

    @abstractmethod
    def cost(
        self, objective: Matrix, penalties: Sequence[Matrix], reach: Matrix | None, weights: CostWeights
    ) -> Matrix:
        """One number for a metaheuristic: below every infeasible cost exactly when feasible at the samples.

        Args:
            objective: of the motion, scalar.
            penalties: of each constraint over all rows, scalars.
            reach: the condition of inverse kinematics, (1, n), within [-1, 1] where it reaches.
            weights: numbers of this cost.
        """

    @abstractmethod
    def weights(self, objective_upper_bound: float, penalised: Callable[[], Sequence[Constraint]]) -> CostWeights:
        """The smallest weights that keep the order feasible < breaks a limit < unreachable.

        Args:
            objective_upper_bound: what the objective cannot exceed in the search box.
            penalised: all that is penalised, over all rows.
        """


UNKNOWN_MAGNITUDE = 1e12  # stands for the unknown upper bound of a constraint that is penalised by its magnitude


class PaperCost:
    """The part of an encoding that costs as the paper does, with lambda_1 and lambda_2 that keep the order."""

    name: ClassVar[str] = "paper"
    scales_time: ClassVar[bool] = False

    def penalty(self, constraint: Constraint) -> Matrix:
        """The penalty h_i(x) g_i(x) of (15) and (25)."""
        return constraint.paper_penalty()

    def cost(
        self, objective: Matrix, penalties: Sequence[Matrix], reach: Matrix | None, weights: CostWeights
    ) -> Matrix:
        """(15), with |k_s| and |k_f| (``reach``) where the paper prints k_s and k_f.

        (25) where every vector is reached, whose printed lambda_1 is 1.
        """
        penalised = objective + weights.limit * sum(penalties)
        if reach is None:
            return penalised
        cosines = ca.fabs(reach)
        return ca.if_else(largest(cosines) <= 1.0, penalised, weights.reach * ca.sum2(cosines))

    def largest_magnitudes(self) -> Mapping[str, FloatArray] | None:
        """Bounds of the absolute value of each column, by constraint name; None where every vector is reached."""
        return None

    def weights(self, objective_upper_bound: float, penalised: Callable[[], Sequence[Constraint]]) -> CostWeights:
        """The lambda_1 with which breaking any limit costs more than any feasible objective, and lambda_2 above it."""
        constraints, magnitudes = penalised(), self.largest_magnitudes()
        limit = objective_upper_bound / min((c.smallest_violation() for c in constraints), default=1.0)
        reach = 0.0
        if magnitudes is not None:
            worst = sum(_largest_penalty(constraint, magnitudes) for constraint in constraints)
            reach = objective_upper_bound + limit * worst
        return CostWeights(objective_upper_bound=objective_upper_bound, limit=limit, reach=reach)


def _largest_penalty(constraint: Constraint, magnitudes: Mapping[str, FloatArray]) -> float:
    rows, width = constraint.expression.shape
    if constraint.penalty is PenaltyKind.COUNT:
        return float(rows * width)
    return float(rows * np.sum(magnitudes.get(constraint.name, np.full(width, UNKNOWN_MAGNITUDE))))


class FeasibilityFirst:
    """The part of an encoding that grades infeasibility: no weights to find."""

    name: ClassVar[str] = "reduced"
    scales_time: ClassVar[bool] = True

    def penalty(self, constraint: Constraint) -> Matrix:
        """The sum of the dimensionless excesses."""
        return constraint.graded_penalty()

    def cost(
        self, objective: Matrix, penalties: Sequence[Matrix], reach: Matrix | None, weights: CostWeights
    ) -> Matrix:
        """The objective where all constraints hold, else more than any objective by how far they are broken.

        What is above the bound of the objective counts as that bound.
        """
        bound, excess = weights.objective_upper_bound, sum(penalties, ca.DM(0))
        return ca.if_else(excess > 0.0, bound + excess, ca.if_else(objective > bound, bound, objective))

    def weights(self, objective_upper_bound: float, penalised: Callable[[], Sequence[Constraint]]) -> CostWeights:
        """Only the upper bound of the objective is needed."""
        return CostWeights(objective_upper_bound=objective_upper_bound, limit=0.0, reach=0.0)
