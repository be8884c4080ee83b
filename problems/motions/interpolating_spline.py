"""Cubic splines through knots whose coefficients follow from the angles there by one banded solve.

Everything is linear in the knot angles: each sample takes four B-spline coefficients. The parameter is normalised, u in
[0, 1].
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from math import factorial

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, PPoly
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from problems.base.matrix import FloatArray, Matrix, constant

DEGREE = 3
RELATIVE_ROUNDING = 1e-12  # relative: what rounding leaves where a basis function is zero


class InterpolatingSpline(ABC):
    """Splines with given knots. A subclass says which conditions, besides the angles at the knots, determine them.

    Args:
        knots: M >= 2 increasing values of u at which angles are given, the first 0, the last 1.
        nodes: increasing values of u where pieces meet, the first 0, the last 1.
        inner: nodes that are repeated in the basis, as often as they occur here; there the spline is less smooth.
    """

    def __init__(self, knots: FloatArray, nodes: FloatArray, inner: FloatArray | None = None) -> None:
        self.knots, self.nodes = knots, nodes
        repeated = np.empty(0) if inner is None else inner
        padded = np.sort(np.concatenate([np.repeat([0.0, 1.0], DEGREE), nodes, repeated]))
        self.basis = BSpline(padded, np.eye(padded.size - DEGREE - 1), DEGREE)

    @property
    @abstractmethod
    def conditions(self) -> FloatArray:
        """The square matrix of the conditions that the n coefficients satisfy, (n, n)."""

    @abstractmethod
    def known(self, angles: Matrix) -> Matrix:
        """The right-hand side (n, k) of ``conditions`` for knot angles (M, k)."""

    def coefficients(self, angles: Matrix) -> Matrix:
        """B-spline coefficients (n, k) of knot angles (M, k), by forward and backward substitution."""
        factors = splu(csc_array(self.conditions), permc_spec="NATURAL", diag_pivot_thresh=0.0)
        known = self.known(angles)
        rows = [known[int(i), :] for i in np.argsort(factors.perm_r)]
        forward = _substitute(factors.L.toarray(), rows, range(len(rows)))
        return ca.vertcat(*_substitute(factors.U.toarray(), forward, range(len(rows) - 1, -1, -1)))

    def basis_functions(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """All basis functions, or a derivative of them, at u (n,): (n, coefficients)."""
        return np.asarray(self.basis(u, derivative))

    def sampling_matrix(self, u: FloatArray, derivative: int = 0) -> ca.DM:
        """The constant sparse matrix from coefficients to derivatives with respect to u at (n,), n rows."""
        rows = self.basis_functions(u, derivative)
        return constant(np.where(np.abs(rows) < RELATIVE_ROUNDING * np.abs(rows).max(), 0.0, rows))

    def local_basis(self, u: FloatArray, derivative: int = 0) -> tuple[FloatArray, NDArray[np.intp]]:
        """The four basis functions that can differ from zero at u (n,): values (n, 4), and which is the first, (n,)."""
        rows = np.asarray(self.sampling_matrix(u, derivative))
        piece = np.clip(np.searchsorted(self.nodes, u, side="right") - 1, 0, self.nodes.size - 2)
        first = self.first_of_piece[piece]
        return np.take_along_axis(rows, first[:, None] + np.arange(DEGREE + 1), axis=1), first

    @cached_property
    def first_of_piece(self) -> NDArray[np.intp]:
        """The first of the four basis functions that are not zero in each piece between nodes, (nodes - 1,)."""
        return (np.searchsorted(self.basis.t, self.nodes[:-1], side="right") - 1 - DEGREE).astype(np.intp)

    def operator(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """The dense matrix (n, M) straight from knot angles to samples; for bounds and tests."""
        return np.asarray(ca.mtimes(self.sampling_matrix(u, derivative), self.coefficients(ca.DM.eye(self.knots.size))))

    def curve(self, coefficients: FloatArray) -> PPoly:
        """The exact piecewise polynomial of coefficients (n, k), between the nodes."""
        spline = BSpline(self.basis.t, coefficients, DEGREE)
        at_nodes = [np.asarray(spline(self.nodes[:-1], n)) / factorial(n) for n in range(DEGREE, -1, -1)]
        return PPoly(np.stack(at_nodes), self.nodes)

    def scaled(self, angles: Matrix) -> Matrix:
        """Angles (M, k) at the knots as :attr:`conditions`, whose rows are scaled, need them."""
        return angles / ca.repmat(ca.DM(np.abs(self.basis(self.knots)).max(axis=1)), 1, angles.shape[1])


def without_rounding(rows: FloatArray) -> FloatArray:
    """Rows scaled to a largest entry of 1, without what rounding leaves where a basis function is zero."""
    scaled = rows / np.abs(rows).max(axis=1, keepdims=True)
    return np.where(np.abs(scaled) < RELATIVE_ROUNDING, 0.0, scaled)


def _substitute(triangle: FloatArray, known: list[Matrix], order: range) -> list[Matrix]:
    """Solve a constant triangular system for symbolic right-hand sides, row by row in the given order."""
    solved: list[Matrix] = list(known)
    for i in order:
        value = known[i]
        for j in np.flatnonzero(triangle[i]).tolist():
            if j != i:
                value = value - triangle[i, j] * solved[j]
        solved[i] = value * (1.0 / triangle[i, i])
    return solved
