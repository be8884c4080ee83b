"""The structure of a program: sparsity, degrees, kinks, redundant rows, freedom, and rows that no point can break.

The bounds of rows in a box come from interval arithmetic. They hold up to rounding, and are wider than need be where a
variable occurs more than once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix
from problems.certify.cells import BINARY, UNARY, Range, Ranges
from problems.evaluation import interpret
from problems.limits import Constraint

KINKS = {
    ca.OP_FABS: "abs",
    ca.OP_FMIN: "min",
    ca.OP_FMAX: "max",
    ca.OP_LT: "<",
    ca.OP_LE: "<=",
    ca.OP_EQ: "==",
    ca.OP_NE: "!=",
    ca.OP_SIGN: "sign",
    ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil",
    ca.OP_IF_ELSE_ZERO: "if",
}  # not differentiable somewhere
PROBE_POINTS = 3  # random points at which rows are compared
SAME_ROW_TOLERANCE = 1e-12  # relative; rows that differ by less at every probe point are the same


@dataclass(frozen=True)
class Structure:
    """The structure of one constraint.

    Attributes:
        name: the constraint's.
        equation: where the paper states it.
        unit: of its expression.
        formula: how it is built from the arm's quantities.
        for_all_t: a limit on the whole motion, of which the rows are samples; else a single condition.
        rows: how many scalar rows.
        equality: whether its bounds are the same.
        depends_on: names of the variables in it.
        degree: ``constant``, ``linear``, ``quadratic`` or ``nonlinear`` in them.
        nonzeros: of its Jacobian, rows x variables.
        kinks: how often each operation occurs that is not differentiable everywhere.
        constant_rows: rows without any variable.
        duplicate_rows: redundant rows, equal to another row of the constraint.
        never_met: rows whose bounds no point of the box can meet, by interval arithmetic.
        always_met: rows that every point of the box meets, by interval arithmetic.
    """

    name: str
    equation: str
    unit: str
    formula: str
    for_all_t: bool
    rows: int
    equality: bool
    depends_on: tuple[str, ...]
    degree: str
    nonzeros: int
    kinks: dict[str, int]
    constant_rows: int
    duplicate_rows: int
    never_met: int
    always_met: int


def structure_of(
    constraint: Constraint, x: ca.SX, names: Sequence[str], lower: FloatArray, upper: FloatArray
) -> Structure:
    """The structure of a constraint in a box of the variables.

    Args:
        constraint: whose expression is symbolic.
        x: the variables, (n, 1).
        names: of the variables, n.
        lower: bounds of the variables, (n,), -inf where there is none.
        upper: bounds of the variables, (n,), inf where there is none.
    """
    rows = ca.densify(ca.vec(constraint.expression))
    jacobian = jacobian_pattern(constraint, x)
    function = ca.Function("rows", [x], [rows], {"cse": True})
    low, high = (np.repeat(bound, constraint.rows) for bound in constraint.bounds)
    least, most = bounds(function, lower, upper)
    kinks = kinks_of(function)
    return Structure(
        constraint.name,
        constraint.equation,
        constraint.unit,
        constraint.formula,
        constraint.for_all_t,
        rows.shape[0],
        bool((low == high).all()),
        tuple(name for name, used in zip(names, np.any(jacobian, axis=0).tolist(), strict=True) if used),
        "nonlinear" if kinks else degree_of(rows, x),
        int(jacobian.sum()),
        kinks,
        int(np.sum(~np.any(jacobian, axis=1))),
        duplicates_of(function, lower, upper, low, high),
        int(((least > high) | (most < low)).sum()),
        int(((least >= low) & (most <= high)).sum()),
    )


def jacobian_pattern(constraint: Constraint, x: ca.SX) -> NDArray[np.bool_]:
    """Mask of the entries in which the Jacobian of a constraint's rows can differ from zero, (rows, n)."""
    pattern = ca.jacobian_sparsity(ca.densify(ca.vec(constraint.expression)), x)
    return np.asarray(ca.DM(pattern, 1.0).full(), dtype=bool)


def degree_of(rows: Matrix, x: ca.SX) -> str:
    """The degree of smooth rows in the variables."""
    if not any(ca.which_depends(rows, x, 1, False)):
        return "constant"
    if not any(ca.which_depends(rows, x, 2, False)):
        return "linear"
    slopes = ca.jacobian(rows, x)
    return "nonlinear" if any(ca.which_depends(ca.vec(slopes), x, 2, False)) else "quadratic"


def kinks_of(function: ca.Function) -> dict[str, int]:
    """How often each non-smooth operation occurs in a function."""
    counts = Counter(function.instruction_id(k) for k in range(function.n_instructions()))
    return {name: counts[code] for code, name in KINKS.items() if counts[code]}


def duplicates_of(
    function: ca.Function, lower: FloatArray, upper: FloatArray, low: FloatArray, high: FloatArray
) -> int:
    """How many rows, with their bounds, repeat another: the same values at a few random points of the box."""
    rng = np.random.default_rng(0)
    box = np.clip(lower, -3.0, 3.0), np.clip(upper, -3.0, 3.0)
    values = [np.asarray(function(rng.uniform(*box))).ravel() for _ in range(PROBE_POINTS)]
    scale = np.maximum(1.0, np.abs(np.array(values)).max(axis=1, keepdims=True))
    fingerprints = np.round(np.array(values) / scale / SAME_ROW_TOLERANCE).T
    return int(low.size - len(np.unique(np.column_stack([fingerprints, low, high]), axis=0)))


def freedom(constraints: Sequence[Constraint], x: ca.SX) -> int:
    """Degrees of freedom that the equalities leave: variables less the structural rank of their Jacobian."""
    equalities = [ca.densify(ca.vec(c.expression)) for c in constraints if np.array_equal(*c.bounds)]
    if not equalities:
        return int(x.shape[0])
    return int(x.shape[0] - ca.sprank(ca.jacobian(ca.vertcat(*equalities), x)))


class _Bounds(Ranges):
    """Interval arithmetic in one box that may be unbounded, without room for rounding."""

    def unary(self, name: str, a: Range) -> Range:
        return _known(UNARY[name](*a) if name in UNARY else self._undefined)

    def binary(self, name: str, a: Range, b: Range) -> Range:
        if name == "div":
            name, b = "mul", _known(UNARY["inv"](*b))
        if name == "mul":
            corners = [np.where((x == 0.0) | (y == 0.0), 0.0, x * y) for x in a for y in b]
            return np.minimum.reduce(corners), np.maximum.reduce(corners)
        return _known(BINARY[name](a, b) if name in BINARY else self._undefined)


def _known(computed: Range) -> Range:
    """The range, infinite where a bound is not a number."""
    low, high = computed
    return np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)


def bounds(function: ca.Function, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of the dense first output of an SX function of one vector, both (outputs,).

    Args:
        function: of one input (n,).
        lower: of the input, (n,); -inf where there is none.
        upper: of the input, (n,); inf where there is none.
    """
    box = list(zip(lower[:, None], upper[:, None], strict=True))
    with np.errstate(all="ignore"):
        ranges = interpret(function, [box], _Bounds(1))[0]
    least, most = (np.array([float(range_[side][0]) for range_ in ranges]) for side in (0, 1))
    return least, most
