"""Piecewise polynomials and B-splines as arrays, evaluated as SciPy does, to the bit, without loading it.

SciPy's module of interpolation loads a third of the library; a plan needs the values of a few polynomials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import perm

import numpy as np
from numpy.typing import ArrayLike, NDArray

from problems.base.matrix import FloatArray
from problems.base.polynomials import bernstein, halved

CLOSED_FORM = 2  # degree up to which roots have formulas
HALVINGS = 4  # of an interval in which a polynomial may have several roots
BLOCK = 32  # unknowns of a spline that are found together
MOST_STEPS, RESOLUTION = 100, 1e-15  # of Newton's method; of a root


@dataclass(frozen=True, eq=False, repr=False)
class PiecewisePolynomial:
    """A curve of values of any shape, polynomial between breakpoints.

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
        piece = self.x[1:-1].searchsorted(flat, side="right")
        into = (flat - self.x.take(piece)).reshape(-1, *[1] * (self.c.ndim - 2))
        value, power = np.zeros((flat.size, *self.c.shape[2:])), np.ones(1)
        for number in range(derivative, len(self.c)):
            term, factor = self.c[-1 - number].take(piece, axis=0), perm(number, derivative)
            if number > derivative:
                power = into if number == derivative + 1 else power * into
                term *= power
            if factor > 1:
                term *= float(factor)
            value += term
        return value.reshape(*places.shape, *self.c.shape[2:])

    def derivative(self, order: int = 1) -> PiecewisePolynomial:
        """The derivative of an order, as a curve."""
        if order >= len(self.c):
            return PiecewisePolynomial(np.zeros((1, *self.c.shape[1:])), self.x)
        left = len(self.c) - order
        factors = np.array([perm(power, order) for power in range(len(self.c) - 1, order - 1, -1)], dtype=np.float64)
        return PiecewisePolynomial(self.c[:left] * factors.reshape(-1, *[1] * (self.c.ndim - 1)), self.x)

    def antiderivative(self) -> PiecewisePolynomial:
        """The continuous integral, as a curve, from 0 at the first breakpoint on."""
        powers = np.arange(len(self.c), 0, -1, dtype=np.float64).reshape(-1, *[1] * (self.c.ndim - 1))
        raised, widths = self.c / powers, np.diff(self.x).reshape(-1, *[1] * (self.c.ndim - 2))
        grown = sum(part * widths**power for part, power in zip(raised, range(len(raised), 0, -1), strict=True))
        constants = np.concatenate([np.zeros_like(grown[:1]), np.cumsum(grown, axis=0)[:-1]])
        return PiecewisePolynomial(np.concatenate([raised, constants[None]]), self.x)


