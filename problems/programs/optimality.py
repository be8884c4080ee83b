"""Optimality of a point of a nonlinear program: multipliers and first-order conditions.

At a point z with objective f, rows g and active rows A, multipliers lambda >= 0 are estimated by least squares, signs
kept: the smallest |grad f + sum of lambda_i grad (row i)|.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray, as_array
from problems.programs.program import NonlinearProgram

ACTIVE_ROW_DISTANCE = 1e-3  # a scaled row that is nearer than this to its bound is active
NNLS_ITERATIONS = 30  # at most, for each bound
RANK_TOLERANCE = 1e-8  # relative size of a singular value that counts


@dataclass(frozen=True)
class Optimality:
    """First-order conditions at a point.

    Attributes:
        stationarity: |grad f + J' lambda| over |grad f|, with the best multipliers; 0 at a KKT point.
        complementarity: largest |multiplier x distance from the bound| of the scaled rows.
        violation: largest violation of the scaled rows and bounds.
        active: how many rows and bounds are active, equalities included.
        rank: of their Jacobian.
    """

    stationarity: float
    complementarity: float
    violation: float
    active: int
    rank: int

    @property
    def licq(self) -> bool:
        """Whether the gradients of the active rows are independent."""
        return self.rank == self.active


def optimality(program: NonlinearProgram, z: FloatArray) -> Optimality:
    """First-order conditions at a point (n,) of a program."""
    values, jacobian, gradient = _evaluated(program, z)
    lower, upper = _bounds(program, z)
    gap_low, gap_high = values - lower, upper - values
    equal = lower == upper
    near = np.minimum(gap_low, gap_high)
    active = equal | (near <= ACTIVE_ROW_DISTANCE)
    at_upper = gap_high <= gap_low
    rows = jacobian[active]
    multipliers = np.zeros(values.size)
    size = max(float(np.linalg.norm(gradient)), np.finfo(float).tiny)
    if active.any():
        multipliers[active] = least_squares_multipliers(rows, gradient, equal[active], at_upper[active])
    inexact = active & ~equal
    left = gradient + jacobian.T @ multipliers
    independent = _independent(rows, RANK_TOLERANCE * max(1.0, np.abs(rows).max(initial=0.0)))[1]
    return Optimality(
        float(np.linalg.norm(left)) / size,
        float(np.abs(multipliers[inexact] * near[inexact]).max(initial=0.0)),
        float(max(0.0, -near.min())),
        int(active.sum()),
        independent if active.any() else 0,
    )


def least_squares_multipliers(
    rows: FloatArray, gradient: FloatArray, equal: NDArray[np.bool_], at_upper: NDArray[np.bool_]
) -> FloatArray:
    """Multipliers (m,) that leave the least of the gradient: any for equalities, of the right sign for bounds.

    The part that equalities can make up for is projected out: only bounds are left to non-negative least squares.

    Args:
        rows: gradients of the active rows, (m, n).
        gradient: of the objective, (n,).
        equal: which rows are equalities, (m,).
        at_upper: which of the others are at their upper bound, whose multipliers are positive, (m,).
    """
    signs = np.where(at_upper[~equal], 1.0, -1.0)
    bounds = signs[:, None] * rows[~equal]
    (basis, triangle, chosen), rank = _independent(rows[equal], RANK_TOLERANCE * max(1.0, np.abs(rows).max()))
    basis = basis[:, :rank]
    left = [matrix - basis @ (basis.T @ matrix) for matrix in (bounds.T, -gradient)]
    most = NNLS_ITERATIONS * (1 + len(bounds))
    sizes = scipy.optimize.nnls(left[0], left[1], maxiter=most)[0] if len(bounds) else np.empty(0)
    multipliers = np.zeros(len(rows))
    multipliers[~equal] = signs * sizes
    known = basis.T @ (-gradient - bounds.T @ sizes)
    multipliers[np.flatnonzero(equal)[chosen[:rank]]] = scipy.linalg.solve_triangular(triangle[:rank, :rank], known)
    return multipliers


def _independent(rows: FloatArray, tolerance: float) -> tuple[tuple[FloatArray, FloatArray, NDArray[np.intp]], int]:
    """Q, R and the order of a QR decomposition of rows (m, n), the most independent first; and how many there are."""
    if not len(rows):
        return (np.zeros((rows.shape[1], 0)), np.zeros((0, 0)), np.zeros(0, dtype=np.intp)), 0
    *factors, order = scipy.linalg.qr(rows.T, mode="economic", pivoting=True)
    basis, triangle = (np.asarray(factor, dtype=np.float64) for factor in factors)
    return (basis, triangle, order.astype(np.intp)), int((np.abs(np.diag(triangle)) > tolerance).sum())


def _evaluated(program: NonlinearProgram, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows and variables (r + n,), their Jacobian (r + n, n), the objective's gradient (n,).

    Column by column: to write down the whole Jacobian takes longer than to evaluate one direction of it n times.
    """
    x, g, n = program.x, program.g, program.x.shape[0]
    direction = type(x).sym("direction", n)
    at = ca.Function("at", [x], [g, ca.gradient(program.f, x)])
    along = ca.Function("along", [x, direction], [ca.jtimes(g, x, direction)])
    rows, gradient = (as_array(part).ravel() for part in at(z))
    columns = as_array(along(np.tile(z[:, None], n), np.eye(n)))
    return np.concatenate([rows, z]), np.vstack([columns, np.eye(n)]), gradient


def _bounds(program: NonlinearProgram, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    pairs = zip(program.row_bounds(), program.bounds_near(z), strict=True)
    lower, upper = (np.concatenate(pair) for pair in pairs)
    return lower, upper
