"""Arithmetic of many polynomials at once: coefficients (n, N, k), lowest power first."""

from __future__ import annotations

import numpy as np

from problems.base.bernstein import bernstein
from problems.base.matrix import FloatArray


def derivative(polynomials: FloatArray) -> FloatArray:
    """Derivatives; one coefficient at least."""
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
