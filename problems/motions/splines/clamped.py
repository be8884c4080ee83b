"""B-splines over given nodes that begin at the first control point and end at the last one."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import factorial

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, PPoly

from problems.base.matrix import FloatArray, constant

DEGREE = 3
RELATIVE_ROUNDING = 1e-12  # relative: what rounding leaves where a basis function is zero


class ClampedSpline:
    """Splines over increasing nodes, as smooth as their degree allows: C2 where they are cubic.

    Args:
        nodes: p + 1 increasing values of u; there are p + degree control points.
        repeated: nodes that are in the basis once more for each time that they are listed here: splines are less
            smooth there, and there is a control point more.
        degree: of the pieces.
    """

    def __init__(self, nodes: FloatArray, repeated: Sequence[float] = (), degree: int = DEGREE) -> None:
        self.nodes, self.degree = nodes, degree
        ends = np.repeat(nodes[[0, -1]], degree)
        padded = np.sort(np.concatenate([ends, nodes, np.asarray(repeated, dtype=np.float64)]))
        self.basis = BSpline(padded, np.eye(padded.size - degree - 1), degree)

    @property
    def size(self) -> int:
        """The number of control points N."""
        return int(self.basis.c.shape[0])

    @cached_property
    def greville(self) -> FloatArray:
        """For each control point the u to which it belongs, (N,): control points there make a straight line."""
        return np.array([self.basis.t[i + 1 : i + 1 + self.degree].mean() for i in range(self.size)])

    def basis_functions(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """All basis functions, or a derivative of them, at parameters (n,): (n, N)."""
        return np.asarray(self.basis.derivative(derivative)(u) if derivative else self.basis(u))

    def sampling_matrix(self, u: FloatArray, derivative: int = 0) -> ca.DM:
        """The constant sparse matrix (n, N) from control points to derivatives with respect to u at parameters (n,)."""
        rows = self.basis_functions(u, derivative)
        return constant(np.where(np.abs(rows) < RELATIVE_ROUNDING * np.abs(rows).max(initial=0.0), 0.0, rows))

    def local_basis(self, u: FloatArray, derivative: int = 0) -> tuple[FloatArray, NDArray[np.intp]]:
        """The basis functions that can differ from zero at parameters (n,): (n, degree + 1), and which is the first."""
        rows = np.asarray(self.sampling_matrix(u, derivative))
        piece = np.clip(np.searchsorted(self.nodes, u, side="right") - 1, 0, self.nodes.size - 2)
        first = self.first_of_piece[piece]
        return np.take_along_axis(rows, first[:, None] + np.arange(self.degree + 1), axis=1), first

    @cached_property
    def first_of_piece(self) -> NDArray[np.intp]:
        """The first of the basis functions that are not zero in each piece between nodes, (p,)."""
        return (np.searchsorted(self.basis.t, self.nodes[:-1], side="right") - 1 - self.degree).astype(np.intp)

    def curve(self, control_points: FloatArray) -> PPoly:
        """The piecewise polynomial of control points (N, k), with the nodes as breakpoints."""
        spline = BSpline(self.basis.t, control_points, self.degree)
        powers = [np.asarray(spline(self.nodes[:-1], n)) / factorial(n) for n in range(self.degree + 1)]
        return PPoly(np.array(powers[::-1]), self.nodes)
