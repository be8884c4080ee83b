"""Limits: constraints at samples, the time scales they allow, and repetition over bodies."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import ClassVar, NamedTuple, Self

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, Parametric, Relaxation, as_array, total
from problems.motions import SAMPLED_ORDERS, Samples
from problems.robots import Robot
from problems.scene import Obstacle


class PenaltyKind(Enum):
    """The kind of summand g_i(x) in (15) and (25) where h_i(x) says that a limit is broken."""

    MAGNITUDE = "sum of absolute values"  # (16), (17): speeds and accelerations
    COUNT = "number of broken rows"  # (18): lapped points


@dataclass(frozen=True, kw_only=True)
class Constraint:
    """The constraint ``lower <= expression <= upper``, one row a sample, one column a joint, link or obstacle.

    A single row is of the whole motion, or of one point of it.

    Attributes:
        name: short and unique within a problem, for example ``speed``.
        unit: of the expression and the bounds.
        expression: (rows, columns); symbolic in a model, numeric when a trajectory is verified.
        lower: bound of each column, (1, columns); None where there is none.
        upper: bound of each column, (1, columns); None where there is none.
        columns: what each column is, for example ``joint 2``.
        scale: what makes an excess dimensionless, (1, columns); 1 where None.
        equation: where the paper states it; a dash where it does not.
        symmetric: whether ``lower`` is ``-upper``.
        for_all_t: True for a limit on the whole motion, of which the rows are samples; False for a single point.
        penalty: how the paper's cost measures a violation.
        transform: an increasing function of the expression and of its bounds that a nonlinear program takes instead:
            the same limit with better gradients. Of matrices (rows, columns).
        formula: what it says, in the robot's own quantities, for a reader.
    """

    name: str
    unit: str
    expression: Matrix
    lower: Matrix | None
    upper: Matrix | None
    columns: tuple[str, ...]
    scale: Matrix | None = None
    equation: str = "-"
    symmetric: bool = False
    for_all_t: bool = True
    penalty: PenaltyKind = PenaltyKind.COUNT
    transform: Callable[[Matrix], Matrix] | None = None
    formula: str = ""

    @property
    def rows(self) -> int:
        """The number of samples."""
        return int(self.expression.shape[0])

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bound of each column as numbers, both (columns,); infinite where there is none."""
        width = len(self.columns)
        lower = np.full(width, -np.inf) if self.lower is None else as_array(self.lower).ravel()
        upper = np.full(width, np.inf) if self.upper is None else as_array(self.upper).ravel()
        return lower, upper

    @property
    def scales(self) -> FloatArray:
        """The scale of each column as a number, (columns,)."""
        return np.ones(len(self.columns)) if self.scale is None else as_array(self.scale).ravel()

    def row_values(self) -> Matrix:
        """All entries as rows of a nonlinear program, dimensionless, column after column: (rows * columns, 1)."""
        if self.transform is not None:
            return ca.vec(self.transform(self.expression))
        return ca.vec(self.expression if self.scale is None else self.expression / self._repeated(self.scale))

    def row_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of ``row_values``, both (rows * columns,)."""
        lower, upper = (self._transformed(bound) for bound in self.bounds)
        return np.repeat(lower, self.rows), np.repeat(upper, self.rows)

    def _transformed(self, bound: FloatArray) -> FloatArray:
        if self.transform is None:
            return np.asarray(bound / self.scales)
        finite = np.isfinite(bound)
        values = as_array(self.transform(ca.DM(np.where(finite, bound, 0.0)).T)).ravel()
        return np.where(finite, values, bound)

    def excess(self) -> Operand:
        """The amount by which each entry breaks its bounds, in the constraint's unit; 0 where it does not."""
        over: Operand = 0.0
        if self.upper is not None:
            over = ca.fmax(0.0, self.expression - self._repeated(self.upper))
        if self.lower is not None:
            over = over + ca.fmax(0.0, self._repeated(self.lower) - self.expression)
        return over

    def broken(self) -> Matrix:
        """The function H of (16)-(18): 1 where a bound is broken, else 0."""
        if self.symmetric:
            assert self.upper is not None
            return ca.fabs(self.expression) > self._repeated(self.upper)
        below = None if self.lower is None else self.expression < self._repeated(self.lower)
        above = None if self.upper is None else self.expression > self._repeated(self.upper)
        if above is None:
            assert below is not None
            return below
        return above if below is None else ca.logic_or(below, above)

    @property
    def slack(self) -> float:
        """The distance of numeric values from their bounds, dimensionless, at least; negative where one is broken."""
        values = as_array(self.expression)
        lower, upper = self.bounds
        return float(np.min(np.minimum(values - lower, upper - values) / self.scales))

    def paper_penalty(self) -> Matrix:
        """The term h_i(x) g_i(x) of (15) or (25): discontinuous at the limit, so no optimum exceeds it slightly."""
        if self.penalty is PenaltyKind.COUNT:
            return total(self.broken())
        return total(ca.if_else(self.broken(), ca.fabs(self.expression), 0.0))

    def graded_penalty(self) -> Matrix:
        """The sum of the dimensionless excesses: how far, not only how often, the limit is broken."""
        excess = self.excess()
        return total(excess if self.scale is None else excess * self._repeated(1.0 / self.scale))

    def smallest_violation(self) -> float:
        """The least that ``paper_penalty`` can be when any row is broken."""
        if self.penalty is PenaltyKind.COUNT:
            return 1.0
        return float(min(np.abs(bound).min() for bound in self.bounds))

    def _repeated(self, columns: Matrix) -> Matrix:
        """A row of numbers for each sample."""
        return columns if self.rows == 1 else ca.repmat(columns, self.rows, 1)


