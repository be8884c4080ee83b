"""Cubic splines through knots whose coefficients follow from the angles there by one banded solve.

Everything is linear in the knot angles: each sample takes four B-spline coefficients. The parameter is normalised, u in
[0, 1].
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence

import casadi as ca
import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from problems.base.matrix import FloatArray, Matrix
from problems.motions.splines.clamped import RELATIVE_ROUNDING, ClampedSpline


class InterpolatingSpline(ClampedSpline, ABC):
    """Splines with given knots. A subclass says which conditions, besides the angles at the knots, determine them.

    Args:
        knots: M >= 2 increasing values of u at which angles are given, the first 0, the last 1.
        nodes: where pieces meet, as those of any clamped spline.
        repeated: likewise.
    """

    def __init__(self, knots: FloatArray, nodes: FloatArray, repeated: Sequence[float] = ()) -> None:
        super().__init__(nodes, repeated)
        self.knots = knots

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

    def operator(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """The dense matrix (n, M) straight from knot angles to samples; for bounds and tests."""
        return np.asarray(ca.mtimes(self.sampling_matrix(u, derivative), self.coefficients(ca.DM.eye(self.knots.size))))

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
