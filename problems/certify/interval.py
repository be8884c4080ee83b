"""Interval arithmetic over expressions, and limits proven by it over cells of time.

Works through the function's own list of instructions. The bounds hold up to rounding, and are wider than need be where
a variable occurs more than once.

In a cell of time every joint angle and derivative lies between its Bernstein coefficients. Interval arithmetic bounds
what the limit makes of them; cells that this does not settle are halved. It works for any expression, and is as sharp
as its intervals: a limit that holds with a margin is soon proven, one that is touched stays undecided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import comb, pi

import casadi as ca
import numpy as np

from problems.base import FloatArray, bernstein
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, verdict
from problems.limits import Constraint, Limit
from problems.motions import SAMPLED_ORDERS, Samples, Trajectory

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


FIRST_TIMES = 401  # times at which a violation is looked for first
MAX_CELLS = 4000


def prove_by_cells(limit: Limit, trajectory: Trajectory) -> list[Verdict]:
    """Verdicts on a limit: violated where a sample breaks it, certified where interval arithmetic settles all cells.

    The verdict is about every time, so that constraints on steps from one sample to the next are left out.
    """
    times = trajectory.times(FIRST_TIMES)
    sampled = limit.constraints_at(trajectory.samples(times, limit.robot_or_none))
    symbolic = [_expression(limit, trajectory, index) for index in range(len(sampled))]
    return [
        _settled(verdict(constraint, times), expression, constraint, trajectory)
        for constraint, expression in zip(sampled, symbolic, strict=True)
    ]


def _expression(limit: Limit, trajectory: Trajectory, index: int) -> ca.Function:
    """One row of a constraint as a function of angles and derivatives, one after the other, and of the time."""
    k = trajectory.coefficients.shape[2]
    symbols, time = ca.SX.sym("derivatives", k * SAMPLED_ORDERS), ca.SX.sym("time")
    derivatives = tuple(part.T for part in ca.vertsplit(symbols, k))
    duration = ca.SX(trajectory.duration)
    now = Samples(robot=limit.robot_or_none, derivatives=derivatives, duration=duration, times=time)
    return ca.Function(
        "row", [ca.vertcat(symbols, time)], [ca.densify(limit.constraints_at(now)[index].expression.T)], {"cse": True}
    )


def _settled(outcome: Verdict, expression: ca.Function, constraint: Constraint, trajectory: Trajectory) -> Verdict:
    """A verdict at samples, raised to all t or lowered to undecided."""
    if not outcome.satisfied:
        return outcome
    if constraint.rows != len(trajectory.times(FIRST_TIMES)):  # it is not about one time after the other
        return replace(outcome, status=CertificateStatus.UNDECIDED)
    (low, high), slack = constraint.bounds, TOLERANCE * constraint.scales
    cells = [(piece, 0.0, 1.0) for piece in range(trajectory.breakpoints.size - 1)]
    curves = [_curves(trajectory, order) for order in range(SAMPLED_ORDERS)]
    for count in range(MAX_CELLS):
        if not cells:
            return outcome
        piece, start, end = cells.pop()
        ranges = [_range(curve[:, piece], start, end) for curve in curves]
        ranges.append(_curve_ranges(trajectory, piece, start, end))
        lower, upper = bounds(expression, *(np.concatenate(side) for side in zip(*ranges, strict=True)))
        if count + len(cells) > MAX_CELLS:
            break
        if (lower < low - slack).any() or (upper > high + slack).any():
            middle = (start + end) / 2.0
            cells += [(piece, start, middle), (piece, middle, end)]
    return replace(outcome, status=CertificateStatus.UNDECIDED)


def _curve_ranges(trajectory: Trajectory, piece: int, start: float, end: float) -> tuple[FloatArray, FloatArray]:
    """The times in s of a part of a piece, both (1,)."""
    first, last = trajectory.breakpoints[piece : piece + 2]
    return np.array([first + start * (last - first)]), np.array([first + end * (last - first)])


def _curves(trajectory: Trajectory, order: int) -> FloatArray:
    """Bernstein coefficients of a derivative, (n + 1, pieces, k)."""
    return bernstein(np.asarray(trajectory.derivative(order).c), np.diff(trajectory.breakpoints))


def _range(curve: FloatArray, start: float, end: float) -> tuple[FloatArray, FloatArray]:
    """Bounds over a part of a piece, (k,): Bernstein coefficients (n + 1, k) of that part alone."""
    part = _left(_left(curve[::-1], 1.0 - start)[::-1], (end - start) / (1.0 - start)) if start < 1.0 else curve[-1:]
    return part.min(axis=0), part.max(axis=0)


def _left(curve: FloatArray, share: float) -> FloatArray:
    """Bernstein coefficients of the first ``share`` of an interval (de Casteljau)."""
    n = len(curve) - 1
    matrix = [
        [comb(i, j) * share**j * (1.0 - share) ** (i - j) if j <= i else 0.0 for j in range(n + 1)]
        for i in range(n + 1)
    ]
    return np.asarray(np.array(matrix) @ curve)
