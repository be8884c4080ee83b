"""Splines of degree 5: clamped, through given points, and in time.

Everything is linear in the knot angles: each sample takes four B-spline coefficients. The parameter is normalised, u in
[0, 1].
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from operator import add

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import BSpline, FloatArray, Matrix, PiecewisePolynomial, constant, taylor_coefficients
from problems.motions.samples import Samples
from problems.motions.trajectory import Motion, SampleGrid
from problems.robots import Robot

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
        """The Greville abscissae (N,): control points there make a straight line."""
        return np.array([self.basis.t[i + 1 : i + 1 + self.degree].mean() for i in range(self.size)])

    def basis_functions(self, u: FloatArray, derivative: int = 0) -> FloatArray:
        """All basis functions, or a derivative of them, at parameters (n,): (n, N)."""
        return np.asarray(self.basis.derivative(derivative)(u) if derivative else self.basis(u))

    def sampling_matrix(self, u: FloatArray, derivative: int = 0) -> ca.DM:
        """The constant sparse matrix (n, N) from control points to derivatives with respect to u at parameters (n,)."""
        rows = self.basis_functions(u, derivative)
        return constant(np.where(np.abs(rows) < RELATIVE_ROUNDING * np.abs(rows).max(initial=0.0), 0.0, rows))

    def local_basis(self, u: FloatArray, derivative: int = 0) -> tuple[FloatArray, NDArray[np.intp]]:
        """The basis functions that can be nonzero at parameters (n,): (n, degree + 1), and the number of the first."""
        rows = np.asarray(self.sampling_matrix(u, derivative))
        piece = np.clip(np.searchsorted(self.nodes, u, side="right") - 1, 0, self.nodes.size - 2)
        first = self.first_of_piece[piece]
        return np.take_along_axis(rows, first[:, None] + np.arange(self.degree + 1), axis=1), first

    @cached_property
    def first_of_piece(self) -> NDArray[np.intp]:
        """The first of the basis functions that are not zero in each piece between nodes, (p,)."""
        return (np.searchsorted(self.basis.t, self.nodes[:-1], side="right") - 1 - self.degree).astype(np.intp)

    def curve(self, control_points: FloatArray) -> PiecewisePolynomial:
        """The piecewise polynomial of control points (N, k), with the nodes as breakpoints."""
        spline = BSpline(self.basis.t, control_points, self.degree)
        return PiecewisePolynomial(taylor_coefficients(spline, self.nodes[:-1], self.degree), self.nodes)


class InterpolatingSpline(ClampedSpline, ABC):
    """A spline with given knots. A subclass says which conditions determine it besides the angles there.

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
        matrix = scipy.sparse.csc_array(self.conditions)
        factors = scipy.sparse.linalg.splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0)
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


@dataclass(frozen=True)
class SplineShape:
    """The shape of a spline in time: coefficients (N, k), rad, over u in [0, 1], and duration, s."""

    coefficients: Matrix
    time: Matrix


class SplineInTime(Motion[SplineShape]):
    """A spline sampled at given shares u of its duration.

    Attributes:
        robot: that moves.
    """

    robot: Robot

    @property
    @abstractmethod
    def spline(self) -> ClampedSpline:
        """The basis over u, from 0 to 1."""

    @property
    @abstractmethod
    def parameters_u(self) -> FloatArray:
        """Shares of the duration at which it is sampled, equally spaced, (n,)."""

    @property
    def support(self) -> int:
        """The number of coefficients that shape a sample."""
        return self.spline.degree + 1

    @cached_property
    def weights_u(self) -> FloatArray:
        """Weights of the trapezoidal rule over u, (n,)."""
        weights = np.full(self.parameters_u.size, 1.0 / (self.parameters_u.size - 1))
        weights[[0, -1]] /= 2.0
        return weights

    def samples(self, parameters: SplineShape) -> Samples:
        blocks = [
            ca.mtimes(self.spline.sampling_matrix(self.parameters_u, n), parameters.coefficients / parameters.time**n)
            for n in self.orders
        ]
        return Samples(
            robot=self.robot,
            derivatives=tuple(blocks),
            duration=parameters.time,
            times=ca.DM(self.parameters_u) * parameters.time,
            weights=ca.DM(self.weights_u) * parameters.time,
        )

    @cached_property
    def grid(self) -> SampleGrid:
        """Rows: the basis functions of each order that are not zero there, u, the weight."""
        bases, pieces = zip(*(self.spline.local_basis(self.parameters_u, n) for n in self.orders), strict=True)
        return SampleGrid(rows=np.column_stack([*bases, self.parameters_u, self.weights_u]), pieces=pieces[0])

    def blocks(self, parameters: SplineShape, orders: tuple[int, ...]) -> Matrix:
        """The coefficients one after the other, divided by the duration to the power of each order."""
        return ca.vec(ca.horzcat(*(parameters.coefficients / parameters.time**order for order in orders)).T)

    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        """One coefficient per piece; a sample needs as many as basis functions are nonzero there."""
        size = len(orders) * self.robot.dof
        return size, self.support * size

    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        derivatives: list[Matrix | None] = [None] * len(self.orders)
        for order in orders:
            basis = row[self.support * order : self.support * (order + 1)]
            derivatives[order] = self.combined(window, basis, orders, order)
        u, weight = row[self.support * len(self.orders)], row[self.support * len(self.orders) + 1]
        return Samples(
            robot=self.robot,
            derivatives=tuple(derivatives),
            duration=durations[0],
            times=u * durations[0],
            weights=weight * durations[0],
        )

    def combined(self, window: Matrix, basis: Matrix, orders: tuple[int, ...], order: int) -> Matrix:
        """Joint angles or a derivative (1, k) from a window and the basis functions (support, 1)."""
        k, size = self.robot.dof, len(orders) * self.robot.dof
        first = orders.index(order) * k
        parts = [basis[i] * window[first + i * size : first + i * size + k].T for i in range(self.support)]
        return reduce(add, parts)

    def durations(self, parameters: SplineShape) -> Matrix:
        return parameters.time

    @property
    def duration_count(self) -> int:
        return 1

    def as_matrices(self, parameters: SplineShape) -> list[Matrix]:
        return [parameters.coefficients, parameters.time]

    def from_matrices(self, matrices: Sequence[Matrix]) -> SplineShape:
        return SplineShape(*matrices)
