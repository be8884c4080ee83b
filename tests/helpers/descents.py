"""Solutions of descents that never ran."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from solvers import Solution, StopReason

CONVERGED = Solution(
    x=np.zeros(1), objective=0.0, status="Solve_Succeeded", stop_reason=StopReason.CONVERGED, iterations=1,
    evaluations=1, seconds=0.0, row_multipliers=np.empty(0), bound_multipliers=np.zeros(1), residuals={},
)  # fmt: skip


def solution_at(x: np.ndarray, objective: float) -> Solution:
    """One that has converged at x (d,) after one evaluation."""
    return replace(CONVERGED, x=x, objective=objective)
