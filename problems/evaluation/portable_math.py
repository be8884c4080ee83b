"""Elementary functions that every processor rounds alike.

IEEE 754 fixes every bit of those four operations and of no angle function: each mathematical library, and each vector
version of one, rounds them its own way, and a search follows the last bit. Written out like this, a cost has one
value, on every processor and in every backend, and a compiler that works on eight candidates at once needs no library.

Absolute errors stay below 1e-15 for angles up to 1e5 rad and lengths between 1e-150 and 1e150.
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import casadi as ca

from problems.base import Matrix, Operand
from problems.evaluation.interpreter import Symbolic, rebuilt

# pi in two parts: the first has 33 bits, so that its product with an integer below 2^20 is exact (Cody and Waite)
PI_HIGH, PI_LOW = float.fromhex("0x1.921fb544p+1"), float.fromhex("0x1.0b4611a626331p-33")
LENGTH_FLOOR = 1e-300  # added to a length: the angle of a zero vector is then 0, not 0 / 0

# Convergents of the continued fractions of tan h / h and atan h / h (Gauss, Lambert), as polynomials in h^2, lowest
# power first: relative error 9e-19 for |h| <= pi / 4 and 2e-17 for |h| <= tan(pi / 8).
TAN = (
    (34459425.0, -4729725.0, 135135.0, -990.0, 1.0),
    (34459425.0, -16216200.0, 945945.0, -13860.0, 45.0),
)
ATAN = (
    (316234143225.0, 802043116875.0, 733034672370.0, 289831331790.0, 46107386325.0, 2015310375.0),
    (316234143225.0, 907454497950.0, 972272676375.0, 477607630500.0, 105354624375.0, 8428369950.0, 108056025.0),
)


def portable(function: ca.Function) -> ca.Function:
    """The same function with its angles written out.

    Args:
        function: SX function of dense columns.

    Raises:
        UnsupportedOperation: it holds an operation that :mod:`problems.evaluation.interpreter` does not know.
    """
    return rebuilt(function, Portable())


class Portable(Symbolic):
    """Symbols in which angles are written out."""

    def __init__(self) -> None:
        x, y = ca.SX.sym("x"), ca.SX.sym("y")
        angle_of = ca.Function("angle", [y, x], [angle(y, x)])
        self._sine_cosine_of = ca.Function("sine_cosine", [x], sine_cosine(x))
        self._known: dict[int, tuple[ca.SX, ca.SX, ca.SX]] = {}
        self._unary: dict[str, Callable[[ca.SX], ca.SX]] = {
            "sin": lambda a: self._sine_cosine(a)[0],
            "cos": lambda a: self._sine_cosine(a)[1],
            "tan": lambda a: self._sine_cosine(a)[0] / self._sine_cosine(a)[1],
            "atan": lambda a: angle_of(a, 1.0),
            "asin": lambda a: angle_of(a, _other_leg(a)),
            "acos": lambda a: angle_of(_other_leg(a), a),
        }
        self._binary: dict[str, Callable[[ca.SX, ca.SX], ca.SX]] = {"atan2": angle_of}

    def unary(self, name: str, a: ca.SX) -> ca.SX:
        """One operation; functions of and to angles become arithmetic."""
        return self._unary[name](a) if name in self._unary else super().unary(name, a)

    def binary(self, name: str, a: ca.SX, b: ca.SX) -> ca.SX:
        """One operation; the angle of a vector becomes arithmetic."""
        if name in ("fmin", "fmax") and a.is_constant():
            a, b = b, a  # the same number, and one instruction on processors that take the second where they are equal
        return self._binary[name](a, b) if name in self._binary else super().binary(name, a, b)

    def _sine_cosine(self, a: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Both at once, and once for each angle (kept with its pair: a hash may be reused after its owner)."""
        key = a.element_hash()
        if key not in self._known:
            self._known[key] = (*self._sine_cosine_of(a), a)
        return self._known[key][:2]


def sine_cosine(x: Matrix) -> tuple[Matrix, Matrix]:
    """Sine and cosine of x in rad.

    With n half turns taken off, h = (x - n pi) / 2 lies within pi / 4; from tan h = N / D,
    sin 2h = 2 N D / (D^2 + N^2) and cos 2h = (D^2 - N^2) / (D^2 + N^2), both times (-1)^n.
    """
    n = ca.floor(x * (1.0 / pi) + 0.5)
    h = ((x - n * PI_HIGH) - n * PI_LOW) * 0.5
    z = h * h
    top, bottom = h * _polynomial(TAN[0], z), _polynomial(TAN[1], z)
    top_squared, bottom_squared = top * top, bottom * bottom
    odd = n - 2.0 * ca.floor(0.5 * n)
    scale = (1.0 - 2.0 * odd) / (bottom_squared + top_squared)
    return 2.0 * (top * bottom) * scale, (bottom_squared - top_squared) * scale


def angle(y: Matrix, x: Matrix) -> Matrix:
    """Angle in rad, within [-pi, pi], of the vector (x, y); 0 for (0, 0).

    Within the first octant the half angle has the tangent h = min / (max + r), at most tan(pi / 8).
    """
    r = ca.sqrt(x * x + y * y)
    wide, high = ca.fabs(x), ca.fabs(y)
    h = ca.fmin(wide, high) / (ca.fmax(wide, high) + r + LENGTH_FLOOR)
    z = h * h
    octant = 2.0 * h * (_polynomial(ATAN[0], z) / _polynomial(ATAN[1], z))
    quadrant = octant + (high > wide) * (pi / 2 - 2.0 * octant)
    return ca.copysign(quadrant + (x < 0.0) * (pi - 2.0 * quadrant), y)


def _other_leg(a: ca.SX) -> ca.SX:
    """The other leg of a right triangle with hypotenuse 1; NaN where |a| > 1."""
    return ca.sqrt((1.0 - a) * (1.0 + a))


def _polynomial(coefficients: tuple[float, ...], z: Matrix) -> Operand:
    value: Operand = coefficients[-1]
    for coefficient in coefficients[-2::-1]:
        value = value * z + coefficient
    return value
