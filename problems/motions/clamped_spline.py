"""B-splines over given nodes that begin at the first control point and end at the last one."""

from __future__ import annotations

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
    """Cubic splines over increasing nodes, once continuously more differentiable than they are at a corner: C2.

    Args:
        nodes: p + 1 increasing values of u; there are p + 3 control points.
    """

    def __init__(self, nodes: FloatArray) -> None:
        self.nodes = nodes
        ends = np.repeat(nodes[[0, -1]], DEGREE)
        padded = np.sort(np.concatenate([ends, nodes]))
        self.basis = BSpline(padded, np.eye(padded.size - DEGREE - 1), DEGREE)

    @property
    def size(self) -> int:
        """The number of control points N."""
        return int(self.basis.c.shape[0])

    @cached_property
    def greville(self) -> FloatArray:
        """For each control point the u to which it belongs, (N,): control points there make a straight line."""
        return np.array([self.basis.t[i + 1 : i + 1 + DEGREE].mean() for i in range(self.size)])

    def sampling_matrix(self, u: FloatArray, derivative: int = 0) -> ca.DM:
        """The constant sparse matrix (n, N) from control points to derivatives with respect to u at parameters (n,)."""
        rows = self.basis.derivative(derivative)(u) if derivative else self.basis(u)
        return constant(np.where(np.abs(rows) < RELATIVE_ROUNDING * np.abs(rows).max(initial=0.0), 0.0, rows))

    def local_basis(self, u: FloatArray, derivative: int = 0) -> tuple[FloatArray, NDArray[np.intp]]:
        """The four basis functions that can differ from zero at parameters (n,): (n, 4), and which is the first."""
        rows = np.asarray(self.sampling_matrix(u, derivative))
        piece = np.clip(np.searchsorted(self.nodes, u, side="right") - 1, 0, self.nodes.size - 2)
        return np.take_along_axis(rows, piece[:, None] + np.arange(DEGREE + 1), axis=1), piece.astype(np.intp)

    def curve(self, control_points: FloatArray) -> PPoly:
        """The piecewise polynomial of control points (N, k), with the nodes as breakpoints."""
        spline = BSpline(self.basis.t, control_points, DEGREE)
        powers = [np.asarray(spline(self.nodes[:-1], n)) / factorial(n) for n in range(DEGREE + 1)]
        return PPoly(np.array(powers[::-1]), self.nodes)
