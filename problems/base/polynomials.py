"""Polynomials by their coefficients, and their Bernstein form, whose coefficients bound them.

Over its interval a polynomial lies between the smallest and the largest of its Bernstein coefficients; halving the
interval brings them closer, quadratically. So a bound is proven without looking for roots.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import comb, factorial
from typing import NamedTuple

import numpy as np

from problems.base.matrix import FloatArray

MAX_HALVINGS = 40  # halvings of a piece
PEAK_RESOLUTION = 1e-11  # relative


def bernstein(coefficients: FloatArray, durations: FloatArray) -> FloatArray:
    """Bernstein coefficients (n + 1, p, k) of p pieces.

    Args:
        coefficients: (n + 1, p, k), highest power first, each piece in its own time from 0, as SciPy's PPoly.
        durations: of the pieces, (p,).
    """
    n = coefficients.shape[0] - 1
    powers = coefficients[::-1] * durations[None, :, None] ** np.arange(n + 1)[:, None, None]
    return np.asarray(np.einsum("ij,jpk->ipk", _from_powers(n), powers))


@cache
def _from_powers(n: int) -> FloatArray:
    """The matrix that turns coefficients, lowest power first, into those of Bernstein, (n + 1, n + 1)."""
    return np.array([[comb(i, j) / comb(n, j) if j <= i else 0.0 for j in range(n + 1)] for i in range(n + 1)])


def taylor_coefficients(curve: Callable[[FloatArray, int], FloatArray], at: FloatArray, degree: int) -> FloatArray:
    """The coefficients (degree + 1, p, ...) of a curve from parameters (p,) on, highest power first.

    Args:
        curve: its derivatives (p, ...) at parameters, by their order.
        at: parameters.
        degree: of the coefficients.
    """
    return np.stack([curve(at, order) / factorial(order) for order in range(degree, -1, -1)])


class Part(NamedTuple):
    """A section of one piece of a curve.

    Attributes:
        piece: its number.
        start: share of the piece at which it begins.
        end: likewise.
    """

    piece: int
    start: float
    end: float


def unproven_part(curves: FloatArray, lower: FloatArray, upper: FloatArray) -> Part | None:
    """The first part of a curve that is not proven to stay between its bounds; None where all are.

    Args:
        curves: Bernstein coefficients (n + 1, p, k).
        lower: one for each of the last axis, (k,).
        upper: likewise.

    Returns:
        The first part found whose end breaks a bound, or that ``MAX_HALVINGS`` halvings could not decide.
    """
    shape = curves.shape[1:]
    flat = curves.reshape(len(curves), -1)
    low, high = (np.broadcast_to(bound, shape).ravel() for bound in (lower, upper))
    pieces, starts = np.repeat(np.arange(shape[0]), shape[1]), np.zeros(flat.shape[1])
    for halvings in range(MAX_HALVINGS + 1):
        width, ends = 0.5**halvings, flat[[0, -1]]
        unproven = (flat < low).any(axis=0) | (flat > high).any(axis=0)
        if not unproven.any():
            return None
        broken = (ends < low).any(axis=0) | (ends > high).any(axis=0)
        if broken.any() or halvings == MAX_HALVINGS:
            first = int(np.argmax(broken if broken.any() else unproven))
            return Part(int(pieces[first]), float(starts[first]), float(starts[first]) + width)
        flat, low, high = halved(flat[:, unproven]), np.tile(low[unproven], 2), np.tile(high[unproven], 2)
        pieces = np.tile(pieces[unproven], 2)
        starts = np.concatenate([starts[unproven], starts[unproven] + width / 2.0])
    return None


def peak(curves: FloatArray) -> float:
    """An upper bound of the largest absolute value of curves in Bernstein form, (n + 1, m): 1e-11 too large at most."""
    reached = 0.0
    for _ in range(MAX_HALVINGS):
        reached = max(reached, float(np.abs(curves[[0, -1]]).max()))
        undecided = np.abs(curves).max(axis=0) > reached * (1.0 + PEAK_RESOLUTION)
        if not undecided.any():
            return reached * (1.0 + PEAK_RESOLUTION)
        curves = halved(curves[:, undecided])
    return float(np.abs(curves).max())


def halved(curves: FloatArray) -> FloatArray:
    """The first and the second halves of curves in Bernstein form, (n + 1, 2 m)."""
    half = _first_half(len(curves) - 1)
    return np.concatenate([half @ curves, (half @ curves[::-1])[::-1]], axis=1)


@cache
def _first_half(n: int) -> FloatArray:
    """The matrix that turns Bernstein coefficients into those of the first half, (n + 1, n + 1)."""
    return np.array([[comb(i, j) / 2**i if j <= i else 0.0 for j in range(n + 1)] for i in range(n + 1)])


def derivative(polynomials: FloatArray) -> FloatArray:
    """Derivatives of polynomials (n, ...), with at least one coefficient."""
    if len(polynomials) == 1:
        return np.zeros_like(polynomials)
    return np.asarray(polynomials[1:] * np.arange(1.0, len(polynomials))[:, None, None])


def product(left: FloatArray, right: FloatArray) -> FloatArray:
    """Products of (n, N, k) and (m, N, k), of which either k may be 1: (n + m - 1, N, k)."""
    result = np.zeros((len(left) + len(right) - 1, *np.broadcast_shapes(left.shape[1:], right.shape[1:])))
    for power, coefficient in enumerate(left):
        result[power : power + len(right)] += coefficient * right
    return result


def composition(outer: FloatArray, inner: FloatArray) -> FloatArray:
    """Polynomials (n, N, k) of polynomials (m, N, 1), by Horner's rule."""
    result = outer[-1:].copy()
    for coefficient in outer[-2::-1]:
        result = product(result, inner)
        result[0] += coefficient
    return result


def in_bernstein_form(polynomials: FloatArray) -> FloatArray:
    """Bernstein coefficients over [0, 1], (n, ...), of polynomials of any shape (n, N, ...)."""
    flat = polynomials.reshape(*polynomials.shape[:2], -1)
    return bernstein(flat[::-1], np.ones(flat.shape[1])).reshape(polynomials.shape)