def real_roots(curves: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Roots of polynomials between two parameters each, (r,), in no order; none of one that is zero everywhere.

    Args:
        curves: (n, m), highest power first, of x - low.
        low: the parameters from which they count, and the least that a root may be, (m,).
        high: the largest, (m,).
    """
    n = len(curves)
    leading = np.where((curves != 0.0).any(axis=0), (curves != 0.0).argmax(axis=0), n)
    found = [np.empty(0)]
    for first in np.unique(leading[leading < n - 1]):
        chosen, powers = np.flatnonzero(leading == first), curves[first:]
        if n - 1 - first > CLOSED_FORM:
            owners, inner, unsure = _isolated(powers[:, chosen], (high - low)[chosen])
            found.append(inner + low[chosen[owners]])
            chosen = chosen[unsure]
        if chosen.size:
            roots = _polished(powers[:, chosen], _inner_roots(powers[:, chosen])) + low[chosen]
            found.append(roots[(roots >= low[chosen]) & (roots <= high[chosen])])
    return np.concatenate(found)


def _isolated(powers: FloatArray, widths: FloatArray) -> tuple[NDArray[np.intp], FloatArray, NDArray[np.intp]]:
    """Roots of polynomials (n, m) from 0 to widths (m,), by Descartes' rule for the signs of Bernstein coefficients.

    Returns:
        The numbers of polynomials, a root of each, and the numbers of those of which not all roots are among them.
    """
    forms = bernstein(powers[..., None], widths)[..., 0]
    owners, starts, share = np.arange(widths.size), np.zeros(widths.size), 1.0
    found, low, high, ends = [], [], [], []
    for halving in range(HALVINGS + 1):
        signs = np.sign(forms)
        changes, sure = (signs[1:] != signs[:-1]).sum(axis=0), (signs != 0.0).all(axis=0)
        single = sure & (changes == 1)
        found.append(owners[single])
        low.append((starts * widths[owners])[single])
        high.append(((starts + share) * widths[owners])[single])
        ends.append(signs[-1, single])
        left = ~(sure & (changes <= 1))
        forms, owners, starts = forms[:, left], owners[left], starts[left]
        if halving < HALVINGS:
            forms, owners, share = halved(forms), np.tile(owners, 2), share / 2.0
            starts = np.concatenate([starts, starts + share])
    unsure, known = np.unique(owners), np.concatenate(found)
    kept = ~np.isin(known, unsure)
    known = known[kept]
    bounds = (np.concatenate(each)[kept] for each in (low, high, ends))
    return known, _bracketed(powers[:, known], *bounds), unsure


def _bracketed(powers: FloatArray, low: FloatArray, high: FloatArray, end: FloatArray) -> FloatArray:
    """The roots of polynomials (n, m) between parameters at which they have different signs, by Newton's steps.

    The sign at the higher parameter is given: next to a root there, values that are computed in another way may differ.
    """
    close = RESOLUTION * high
    x, done = (low + high) / 2.0, np.zeros(low.size, dtype=bool)
    for _ in range(MOST_STEPS):
        value, slope = powers[0], np.zeros_like(x)
        for coefficient in powers[1:]:
            value, slope = value * x + coefficient, slope * x + value
        beyond = np.sign(value) == end
        low, high = np.where(beyond, low, x), np.where(beyond, x, high)
        with np.errstate(all="ignore"):
            step = x - value / slope
        step = np.where((step > low) & (step < high), step, (low + high) / 2.0)
        step = np.where(done | (value == 0.0), x, step)
        done |= np.abs(step - x) <= close
        x = step
        if done.all():
            break
    return x


def _inner_roots(powers: FloatArray) -> FloatArray:
    """Roots of polynomials (degree + 1, m) of that degree, (degree, m); NaN where they are not real."""
    degree, count = len(powers) - 1, powers.shape[1]
    if degree == 1:
        return -powers[1:] / powers[:1]
    if degree == CLOSED_FORM:
        return _quadratic_roots(*powers)
    companions = np.tile(np.diag(np.ones(degree - 1), -1), (count, 1, 1))
    companions[:, :, -1] = (-powers[:0:-1] / powers[0]).T
    roots = np.linalg.eigvals(companions).T
    return np.where(roots.imag == 0.0, roots.real, np.nan)


def _quadratic_roots(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Two roots of each quadratic without cancellation, (2, m)."""
    with np.errstate(all="ignore"):
        root = np.sqrt(b * b - 4.0 * a * c)
        far = np.where(b < 0.0, -b + root, -b - root)
        both = np.stack([2.0 * c / far, far / (2.0 * a)])
        return np.where(root == 0.0, -b / (2.0 * a), both)


def _polished(powers: FloatArray, roots: FloatArray) -> FloatArray:
    """Roots (r, m) after one Newton step, where that is a small one."""
    degree = len(powers) - 1
    slopes = powers[:-1] * np.arange(degree, 0.0, -1.0)[:, None]
    with np.errstate(all="ignore"):
        change = _values(powers, roots) / _values(slopes, roots)
        return np.where(np.abs(change) < np.abs(roots), roots - change, roots)


def _values(powers: FloatArray, x: FloatArray) -> FloatArray:
    value, power = np.zeros_like(x), np.ones_like(x)
    for coefficient in powers[::-1]:
        value = value + coefficient * power
        power = power * x
    return value


@dataclass(frozen=True, eq=False, repr=False)
class BSpline:
    """A curve that is a sum of B-splines.

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

    @classmethod
    def through(
        cls, t: FloatArray, parameters: FloatArray, values: FloatArray, degree: int, orders: Sequence[int] | None = None
    ) -> BSpline:
        """The spline that has given values, or derivatives, at parameters.

        Args:
            t: knots.
            parameters: as many as coefficients, not decreasing.
            values: at these, (N, k).
            degree: of the spline.
            orders: of the derivatives that are given, (N,); zero by default.
        """
        order = np.zeros(parameters.size, dtype=np.intp) if orders is None else np.array(orders)
        last = _last_functions(t, parameters, degree)
        rows = np.empty((parameters.size, degree + 1))
        for each in np.unique(order):
            chosen = order == each
            rows[chosen] = basis_functions(t, parameters[chosen], degree, last[chosen], int(each)).T
        largest = np.abs(rows).max(axis=1, keepdims=True)  # reflections round by the largest of all: derivatives are
        return cls(t, _banded_solution(last - degree, rows / largest, values / largest, parameters.size), degree)

    @classmethod
    def near(cls, t: FloatArray, parameters: FloatArray, values: FloatArray, degree: int) -> BSpline:
        """The spline nearest to values at parameters in the least squares, exactly at the first and at the last.

        Args:
            t: knots, the first and the last of them ``degree + 1`` times, with parameters between any two others.
            parameters: increasing, from the first to the last knot.
            values: at these, (n, k).
            degree: of the spline.
        """
        last, count = _last_functions(t, parameters, degree), t.size - degree - 1
        rows, right = basis_functions(t, parameters, degree, last, 0).T, values.copy()
        ends = np.zeros((2, degree + 1))
        ends[0, 0] = ends[1, -1] = 1.0
        rows[[0, -1]], places = ends, last[:, None] - degree + np.arange(degree + 1)
        for column, value in ((0, values[0]), (count - 1, values[-1])):  # coefficients that are known
            held = np.where(places == column, rows, 0.0)
            held[[0, -1]] = 0.0
            right -= held.sum(axis=1, keepdims=True) * value
            rows -= held
        return cls(t, _banded_solution(last - degree, rows, right, count), degree)

    def __call__(self, at: ArrayLike, derivative: int = 0) -> FloatArray:
        """Values or derivatives at parameters of any shape s: (*s, ...)."""
        places = np.asarray(at, dtype=np.float64)
        flat = places.ravel()
        last = _last_functions(self.t, flat, self.k)
        functions = basis_functions(self.t, flat, self.k, last, derivative)
        value = np.zeros((flat.size, *self.c.shape[1:]))
        for number, each in enumerate(functions):
            value += self.c.take(last + (number - self.k), axis=0) * each.reshape(-1, *[1] * (self.c.ndim - 1))
        return value.reshape(*places.shape, *self.c.shape[1:])

    def derivative(self, order: int = 1) -> BSpline:
        """The derivative of an order, as a curve of lower degree."""
        t, c, k = self.t, self.c, self.k
        for _ in range(order):
            widths = t[k + 1 : -1] - t[1 : -k - 1]
            c = (c[1:] - c[:-1]) * k / widths.reshape(-1, *[1] * (c.ndim - 1))
            t, k = t[1:-1], k - 1
        return BSpline(t, c, k)


def _last_functions(t: FloatArray, parameters: FloatArray, degree: int) -> NDArray[np.intp]:
    """The number of the last B-spline that is not zero at each parameter."""
    return np.clip(np.searchsorted(t, parameters, side="right") - 1, degree, t.size - degree - 2)


def _banded_solution(first: NDArray[np.intp], rows: FloatArray, right: FloatArray, count: int) -> FloatArray:
    """The unknowns (N, k) of equations, in the least squares, block by block of unknowns, by reflections.

    Args:
        first: number of the first unknown in each equation, not decreasing, (n,).
        rows: coefficients of that and the next unknowns, (n, w).
        right: sides, (n, k).
        count: of the unknowns.
    """
    width, k = rows.shape[1], right.shape[1]
    carried, known, triangles = np.empty((0, width - 1 + k)), 0, []
    for begin in range(0, count, BLOCK):
        size = min(BLOCK, count - begin)
        taken, most, columns = slice(known, int(np.searchsorted(first, begin + size))), len(carried), size + width - 1
        block = np.zeros((most + taken.stop - known, columns + k))
        block[:most, : width - 1], block[:most, columns:] = carried[:, : width - 1], carried[:, width - 1 :]
        places = first[taken, None] - begin + np.arange(width)
        np.put_along_axis(block[most:], places, rows[taken], axis=1)
        block[most:, columns:], known = right[taken], taken.stop
        triangle = np.asarray(np.linalg.qr(block, mode="r"))
        carried = triangle[size : len(block), size:]
        triangles.append(triangle[:size])
    found = np.zeros((count + width - 1, k))
    for number, triangle in reversed([*enumerate(triangles)]):
        begin, size = number * BLOCK, len(triangle)
        after = triangle[:, size:-k] @ found[begin + size : begin + size + width - 1]
        found[begin : begin + size] = np.linalg.solve(triangle[:, :size], triangle[:, -k:] - after)
    return found[:count]


def basis_functions(t: FloatArray, x: FloatArray, degree: int, last: NDArray[np.intp], derivative: int) -> FloatArray:
    """The B-splines that are not zero at parameters (n,), or derivatives, (degree + 1, n), by de Boor's recursion.

    Args:
        t: knots.
        x: parameters.
        degree: of the functions.
        last: number of the last of them at each parameter.
        derivative: its order.
    """
    values = np.ones((1, x.size))
    for j in range(1, degree + 1):
        numbers = last + np.arange(1, j + 1)[:, None]
        right, left = t[numbers], t[numbers - j]
        width, differs = right - left, j > degree - derivative
        share = np.divide(j * values if differs else values, width, out=np.zeros_like(width), where=width != 0.0)
        values = np.zeros((j + 1, x.size))
        values[1:] = share if differs else share * (x - left)
        values[:-1] += -share if differs else share * (right - x)
    return values
