"""Interval arithmetic over many boxes at once: what an expression can be in each of them.

Bounds hold up to rounding. An operation that is not in the tables, or an argument outside a domain, can be anything.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from problems.base.matrix import FloatArray

Range: TypeAlias = tuple[FloatArray, FloatArray]  # lower and upper bounds in n boxes, both (n,)

CONTINUOUS = {  # where an expression holds nothing else, the mean value theorem is true of it
    *("neg", "sq", "twice", "inv", "sqrt", "fabs", "sin", "cos", "tan", "asin", "acos", "atan", "exp", "log"),
    *("sinh", "cosh", "tanh", "asinh", "erf", "log1p", "expm1", "add", "sub", "mul", "div", "fmin", "fmax", "pow"),
    "hypot",
}


class Ranges:
    """Interpreter of expressions in intervals.

    Args:
        count: of boxes.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self.operations: set[str] = set()

    def constant(self, value: float) -> Range:
        """The same in all boxes."""
        number = np.full(self._count, value)
        return number, number

    def unary(self, name: str, a: Range) -> Range:
        """One operation."""
        self.operations.add(name)
        return self._certain(UNARY[name](*a) if name in UNARY else self._anything)

    def binary(self, name: str, a: Range, b: Range) -> Range:
        """One operation."""
        self.operations.add(name)
        return self._certain(BINARY[name](a, b) if name in BINARY else self._anything)

    @property
    def _anything(self) -> Range:
        return self.constant(-np.inf)[0], self.constant(np.inf)[0]

    def _certain(self, found: Range) -> Range:
        """With nothing known where it is no number."""
        low, high = found
        return np.where(np.isnan(low), -np.inf, low), np.where(np.isnan(high), np.inf, high)


def _within(low: FloatArray, high: FloatArray, domain: tuple[float, float], found: Range) -> Range:
    """What was found where an argument is within a domain; anything elsewhere."""
    inside = (low >= domain[0]) & (high <= domain[1])
    return np.where(inside, found[0], -np.inf), np.where(inside, found[1], np.inf)


def _rising(
    function: Callable[[FloatArray], FloatArray], lowest: float = -np.inf, highest: float = np.inf
) -> Callable[[FloatArray, FloatArray], Range]:
    """A function that rises over its domain."""
    return lambda low, high: _within(low, high, (lowest, highest), (function(low), function(high)))


def _falling(
    function: Callable[[FloatArray], FloatArray], lowest: float, highest: float
) -> Callable[[FloatArray, FloatArray], Range]:
    return lambda low, high: _within(low, high, (lowest, highest), (function(high), function(low)))


def _even(function: Callable[[FloatArray], FloatArray]) -> Callable[[FloatArray, FloatArray], Range]:
    """A function that rises on both sides of 0."""

    def of(low: FloatArray, high: FloatArray) -> Range:
        least = np.where((low <= 0.0) & (high >= 0.0), 0.0, np.minimum(np.abs(low), np.abs(high)))
        return function(least), function(np.maximum(np.abs(low), np.abs(high)))

    return of


def _cosine(low: FloatArray, high: FloatArray) -> Range:
    ends = np.cos(low), np.cos(high)
    has_top = np.floor(high / (2.0 * pi)) >= np.ceil(low / (2.0 * pi))
    has_bottom = np.floor(high / (2.0 * pi) - 0.5) >= np.ceil(low / (2.0 * pi) - 0.5)
    return np.where(has_bottom, -1.0, np.minimum(*ends)), np.where(has_top, 1.0, np.maximum(*ends))


def _tangent(low: FloatArray, high: FloatArray) -> Range:
    same_branch = np.floor(low / pi + 0.5) == np.floor(high / pi + 0.5)
    return np.where(same_branch, np.tan(low), -np.inf), np.where(same_branch, np.tan(high), np.inf)


def _inverse(low: FloatArray, high: FloatArray) -> Range:
    crosses = (low <= 0.0) & (high >= 0.0)
    return np.where(crosses, -np.inf, 1.0 / high), np.where(crosses, np.inf, 1.0 / low)


def _product(a: Range, b: Range) -> Range:
    corners = [np.where((x == 0.0) | (y == 0.0), 0.0, x * y) for x in a for y in b]
    return np.minimum.reduce(corners), np.maximum.reduce(corners)


def _minus(a: Range, b: Range) -> Range:
    return a[0] - b[1], a[1] - b[0]


