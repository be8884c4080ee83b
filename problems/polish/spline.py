"""The cubic splines by which motions deviate: control points over pieces from 0 to 1, short ones at both ends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import perm
from typing import Self

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, basis_functions, taylor_coefficients

DEGREE = 3
PIECES = 24  # of the spline, were they of one length
END_CUTS = (0.25, 0.5)  # shares of the first and the last piece where these are cut again
SAMPLES = 6  # postures in each piece that programs examine
FIT_DAMPING = 1e-3  # keeps control points of short pieces near zero in a fit


@dataclass(frozen=True)
class DeviationSpline:
    """Cubic splines on one division of the interval from 0 to 1, with short pieces at both ends.

    Args:
        pieces: of the spline, were they of one length.
        fixed: control points at either end that are zero: 3 where it has no acceleration there, else 2.
    """

    pieces: int = PIECES
    fixed: int = 3

    @classmethod
    @lru_cache(maxsize=8)
    def of(cls, pieces: int, fixed: int = 3) -> Self:
        """The cached spline of so many pieces, whose tables are made once."""
        return cls(pieces, fixed)

    @cached_property
    def edges(self) -> FloatArray:
        """Edges of the pieces, from 0 to 1: short ones at both ends, where accelerations rise."""
        even = np.linspace(0.0, 1.0, self.pieces + 1)
        first = even[1] * np.array(END_CUTS)
        return np.concatenate([[0.0], first, even[1:-1], 1.0 - first[::-1], [1.0]])

    @property
    def count(self) -> int:
        """The number of control points of a joint."""
        return int(self.edges.size) - 1 + DEGREE

    @cached_property
    def _coefficients(self) -> FloatArray:
        """Coefficients of the four functions that are not zero in each piece, highest power first, (4, pieces, 4).

        With the recursion of ``basis_functions`` in their place a polish takes 15 % longer.
        """
        knots = np.concatenate([np.zeros(DEGREE), self.edges, np.ones(DEGREE)])
        last = np.arange(self.edges.size - 1) + DEGREE
        return taylor_coefficients(
            lambda at, order: basis_functions(knots, at, DEGREE, last, order).T, self.edges[:-1], DEGREE
        )

    def weights(
        self, u: FloatArray, order: int, within: FloatArray | None = None
    ) -> tuple[FloatArray, NDArray[np.intp]]:
        """Weights of control points in a derivative by u at parameters (m,): (m, 4); the first of the points, (m,).

        Args:
            u: parameters.
            order: of the derivative.
            within: parameters in the same pieces that say which pieces these are, where u is on an edge.
        """
        around = u if within is None else within
        piece = np.clip(np.searchsorted(self.edges, around, side="right") - 1, 0, self.edges.size - 2)
        into, weights = (u - self.edges[piece])[:, None], np.zeros((len(u), DEGREE + 1))
        for power, coefficients in zip(range(DEGREE, order - 1, -1), self._coefficients[:, piece], strict=False):
            weights = weights * into + perm(power, order) * coefficients
        return weights, piece

    def parameters(self, in_piece: int = SAMPLES) -> FloatArray:
        """The parameters of samples, so many in each piece of the even spline, without both ends, (n,)."""
        return np.linspace(0.0, 1.0, self.pieces * in_piece + 1)[1:-1]

    @cached_property
    def fit(self) -> FloatArray:
        """The matrix from deviations at the usual parameters to the nearest free control points, (free, n)."""
        u = self.parameters()
        weights, piece = self.weights(u, 0)
        matrix = np.zeros((u.size, self.count))
        np.put_along_axis(matrix, piece[:, None] + np.arange(4), weights, axis=1)
        inner = matrix[:, self.fixed : -self.fixed]
        return np.asarray(np.linalg.solve(inner.T @ inner + FIT_DAMPING * np.eye(inner.shape[1]), inner.T))

    def end_points(self, end: float, order: int, rate: FloatArray) -> FloatArray:
        """Control points (fixed, k) at an end whose spline has a derivative (k,) of an order there and no other."""
        at = np.array([end])
        powers = np.stack([self.weights(at, order)[0][0] for order in range(self.fixed)])
        matrix = powers[:, : self.fixed] if end == 0.0 else powers[:, -self.fixed :]
        derivatives = np.zeros((self.fixed, rate.size))
        derivatives[order] = rate
        return np.asarray(np.linalg.solve(matrix, derivatives))