FAR = 0.25  # of a constraint's scale: a motion that is everywhere farther from a limit may forget it
SAMPLING_MARGIN = 1e-3  # margin at the samples for what lies between them; relative to the reach or a joint's range


class WorldQuestion(NamedTuple):
    """The question about a robot among obstacles that is the whole of a limit.

    Attributes:
        robot: that moves.
        obstacles: among which the robot moves; none for a question about its own links.
        of_own_links: whether own links have to keep clear of each other, not of obstacles.
        proof_gap: share of the smallest clearance seen beyond the margin by which the proven one may be smaller.
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...]
    of_own_links: bool
    proof_gap: float


class Limit(Parametric, ABC):
    """A limit on a whole motion.

    A subclass is a frozen dataclass. What it says is written once, over n samples: one symbolic row for compiled code,
    all rows for a nonlinear program, numbers for a verification.

    Attributes:
        name: of its constraint, short and unique.
        order: which derivative of the joint angles it bounds (0: the angles), so that its extremes over all t are found
            exactly, and proven; None where it is about something else.
        bends: whether it may bend much between two samples, so that nonlinear programs need short, even pieces.
        within_tracking: whether its verdict holds for all motions within the robot's tracking error, not for the
            planned one alone.
    """

    name: ClassVar[str]
    order: ClassVar[int | None] = None
    bends: ClassVar[bool] = False
    within_tracking: ClassVar[bool] = False

    @classmethod
    def for_robot(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit of a robot among obstacles; None where it does not apply."""
        raise NotImplementedError(f"{cls.__name__} is not made from a robot and obstacles alone")

    @abstractmethod
    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """Constraints with one row per sample.

        Args:
            samples: of the motion, in order of time.
            margin: to keep at the samples for what lies between them, a share of the limit's own size.
        """

    @property
    def world_question(self) -> WorldQuestion | None:
        """The question to the compiled core that decides this limit; None where there is none that is all of it."""
        return None

    def complete(self, obstacles: Sequence[Obstacle]) -> Limit:
        """The limit as a verdict judges it, also of what a search leaves out; itself by default."""
        return self

    def exact_constraints_at(self, samples: Samples) -> list[Constraint]:
        """The constraints without what is rounded off for a search or a program; the same ones by default."""
        return self.constraints_at(samples)

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        """Constraints with one row per step from one sample to the next; none by default."""
        return []

    def constraints(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """All constraints, at samples and between them."""
        steps = self.between(*samples.steps, margin) if samples.count > 1 else []
        return [*self.constraints_at(samples, margin), *steps]

    def repetitions(self, symbolic_copy: Self) -> list[Repetition]:
        """The limit as a few that are each repeated with other numbers; none by default: it is evaluated as it is.

        Args:
            symbolic_copy: the same limit with symbols for its numbers.
        """
        return []

    def repeated_numbers(self) -> list[FloatArray]:
        """The numbers of each of :meth:`repetitions`, in their order, without anything symbolic."""
        return []

    def may_break(self, samples: Samples, margin: float = 0.0) -> Matrix | None:
        """Whether it can be broken at one sample, cheaply; None where only all of it says."""
        return None

    def near(self, samples: Samples) -> Self | None:
        """The limit as far as it may matter near a motion, given by numeric samples; None where it is far from it."""
        if self.order is not None:
            return self
        return self if any(constraint.slack < FAR for constraint in self.constraints(samples)) else None

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        """The numbers that bound it, as far as they are stated anywhere; none by default."""
        return ()

    @property
    def time_dependent_part(self) -> Limit | None:
        """The limit as far as it matters at which time a posture is reached: nothing of it by default."""
        return None

    @property
    def time_independent_part(self) -> Limit | None:
        """The limit as far as it does not matter at which time a posture is reached: all of it by default."""
        return self

    @property
    def robot_or_none(self) -> Robot | None:
        """The robot, for a limit that needs more than joint angles; else None."""
        return getattr(self, "robot", None)

    @property
    def scales_with_time(self) -> bool:
        """Whether every shape satisfies the limit if it is run slowly enough."""
        return False

    @property
    def ensured_by_scan(self) -> bool:
        """Whether the timing of a path on a grid, :mod:`problems.motions.path_scan`, keeps it at the grid points."""
        return False

    @property
    def static_limits(self) -> tuple[Limit, ...]:
        """Limits that remain however slowly a motion is run; none by default."""
        return ()

    def magnitudes(self, samples: Samples) -> Matrix:
        """Quantities (n, m) whose peaks determine the time scale; only where the limit scales with time."""
        raise NotImplementedError

    def time_scale(self, peaks: Matrix) -> Matrix:
        """The smallest factor by which time must be multiplied for the limit to hold.

        Args:
            peaks: the largest magnitudes of each column over the motion, (1, m).

        Returns:
            A scalar; below 1 where time can be saved.
        """
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True, eq=False)
class Repetition:
    """A limit on many similar objects: written once, evaluated for each with its own numbers.

    Attributes:
        limits: about one of them, on positions of the robot's frames alone.
        symbols: the numbers of that one, (r, 1).
        numbers: of all of them, (things, r).
        frames: of which positions it needs.
        is_time_dependent: whether it also needs the time.
    """

    limits: tuple[Limit, ...]
    symbols: ca.SX
    numbers: FloatArray
    frames: tuple[int, ...]
    is_time_dependent: bool = False


