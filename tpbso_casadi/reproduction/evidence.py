"""The evidence by which the claims of the paper are judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tpbso_casadi.campaign import Record, Run
from tpbso_casadi.campaign.statistics import Summary, summarise
from tpbso_casadi.reproduction.experiment import label

CONVERGENCE_TOLERANCE = 0.01  # a search has converged when its best cost is within 1 % of its last


@dataclass(frozen=True)
class Evidence:
    """Results of all runs and measurements of a reproduction.

    Attributes:
        runs: all of the reproduction.
        records: of those that were done.
        convergence: by case and basis, after how many iterations each run of TPBSO had converged, and of how many.
        accuracy: by path case and basis, the largest distance in m from a given point in any run of TPBSO.
        scaling: of time and memory, see :func:`tpbso_casadi.reproduction.scaling.measure_scaling`.
    """

    runs: list[Run]
    records: list[Record]
    convergence: dict[tuple[str, str], list[tuple[int, int]]]
    accuracy: dict[tuple[str, str], float]
    scaling: dict[str, Any]

    @cached_property
    def summaries(self) -> dict[tuple[str, str], Summary]:
        """By case and label of the solver."""
        return {(summary.case, summary.solver): summary for summary in summarise(self.records)}

    def of(self, case: str, solver: str, basis: str) -> Summary:
        """The runs of a solver.

        Raises:
            KeyError: there are none.
        """
        return self.summaries[case, label(solver, basis)]

    def best_known(self, case: str) -> float:
        """The lowest objective of any feasible plan of any solver; NaN where there is none."""
        lowest = [summary.best for (name, _), summary in self.summaries.items() if name == case]
        return min(filter(np.isfinite, lowest), default=float("nan"))


def convergence_iteration(history: Sequence[float | None], objective_upper_bound: float) -> tuple[int, int] | None:
    """After how many iterations a search had converged, and of how many; None without a feasible plan.

    Args:
        history: the best cost after each iteration, the initial population first; None where it is not finite.
        objective_upper_bound: that no feasible cost exceeds.
    """
    cost = np.array(history, dtype=np.float64)
    if not cost[-1] <= objective_upper_bound:
        return None
    return int(np.argmax(cost <= cost[-1] * (1.0 + CONVERGENCE_TOLERANCE))), len(cost) - 1
