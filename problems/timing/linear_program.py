"""A sparse linear program, by HiGHS: dual simplex, and the interior-point method where that fails."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import csr_array

from problems.base.matrix import FloatArray

METHODS = ("highs-ds", "highs-ipm")
PRIMAL_TOLERANCE, DUAL_TOLERANCE = 1e-10, 1e-9  # HiGHS allows no smaller one than 1e-10


def minimizer(costs: FloatArray, matrix: csr_array, bound: FloatArray, box: FloatArray) -> FloatArray | None:
    """Minimise ``costs @ x`` subject to ``matrix @ x <= bound`` and the box; None where no method can.

    Args:
        costs: (n,).
        matrix: (rows, n).
        bound: (rows,).
        box: lower and upper bounds of x, (n, 2).
    """
    options = {"primal_feasibility_tolerance": PRIMAL_TOLERANCE, "dual_feasibility_tolerance": DUAL_TOLERANCE}
    for method in METHODS:
        result = linprog(costs, matrix, bound, bounds=box, method=method, options=options)  # type: ignore[call-overload]
        if result.status == 0:
            return np.asarray(result.x, dtype=np.float64)
    return None
