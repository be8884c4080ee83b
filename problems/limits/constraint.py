"""One named constraint, the single source of the penalty, the nonlinear program and the audit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, StrEnum

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, as_array, repeated, row, total


class PenaltyKind(Enum):
    """What g_i(x) of (15) and (25) adds up where h_i(x) says that a limit is broken."""

    MAGNITUDE = "sum of absolute values"  # (16), (17): speeds and accelerations
    COUNT = "number of broken rows"  # (18): lapped points


@dataclass(frozen=True)
class Constraint:
    """``lower <= expression <= upper``, one row a time sample, one column a joint, link or obstacle.

    Attributes:
        name: short and unique within a problem, for example ``speed``.
        equation: where the paper states it.
        unit: of the expression and the bounds.
        expression: (rows, columns); symbolic in a model, numeric when a trajectory is verified.
        lower: bound of each column, (columns,); -inf where there is none.
        upper: bound of each column, (columns,); inf where there is none.
        columns: what each column is, for example ``joint 2``.
        scale: what makes an excess dimensionless, (columns,).
        for_all_t: True for a limit on the whole motion, of which the rows are samples; False for a single point.
        weight: how the paper's penalty measures a violation.
        transform: an increasing function of the expression and of its bounds that a nonlinear program takes instead:
            the same limit with better gradients. Of matrices (rows, columns).
        formula: what it says, in the arm's own quantities, for a reader.
    """

    name: str
    equation: str
    unit: str
    expression: Matrix
    lower: FloatArray
    upper: FloatArray
    columns: tuple[str, ...]
    scale: FloatArray
    for_all_t: bool = True
    weight: PenaltyKind = PenaltyKind.COUNT
    transform: Callable[[Matrix], Matrix] | None = None
    formula: str = ""

    def row_values(self) -> Matrix:
        """All entries as rows of a nonlinear program, dimensionless, column after column: (rows * columns, 1)."""
        if self.transform is not None:
            return ca.vec(self.transform(self.expression))
        return ca.vec(self.expression / repeated(self.scale, self.expression.shape[0]))

    def row_bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of ``row_values``, both (rows * columns,)."""
        rows = self.expression.shape[0]
        lower, upper = (self._transformed(bound) for bound in (self.lower, self.upper))
        return np.repeat(lower, rows), np.repeat(upper, rows)

    def _transformed(self, bound: FloatArray) -> FloatArray:
        if self.transform is None:
            return np.asarray(bound / self.scale)
        finite = np.isfinite(bound)
        values = as_array(self.transform(row(np.where(finite, bound, 0.0)))).ravel()
        return np.where(finite, values, bound)

    def excess(self) -> Matrix:
        """By how much each entry breaks its bounds, in the constraint's unit; 0 where it holds."""
        over: Matrix = 0.0
        rows = self.expression.shape[0]
        if np.isfinite(self.upper).any():
            over = ca.fmax(0.0, self.expression - repeated(self.upper, rows))
        if np.isfinite(self.lower).any():
            over = over + ca.fmax(0.0, repeated(self.lower, rows) - self.expression)
        return over

    def broken(self) -> Matrix:
        """H of (16)-(18): 1 where a bound is broken, else 0."""
        rows = self.expression.shape[0]
        if np.array_equal(self.lower, -self.upper):
            return ca.fabs(self.expression) > repeated(self.upper, rows)
        below = self.expression < repeated(self.lower, rows)
        above = self.expression > repeated(self.upper, rows)
        if not np.isfinite(self.upper).any():
            return below
        return above if not np.isfinite(self.lower).any() else ca.logic_or(below, above)

    def paper_penalty(self) -> Matrix:
        """h_i(x) g_i(x) of (15) or (25): jumps when a limit breaks, so an optimum never leans over it."""
        if self.weight is PenaltyKind.COUNT:
            return total(self.broken())
        return total(ca.if_else(self.broken(), ca.fabs(self.expression), 0.0))

    def graded_penalty(self) -> Matrix:
        """Sum of the dimensionless excesses: how far, not only how often, the limit is broken."""
        return total(self.excess() * repeated(1.0 / self.scale, self.expression.shape[0]))

    def smallest_violation(self) -> float:
        """The least that ``paper_penalty`` can be when any row is broken."""
        if self.weight is PenaltyKind.COUNT:
            return 1.0
        return float(min(np.abs(self.lower).min(), np.abs(self.upper).min()))


class CertificateStatus(StrEnum):
    """What is known of a constraint."""

    CERTIFIED = "certified"  # holds, proven
    VIOLATED = "violated"  # broken, at a time that is known
    UNDECIDED = "undecided"  # neither could be shown


@dataclass(frozen=True)
class Verdict:
    """How a trajectory stands to one constraint.

    Attributes:
        name: the constraint's.
        worst: the value nearest to, or farthest beyond, its bound; in ``unit``.
        bound: the bound that it is measured against.
        unit: of both.
        status: whether the bound holds, to ``TOLERANCE`` of its scale: for all t, or at the points that it is about.
        where: the column and the time in s of the worst value.
    """

    name: str
    worst: float
    bound: float
    unit: str
    status: CertificateStatus
    where: str

    @property
    def satisfied(self) -> bool:
        """Whether the bound is certain to hold."""
        return self.status is CertificateStatus.CERTIFIED

    @property
    def excess(self) -> float:
        """By how much the bound is broken, in ``unit``; 0 where it holds or nothing worse is known."""
        return abs(self.worst - self.bound) if self.status is CertificateStatus.VIOLATED else 0.0


TOLERANCE = 1e-9  # relative to the constraint's scale: rounding, nothing else


def verdict(constraint: Constraint, times: FloatArray) -> Verdict:
    """Judge a constraint whose expression is numeric, at the times (rows,) in s of its rows."""
    values = as_array(constraint.expression)
    margins = np.minimum(values - constraint.lower, constraint.upper - values) / constraint.scale
    at, column = np.unravel_index(np.argmin(margins), margins.shape)
    worst = float(values[at, column])
    lower, upper = float(constraint.lower[column]), float(constraint.upper[column])
    return Verdict(
        name=constraint.name,
        worst=worst,
        bound=lower if worst - lower < upper - worst else upper,
        unit=constraint.unit,
        status=CertificateStatus.CERTIFIED if margins[at, column] >= -TOLERANCE else CertificateStatus.VIOLATED,
        where=constraint.columns[column] + (f", t = {times[at]:.4g} s" if constraint.for_all_t else ""),
    )
