"""The structure of a program: sparsity, degrees, kinks, duplicates, freedom; what no point of a box can break.

The bounds of rows in a box come from interval arithmetic over a function's own list of instructions. They hold up to
rounding, and are wider than need be where a variable occurs more than once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, Matrix
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
        duplicate_rows: rows that say what another row of the same constraint says.
        never_met: rows whose bounds no point of the box can meet, by interval arithmetic.
        always_met: rows that every point of the box meets, likewise.
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
    """Analyse a constraint.

    Args:
        constraint: whose expression is symbolic.
        x: the variables, (n, 1).
        names: of the variables, n.
        lower: bounds of the variables, (n,), -inf where there is none.
        upper: likewise.
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
    """Where the Jacobian of a constraint's rows can differ from zero: (rows, n), bool."""
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


Interval = tuple[float, float]
UNBOUNDED: Interval = (-np.inf, np.inf)
TRUE_OR_FALSE: Interval = (0.0, 1.0)


def bounds(function: ca.Function, lower: FloatArray, upper: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of the dense first output of an SX function of one vector, both (outputs,).

    Args:
        function: of one input (n,).
        lower: of the input, (n,); -inf where there is none.
        upper: likewise.
    """
    work: dict[int, Interval] = {}
    ranges = np.zeros((2, function.nnz_out(0)))
    with np.errstate(all="ignore"):
        for k in range(function.n_instructions()):
            code, inputs, outputs = (
                function.instruction_id(k),
                function.instruction_input(k),
                function.instruction_output(k),
            )
            if code == ca.OP_OUTPUT:
                ranges[:, outputs[1]] = work[inputs[0]]
            elif code == ca.OP_INPUT:
                work[outputs[0]] = float(lower[inputs[1]]), float(upper[inputs[1]])
            elif code == ca.OP_CONST:
                value = float(function.instruction_constant(k))
                work[outputs[0]] = value, value
            else:
                operation = OPERATIONS.get(code, _unknown)
                low, high = operation(*(work[i] for i in inputs))
                work[outputs[0]] = (-np.inf if np.isnan(low) else low), (np.inf if np.isnan(high) else high)
    return ranges[0], ranges[1]


def _unknown(*_: Interval) -> Interval:
    return UNBOUNDED


def _times(a: Interval, b: Interval) -> Interval:
    products = [0.0 if 0.0 in (x, y) else x * y for x in a for y in b]
    return min(products), max(products)


def _inverse(a: Interval) -> Interval:
    if a[0] <= 0.0 <= a[1]:
        return UNBOUNDED
    return 1.0 / a[1], 1.0 / a[0]


def _square(a: Interval) -> Interval:
    squares = a[0] * a[0], a[1] * a[1]  # which are infinite where a power would overflow
    return (0.0 if a[0] <= 0.0 <= a[1] else min(squares)), max(squares)


def _power(a: Interval, b: Interval) -> Interval:
    if b[0] == b[1] and b[0] == int(b[0]) and b[0] > 0:
        low, high = (float(np.float64(end) ** b[0]) for end in a)
        if int(b[0]) % 2:
            return low, high
        return (0.0 if a[0] <= 0.0 <= a[1] else min(low, high)), max(low, high)
    return UNBOUNDED


def _cosine(a: Interval) -> Interval:
    if not a[1] - a[0] < 2.0 * pi:
        return -1.0, 1.0
    values = [np.cos(a[0]), np.cos(a[1])]
    values += [np.cos(n * pi) for n in range(int(np.ceil(a[0] / pi)), int(np.floor(a[1] / pi)) + 1)]
    return float(min(values)), float(max(values))


def _sine(a: Interval) -> Interval:
    return _cosine((a[0] - pi / 2.0, a[1] - pi / 2.0))


def _increasing(
    function: Callable[[float], float], low: float = -np.inf, high: float = np.inf
) -> Callable[[Interval], Interval]:
    """A function that rises over its domain [low, high]; nothing is known of it outside."""

    def of(a: Interval) -> Interval:
        return (float(function(a[0])), float(function(a[1]))) if low <= a[0] and a[1] <= high else UNBOUNDED

    return of


def _arccos(a: Interval) -> Interval:
    return (float(np.arccos(a[1])), float(np.arccos(a[0]))) if a[0] >= -1.0 and a[1] <= 1.0 else UNBOUNDED


def _absolute(a: Interval) -> Interval:
    low = 0.0 if a[0] <= 0.0 <= a[1] else min(abs(a[0]), abs(a[1]))
    return low, max(abs(a[0]), abs(a[1]))


def _less(a: Interval, b: Interval) -> Interval:
    if a[1] < b[0]:
        return 1.0, 1.0
    return (0.0, 0.0) if a[0] > b[1] else TRUE_OR_FALSE


OPERATIONS: dict[int, Callable[..., Interval]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_ADD: lambda a, b: (a[0] + b[0], a[1] + b[1]),
    ca.OP_SUB: lambda a, b: (a[0] - b[1], a[1] - b[0]),
    ca.OP_MUL: _times,
    ca.OP_DIV: lambda a, b: _times(a, _inverse(b)),
    ca.OP_NEG: lambda a: (-a[1], -a[0]),
    ca.OP_INV: _inverse,
    ca.OP_SQ: _square,
    ca.OP_TWICE: lambda a: (2.0 * a[0], 2.0 * a[1]),
    ca.OP_POW: _power,
    ca.OP_CONSTPOW: _power,
    ca.OP_SQRT: _increasing(np.sqrt, low=0.0),
    ca.OP_EXP: _increasing(np.exp),
    ca.OP_LOG: _increasing(np.log, low=0.0),
    ca.OP_SIN: _sine,
    ca.OP_COS: _cosine,
    ca.OP_ACOS: _arccos,
    ca.OP_ASIN: _increasing(np.arcsin, -1.0, 1.0),
    ca.OP_ATAN: _increasing(np.arctan),
    ca.OP_ATAN2: lambda a, b: (-pi, pi),
    ca.OP_FABS: _absolute,
    ca.OP_FMIN: lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
    ca.OP_FMAX: lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    ca.OP_CEIL: _increasing(np.ceil),
    ca.OP_FLOOR: _increasing(np.floor),
    ca.OP_SIGN: _increasing(np.sign),
    ca.OP_LT: _less,
    ca.OP_LE: _less,
    ca.OP_NOT: lambda a: (1.0 - a[1], 1.0 - a[0]),
    ca.OP_AND: lambda a, b: (min(a[0], b[0]), min(a[1], b[1])),
    ca.OP_OR: lambda a, b: (max(a[0], b[0]), max(a[1], b[1])),
    ca.OP_IF_ELSE_ZERO: lambda condition, value: (
        value
        if condition == (1.0, 1.0)
        else (0.0, 0.0)
        if condition == (0.0, 0.0)
        else (min(0.0, value[0]), max(0.0, value[1]))
    ),
}
