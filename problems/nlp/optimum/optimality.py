"""Whether a motion is a KKT point, which limits are active, and their shadow prices.

At a point z of a nonlinear program with objective f, rows g and active rows A, multipliers lambda >= 0 are estimated by
least squares, signs kept: the smallest |grad f + sum of lambda_i grad (row i)|. For the rows' bounds b they are the
sensitivities d f* / d b.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import qr, solve_triangular
from scipy.optimize import nnls

from problems.base.matrix import FloatArray, as_array
from problems.nlp.optimum.prices import Sensitivity, sensitivities
from problems.nlp.program import NonlinearProgram
from problems.robots.robot import Robot

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
        sensitivities: of the active limits, the largest first.
    """

    stationarity: float
    complementarity: float
    violation: float
    active: int
    rank: int
    sensitivities: tuple[Sensitivity, ...]

    @property
    def licq(self) -> bool:
        """Whether the gradients of the active rows are independent."""
        return self.rank == self.active


def optimality(program: NonlinearProgram, z: FloatArray, objective_unit: str, robot: Robot) -> Optimality:
    """First-order conditions at a point (n,) of a program of a robot."""
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
    given = equal & (np.arange(values.size) >= program.g.shape[0])  # variables that are none
    left = gradient + jacobian.T @ multipliers
    independent = _independent(rows, RANK_TOLERANCE * max(1.0, np.abs(rows).max(initial=0.0)))[1]
    return Optimality(
        float(np.linalg.norm(left)) / size,
        float(np.abs(multipliers[inexact] * near[inexact]).max(initial=0.0)),
        float(max(0.0, -near.min())),
        int(active.sum()),
        independent if active.any() else 0,
        tuple(sensitivities(program, z, np.where(given, 0.0, multipliers), objective_unit, robot)),
    )


def least_squares_multipliers(
    rows: FloatArray, gradient: FloatArray, equal: NDArray[np.bool_], at_upper: NDArray[np.bool_]
) -> FloatArray:
    """Multipliers (m,) that leave the least of the gradient: any for equalities, of the right sign for bounds.

    What equalities can make up for is projected out, so that only the bounds are left to non-negative least squares.

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
    sizes = nnls(left[0], left[1], maxiter=NNLS_ITERATIONS * (1 + len(bounds)))[0] if len(bounds) else np.empty(0)
    multipliers = np.zeros(len(rows))
    multipliers[~equal] = signs * sizes
    known = basis.T @ (-gradient - bounds.T @ sizes)
    multipliers[np.flatnonzero(equal)[chosen[:rank]]] = solve_triangular(triangle[:rank, :rank], known)
    return multipliers


def _independent(rows: FloatArray, tolerance: float) -> tuple[tuple[FloatArray, FloatArray, NDArray[np.intp]], int]:
    """Q, R and the order of a QR decomposition of rows (m, n), the most independent first; and how many there are."""
    if not len(rows):
        return (np.zeros((rows.shape[1], 0)), np.zeros((0, 0)), np.zeros(0, dtype=np.intp)), 0
    *factors, order = qr(rows.T, mode="economic", pivoting=True)
    basis, triangle = (np.asarray(factor, dtype=np.float64) for factor in factors)
    return (basis, triangle, order.astype(np.intp)), int((np.abs(np.diag(triangle)) > tolerance).sum())


def _evaluated(program: NonlinearProgram, z: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows and variables (r + n,), their Jacobian (r + n, n), the objective's gradient (n,)."""
    everything = ca.vertcat(program.g, program.x)
    evaluate = ca.Function(
        "at", [program.x], [everything, ca.jacobian(everything, program.x), ca.gradient(program.f, program.x)]
    )
    values, jacobian, gradient = (as_array(part) for part in evaluate(z))
    return values.ravel(), jacobian, gradient.ravel()


def _bounds(program: NonlinearProgram, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    pairs = zip(program.row_bounds(), program.bounds_near(z), strict=True)
    lower, upper = (np.concatenate(pair) for pair in pairs)
    return lower, upper
