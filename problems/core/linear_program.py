"""Programs of control points and a change of the duration by the core, linear ones by HiGHS as well."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core.compiled import core, found_core
from problems.core.rows import ProgramData

METHODS = ("highs-ds", "highs-ipm")
PRIMAL_TOLERANCE, DUAL_TOLERANCE = 1e-10, 1e-9  # HiGHS allows no smaller one than 1e-10


def minimizer(
    costs: FloatArray, matrix: scipy.sparse.csr_array, bound: FloatArray, box: FloatArray
) -> FloatArray | None:
    """The minimum of ``costs @ x`` subject to ``matrix @ x <= bound`` and the box; None where no method finds it.

    Args:
        costs: (n,).
        matrix: (rows, n).
        bound: (rows,).
        box: lower and upper bounds of x, (n, 2).
    """
    options = {"primal_feasibility_tolerance": PRIMAL_TOLERANCE, "dual_feasibility_tolerance": DUAL_TOLERANCE}
    for method in METHODS:
        result = scipy.optimize.linprog(costs, matrix, bound, bounds=box, method=method, options=options)  # type: ignore[call-overload]
        if result.status == 0:
            return np.asarray(result.x, dtype=np.float64)
    return None


@dataclass(frozen=True, eq=False)
class LinearProgram(ProgramData):
    """A program that the core's interior-point method solves, using which unknowns rows touch; HiGHS without a core."""

    def solved(self) -> tuple[FloatArray, float] | None:
        """Control points (n, k) and tau; None where nothing was found."""
        if found_core() is None and self.squares is None:
            return self.by_highs()
        return core().solve_program(self)

    def by_highs(self) -> tuple[FloatArray, float] | None:
        """The solution by HiGHS, accurate to each number, not to a share of the sum; where it is linear."""
        n, k = self.lower.shape
        one, all_ = self.single, self.whole
        wide, first, soft = one.weights.shape[1], n * k, np.flatnonzero(np.isfinite(all_.price))
        width = first + 1 + soft.size
        rows, columns, values = [], [], []

        def put(row: NDArray[np.intp], point: NDArray[np.intp], joint: NDArray[np.intp], value: FloatArray) -> None:
            kept = (point >= 0) & (point < n)
            rows.append(row[kept])
            columns.append((point * k + joint)[kept])
            values.append(value[kept])

        m, p = len(one.bound), len(all_.bound)
        steps = np.arange(wide)
        put(
            np.repeat(np.arange(m), wide), (one.first[:, None] + steps).ravel(), np.repeat(one.joint, wide),
            one.weights.ravel(),
        )  # fmt: skip
        points = np.broadcast_to((all_.first[:, None] + steps)[:, :, None], (p, wide, k)).ravel()
        put(np.repeat(m + np.arange(p), wide * k), points, np.tile(np.arange(k), p * wide), all_.weights.ravel())
        rows += [np.arange(m + p), m + soft]
        columns += [np.full(m + p, first), first + 1 + np.arange(soft.size)]
        values += [np.concatenate([one.by_time, all_.by_time]), np.full(soft.size, -1.0)]
        matrix = scipy.sparse.csr_array(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=(m + p, width)
        )
        costs = np.concatenate([
            np.zeros(first) if self.cost is None else self.cost.ravel(), [self.time_cost],
            all_.price[soft],
        ])  # fmt: skip
        box = np.concatenate([
            np.column_stack([self.lower.ravel(), self.upper.ravel()]), [self.times],
            np.column_stack([np.zeros(soft.size), np.full(soft.size, np.inf)]),
        ])  # fmt: skip
        found = minimizer(costs, matrix, np.concatenate([one.bound, all_.bound]), box)
        return None if found is None else (found[:first].reshape(n, k), float(found[first]))
