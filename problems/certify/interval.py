"""Interval arithmetic over a CasADi function: bounds of its outputs for all inputs in a box.

Works through the function's own list of instructions. The bounds hold up to rounding, and are wider than need be where
a variable occurs more than once.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray

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
    squares = a[0] * a[0], a[1] * a[1]  # infinite where a power would raise OverflowError
    return (0.0 if a[0] <= 0.0 <= a[1] else min(squares)), max(squares)


def _power(a: Interval, b: Interval) -> Interval:
    if b[0] == b[1] and b[0] == int(b[0]) and b[0] > 0:
        low, high = (float(np.power(np.float64(value), b[0])) for value in a)
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
