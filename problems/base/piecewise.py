"""Piecewise polynomials and B-splines as arrays, evaluated as SciPy does, to the bit, without loading it.

SciPy's module of interpolation loads a third of the library; a plan needs the values of a few polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import perm

import numpy as np
from numpy.typing import ArrayLike, NDArray

from problems.base.matrix import FloatArray

CLOSED_FORM = 2  # degree up to which roots need no eigenvalues


@dataclass(frozen=True, eq=False, repr=False)
class PiecewisePolynomial:
    """A curve of any values, polynomial between breakpoints.

    Attributes:
        c: (n, p, ...), highest power first, each of the p pieces in its own parameter from 0.
        x: p + 1 increasing breakpoints. The first and the last piece go on beyond them.
    """

    c: FloatArray
    x: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "c", np.ascontiguousarray(self.c, dtype=np.float64))
        object.__setattr__(self, "x", np.ascontiguousarray(self.x, dtype=np.float64))
        if self.c.ndim < 2 or self.x.shape != (self.c.shape[1] + 1,):
            raise ValueError(f"breakpoints of shape {self.x.shape} for coefficients of shape {self.c.shape}")

    def __call__(self, at: ArrayLike, derivative: int = 0) -> FloatArray:
        """Values or derivatives at parameters of any shape s: (*s, ...)."""
        places = np.asarray(at, dtype=np.float64)
        flat = places.ravel()
        piece = np.clip(np.searchsorted(self.x, flat, side="right") - 1, 0, self.x.size - 2)
        into = (flat - self.x[piece]).reshape(-1, *[1] * (self.c.ndim - 2))
        value, power = np.zeros((flat.size, *self.c.shape[2:])), np.ones_like(into)
        for number in range(derivative, len(self.c)):
            value = value + self.c[-1 - number, piece] * power * float(perm(number, derivative))
            power = power * into
        return value.reshape(*places.shape, *self.c.shape[2:])

    def derivative(self, order: int = 1) -> PiecewisePolynomial:
        """That of an order, as a curve."""
        if order >= len(self.c):
            return PiecewisePolynomial(np.zeros((1, *self.c.shape[1:])), self.x)
        left = len(self.c) - order
        factors = np.array([perm(power, order) for power in range(len(self.c) - 1, order - 1, -1)], dtype=np.float64)
        return PiecewisePolynomial(self.c[:left] * factors.reshape(-1, *[1] * (self.c.ndim - 1)), self.x)


def real_roots(coefficients: FloatArray, low: float, high: float) -> FloatArray:
    """Roots of one polynomial between two parameters, (m,); none of one that is zero everywhere.

    Args:
        coefficients: (n,), highest power first, of x - low.
        low: the parameter from which it counts, and the least that a root may be.
        high: the largest.
    """
    powers = np.trim_zeros(coefficients, "f")
    roots = _inner_roots(powers)
    slopes = powers[:-1] * np.arange(len(powers) - 1.0, 0.0, -1.0)
    polished = np.array([_newton(powers, slopes, root) for root in roots.tolist()]) + low
    return polished[(polished >= low) & (polished <= high)]


def _inner_roots(powers: FloatArray) -> FloatArray:
    """Real roots of a polynomial whose first coefficient is not zero."""
    degree = len(powers) - 1
    if degree < 1:
        return np.empty(0)
    if degree == 1:
        return -powers[1:] / powers[:1]
    if degree == CLOSED_FORM:
        return _quadratic_roots(*powers.tolist())
    companion = np.diag(np.ones(degree - 1), -1)
    companion[:, -1] = -powers[:0:-1] / powers[0]
    roots = np.linalg.eigvals(companion)
    return np.asarray(np.sort(roots.real[roots.imag == 0.0]))


def _quadratic_roots(a: float, b: float, c: float) -> FloatArray:
    """Both roots without cancellation, none where they are not real."""
    under = b * b - 4.0 * a * c
    if under < 0.0:
        return np.empty(0)
    root = float(np.sqrt(under))
    if root == 0.0:
        return np.array([-b / (2.0 * a)])
    if b < 0.0:
        return np.array([2.0 * c / (-b + root), (-b + root) / (2.0 * a)])
    return np.array([(-b - root) / (2.0 * a), 2.0 * c / (-b - root)])


def _newton(powers: FloatArray, slopes: FloatArray, root: float) -> float:
    """A root after one step of Newton's, if that is a small one."""
    slope = _value(slopes, root)
    change = _value(powers, root) / slope if slope else np.inf
    return root - change if abs(change) < abs(root) else root


def _value(powers: FloatArray, x: float) -> float:
    value, power = 0.0, 1.0
    for coefficient in reversed(powers.tolist()):
        value = value + coefficient * power
        power = power * x
    return value


@dataclass(frozen=True, eq=False, repr=False)
class BSpline:
    """A curve of B-splines.

    Attributes:
        t: knots, not decreasing.
        c: coefficients (N, ...); of N + degree + 1 knots.
        k: degree.
    """

    t: FloatArray
    c: FloatArray
    k: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "t", np.ascontiguousarray(self.t, dtype=np.float64))
        object.__setattr__(self, "c", np.ascontiguousarray(self.c, dtype=np.float64))

    def __call__(self, at: ArrayLike, derivative: int = 0) -> FloatArray:
        """Values or derivatives at parameters of any shape s: (*s, ...)."""
        places = np.asarray(at, dtype=np.float64)
        flat = places.ravel()
        last = np.clip(np.searchsorted(self.t, flat, side="right") - 1, self.k, self.t.size - self.k - 2)
        functions = _basis_functions(self.t, flat, self.k, last, derivative)
        value = np.zeros((flat.size, *self.c.shape[1:]))
        for number, each in enumerate(functions):
            value = value + self.c[last + number - self.k] * each.reshape(-1, *[1] * (self.c.ndim - 1))
        return value.reshape(*places.shape, *self.c.shape[1:])

    def derivative(self, order: int = 1) -> BSpline:
        """That of an order, as a curve of lower degree."""
        t, c, k = self.t, self.c, self.k
        for _ in range(order):
            widths = t[k + 1 : -1] - t[1 : -k - 1]
            c = (c[1:] - c[:-1]) * k / widths.reshape(-1, *[1] * (c.ndim - 1))
            t, k = t[1:-1], k - 1
        return BSpline(t, c, k)


def _basis_functions(
    t: FloatArray, x: FloatArray, degree: int, last: NDArray[np.intp], derivative: int
) -> list[FloatArray]:
    """The functions that are not zero at parameters (n,), or derivatives: degree + 1 of (n,), by de Boor's recursion.

    Args:
        t: knots.
        x: parameters.
        degree: of the functions.
        last: number of the last of them at each parameter.
        derivative: its order.
    """
    values = [np.ones_like(x)]
    for j in range(1, degree + 1):
        before, values = values, [np.zeros_like(x)]
        for n in range(1, j + 1):
            right, left = t[last + n], t[last + n - j]
            apart = right != left
            width = np.where(apart, right - left, 1.0)
            if j <= degree - derivative:
                share = np.where(apart, before[n - 1] / width, 0.0)
                values[-1] = values[-1] + share * (right - x)
                values.append(share * (x - left))
            else:
                share = np.where(apart, j * before[n - 1] / width, 0.0)
                values[-1] = values[-1] - share
                values.append(share)
    return values
