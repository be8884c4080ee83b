"""A cubic C2 spline written in angles and second derivatives at its nodes: sparse, for nonlinear programs."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix, as_array, constant
from problems.motions.splines.rest import RestSpline


class NodeForm:
    """A cubic C2 spline written in angles and second derivatives at its nodes.

    Args:
        spline: whose nodes.
    """

    def __init__(self, spline: RestSpline) -> None:
        self.nodes = spline.nodes
        self.steps = np.diff(spline.nodes)
        self.unit = float(self.steps.mean()) ** 2  # scales second derivatives to rad
        self.knots = [int(np.argmin(np.abs(spline.nodes - u))) for u in spline.knots]

    def samples(self, angles: Matrix, bends: Matrix, u: FloatArray) -> tuple[Matrix, ...]:
        """Angles, speeds, accelerations and jerks (n, k) at u (n,), from angles and scaled bends (nodes, k)."""
        i = np.clip(np.searchsorted(self.nodes, u, side="right") - 1, 0, self.steps.size - 1)
        h = self.steps[i]
        b = (u - self.nodes[i]) / h
        a = 1.0 - b
        of_angles = ((a, b), (-1.0 / h, 1.0 / h), (0.0 * a, 0.0 * b), (0.0 * a, 0.0 * b))
        of_bends = (
            ((a**3 - a) * h**2 / 6.0, (b**3 - b) * h**2 / 6.0),
            (-(3.0 * a**2 - 1.0) * h / 6.0, (3.0 * b**2 - 1.0) * h / 6.0),
            (a, b),
            (-1.0 / h, 1.0 / h),
        )
        return tuple(
            ca.mtimes(self._between(i, *pair), angles) + ca.mtimes(self._between(i, *bend), bends) / self.unit
            for pair, bend in zip(of_angles, of_bends, strict=True)
        )

    def _between(self, i: np.ndarray, left: FloatArray, right: FloatArray) -> ca.DM:
        matrix = np.zeros((i.size, self.nodes.size))
        rows = np.arange(i.size)
        matrix[rows, i], matrix[rows, i + 1] = left, right
        return constant(matrix)

    def joins(self, angles: Matrix, bends: Matrix) -> Matrix:
        """Zero (nodes, k) when speeds are continuous at the inner nodes and zero at both ends; rad."""
        h, n = self.steps, self.nodes.size
        slopes, curvature = np.zeros((n, n)), np.zeros((n, n))
        for i in range(n):
            if i > 0:  # the speed at the end of the piece before
                slopes[i, i - 1 : i + 1] += np.array([-1.0, 1.0]) / h[i - 1]
                curvature[i, i - 1 : i + 1] += np.array([1.0, 2.0]) * h[i - 1] / 6.0
            if i < n - 1:  # less the speed at the start of the piece after
                slopes[i, i : i + 2] -= np.array([-1.0, 1.0]) / h[i]
                curvature[i, i : i + 2] += np.array([2.0, 1.0]) * h[i] / 6.0
        scale = float(np.sqrt(self.unit))
        return ca.mtimes(constant(slopes * scale), angles) + ca.mtimes(constant(curvature * scale / self.unit), bends)


def knot_operators(spline: RestSpline, *samples: tuple[FloatArray, int]) -> tuple[FloatArray, ...]:
    """Constant matrices (n, M) from angles at the knots to derivatives of the spline, by (times u (n,), order)."""
    shape = spline.coefficients(ca.DM.eye(spline.knots.size))
    return tuple(as_array(ca.mtimes(spline.sampling_matrix(u, order), shape)) for u, order in samples)