UNREACHED_TIME_SCALE = 1e12  # a factor that no motion needs
LARGEST_SLOWDOWN = 1e3  # by limits without a bound of what they take: a search tells no longer durations apart


def scaling(limits: Iterable[Limit]) -> list[Limit]:
    """The limits that every shape satisfies if it is run slowly enough."""
    return [limit for limit in limits if limit.scales_with_time]


def peaks_of(limit: Limit, samples: Samples) -> Matrix:
    """The largest magnitudes of each column over the samples, (1, m)."""
    magnitudes = limit.magnitudes(samples)
    peaks: Matrix = magnitudes[0, :]
    for row in range(1, magnitudes.shape[0]):
        peaks = ca.fmax(peaks, magnitudes[row, :])
    return peaks


def minimum_time_scale(limits: Sequence[Limit], peaks: Sequence[Matrix]) -> Matrix:
    """The smallest factor by which time must be multiplied for all limits to hold, given the peaks of each."""
    factors = [limit.time_scale(values) for limit, values in zip(limits, peaks, strict=True)]
    scale = factors[0]
    for factor in factors[1:]:
        scale = ca.fmax(scale, factor)
    return scale


def longest_time_scale(limits: Sequence[Limit], peaks: Mapping[int, Matrix]) -> float:
    """The largest :func:`minimum_time_scale` of motions whose derivatives are bounded.

    Args:
        limits: that scale with time.
        peaks: by order, bounds of the derivative, (1, dof).

    Returns:
        The factor; 0 without limits, ``LARGEST_SLOWDOWN`` times as much where no bound is known of what some take,
        ``UNREACHED_TIME_SCALE`` where none is known of any.
    """
    known = [limit for limit in limits if limit.order in peaks]
    if not known:
        return UNREACHED_TIME_SCALE if limits else 0.0
    scale = float(minimum_time_scale(known, [peaks[limit.order or 0] for limit in known]))
    return scale if len(known) == len(limits) else LARGEST_SLOWDOWN * scale


def depends_on_speed(limits: Iterable[Limit]) -> bool:
    """Whether a limit depends on how fast a motion is run, and is not restored by running it slower."""
    return any(not limit.scales_with_time and _depends_on_time(limit) for limit in limits)


def _depends_on_time(limit: Limit) -> bool:
    robot = limit.robot_or_none
    if robot is None:
        return True
    now = Samples.symbolic(robot, SAMPLED_ORDERS)
    expressions = [ca.vec(constraint.expression) for constraint in limit.constraints_at(now)]
    if not expressions:
        return False
    timing = (*now.derivatives[1:], now.duration, now.times, now.weights)
    symbols = ca.vertcat(*(ca.vec(matrix) for matrix in timing if matrix is not None))
    return any(ca.which_depends(ca.vertcat(*expressions), symbols, 1, False))


POINT_TOLERANCE = 1e-9  # of the reach; allows for rounding only


def reach_limit(cosines: Matrix) -> Constraint:
    """The constraint (13), with absolute values: cos(theta_2) at both ends, (1, 2)."""
    one = ca.DM.ones(1, 2)
    return Constraint(
        name="reach",
        equation="(13)",
        unit="1",
        expression=cosines,
        lower=-one,
        upper=one,
        symmetric=True,
        columns=("k_s", "k_f"),
        for_all_t=False,
        formula="|k_s|, |k_f| <= 1: cos(theta_2) that (1) asks for at start and goal",
    )


def end_point(name: str, tool: Matrix, point: tuple[float, ...], reach: float) -> Constraint:
    """The constraint that the tool (1, dim) of a robot is at its place, up to rounding of that reach, m."""
    bound = ca.DM([[POINT_TOLERANCE * reach]])
    return Constraint(
        name=name,
        unit="m",
        expression=ca.norm_2(tool - ca.horzcat(*point)),
        lower=-bound,
        upper=bound,
        symmetric=True,
        columns=("tip",),
        scale=bound,
        for_all_t=False,
        formula=f"|tip at the {name} - {name}| <= {POINT_TOLERANCE:g} x reach",
    )
