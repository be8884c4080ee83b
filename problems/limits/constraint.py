"""One named constraint, the single source of the penalty, the nonlinear program and the audit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, Operand, as_array, total


class PenaltyKind(Enum):
    """The summand of g_i(x) in (15) and (25) where h_i(x) says that a limit is broken."""

    MAGNITUDE = "sum of absolute values"  # (16), (17): speeds and accelerations
    COUNT = "number of broken rows"  # (18): lapped points


@dataclass(frozen=True, kw_only=True)
class Constraint:
    """``lower <= expression <= upper``, one row a time sample, one column a joint, link or obstacle.

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
        """The amount by which each entry breaks its bounds, in the constraint's unit; 0 where it holds."""
        over: Operand = 0.0
        if self.upper is not None:
            over = ca.fmax(0.0, self.expression - self._repeated(self.upper))
        if self.lower is not None:
            over = over + ca.fmax(0.0, self._repeated(self.lower) - self.expression)
        return over

    def broken(self) -> Matrix:
        """H of (16)-(18): 1 where a bound is broken, else 0."""
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
    def room(self) -> float:
        """Of numeric values: how far the nearest is from its bounds, dimensionless; negative where one is broken."""
        values = as_array(self.expression)
        lower, upper = self.bounds
        return float(np.min(np.minimum(values - lower, upper - values) / self.scales))

    def paper_penalty(self) -> Matrix:
        """h_i(x) g_i(x) of (15) or (25): discontinuous at the limit, so an optimum never exceeds it slightly."""
        if self.penalty is PenaltyKind.COUNT:
            return total(self.broken())
        return total(ca.if_else(self.broken(), ca.fabs(self.expression), 0.0))

    def graded_penalty(self) -> Matrix:
        """Sum of the dimensionless excesses: how far, not only how often, the limit is broken."""
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