def _power(a: Range, b: Range) -> Range:
    """With a positive base; or a whole, positive exponent."""
    exponent = b[0][0] if b[0].size and (b[0] == b[1]).all() and (b[0] == b[0][0]).all() else np.nan
    if exponent > 0.0 and exponent == np.floor(exponent):
        return _even(lambda x: x**exponent)(*a) if exponent % 2 == 0.0 else (a[0] ** exponent, a[1] ** exponent)
    logarithm = _within(*a, (0.0, np.inf), (np.log(a[0]), np.log(a[1])))
    low, high = _product(logarithm, b)
    return np.where(a[0] >= 0.0, np.exp(low), -np.inf), np.where(a[0] >= 0.0, np.exp(high), np.inf)


def _angle(y: Range, x: Range) -> Range:
    """atan2: sharp to the right of 0, anything within a turn elsewhere."""
    right = x[0] > 0.0
    low, high = _product(y, _inverse(*x))
    return np.where(right, np.arctan(low), -pi), np.where(right, np.arctan(high), pi)


def _hypotenuse(a: Range, b: Range) -> Range:
    one, other = _even(np.abs)(*a), _even(np.abs)(*b)
    return np.hypot(one[0], other[0]), np.hypot(one[1], other[1])


def _truth(certain: NDArray[np.bool_], possible: NDArray[np.bool_]) -> Range:
    return np.where(certain, 1.0, 0.0), np.where(possible, 1.0, 0.0)


def _both(a: Range, b: Range) -> Range:
    """Of truth values, of which anything but 0 is true."""
    return _truth(_surely(a) & _surely(b), _maybe(a) & _maybe(b))


def _either(a: Range, b: Range) -> Range:
    return _truth(_surely(a) | _surely(b), _maybe(a) | _maybe(b))


def _surely(a: Range) -> NDArray[np.bool_]:
    return np.asarray((a[0] > 0.0) | (a[1] < 0.0))


def _maybe(a: Range) -> NDArray[np.bool_]:
    return np.asarray((a[0] != 0.0) | (a[1] != 0.0))


def _if(a: Range, b: Range) -> Range:
    """B where a is true, else 0."""
    low, high = np.minimum(b[0], 0.0), np.maximum(b[1], 0.0)
    return (
        np.where(_surely(a), b[0], np.where(_maybe(a), low, 0.0)),
        np.where(_surely(a), b[1], np.where(_maybe(a), high, 0.0)),
    )


UNARY: dict[str, Callable[[FloatArray, FloatArray], Range]] = {
    "neg": lambda low, high: (-high, -low),
    "sq": _even(np.square),
    "twice": lambda low, high: (2.0 * low, 2.0 * high),
    "inv": _inverse,
    "sqrt": _rising(np.sqrt, lowest=0.0),
    "fabs": _even(np.abs),
    "sign": _rising(np.sign),
    "floor": _rising(np.floor),
    "ceil": _rising(np.ceil),
    "not": lambda low, high: _truth(~_maybe((low, high)), ~_surely((low, high))),
    "sin": lambda low, high: _cosine(low - pi / 2.0, high - pi / 2.0),
    "cos": _cosine,
    "tan": _tangent,
    "asin": _rising(np.arcsin, -1.0, 1.0),
    "acos": _falling(np.arccos, -1.0, 1.0),
    "atan": _rising(np.arctan),
    "exp": _rising(np.exp),
    "log": _rising(np.log, lowest=0.0),
    "sinh": _rising(np.sinh),
    "cosh": _even(np.cosh),
    "tanh": _rising(np.tanh),
    "asinh": _rising(np.arcsinh),
    "log1p": _rising(np.log1p, lowest=-1.0),
    "expm1": _rising(np.expm1),
}
BINARY: dict[str, Callable[[Range, Range], Range]] = {
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "sub": _minus,
    "mul": _product,
    "div": lambda a, b: _product(a, _inverse(*b)),
    "fmin": lambda a, b: (np.minimum(a[0], b[0]), np.minimum(a[1], b[1])),
    "fmax": lambda a, b: (np.maximum(a[0], b[0]), np.maximum(a[1], b[1])),
    "pow": _power,
    "atan2": _angle,
    "hypot": _hypotenuse,
    "lt": lambda a, b: _truth(a[1] < b[0], a[0] < b[1]),
    "le": lambda a, b: _truth(a[1] <= b[0], a[0] <= b[1]),
    "eq": lambda a, b: _truth((a[0] == a[1]) & (b[0] == b[1]) & (a[0] == b[0]), (a[0] <= b[1]) & (b[0] <= a[1])),
    "ne": lambda a, b: _truth((a[1] < b[0]) | (b[1] < a[0]), ~((a[0] == a[1]) & (b[0] == b[1]) & (a[0] == b[0]))),
    "and": _both,
    "or": _either,
    "if_else_zero": _if,
}  # fmt: skip
