"""Everything that the claims of the paper are held against."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from tpbso_casadi.campaign import Record, Run
from tpbso_casadi.campaign.statistics import Summary, summarise
from tpbso_casadi.reproduction.experiment import label

SETTLED = 0.01  # a search has converged when it is within 1 % of where it ends


@dataclass(frozen=True)
class Evidence:
    """What the runs and the measurements say.

    Attributes:
        runs: all of the reproduction.
        records: what is kept of those that were done.
        settled: by case and basis, after how many iterations each run of TPBSO had converged, and of how many.
        accuracy: by path case and basis, the largest distance in m from a given point that any run of TPBSO has.
        growth: of time and memory, see :func:`tpbso_casadi.reproduction.scaling.measured`.
    """

    runs: list[Run]
    records: list[Record]
    settled: dict[tuple[str, str], list[tuple[int, int]]]
    accuracy: dict[tuple[str, str], float]
    growth: dict[str, Any]

    @cached_property
    def summaries(self) -> dict[tuple[str, str], Summary]:
        """By case and arm."""
        return {(summary.case, summary.solver): summary for summary in summarise(self.records)}

    def of(self, case: str, solver: str, basis: str) -> Summary:
        """The runs of a solver.

        Raises:
            KeyError: there are none.
        """
        return self.summaries[case, label(solver, basis)]

    def best_known(self, case: str) -> float:
        """The lowest objective of any feasible plan of any arm; NaN where there is none."""
        found = [s.best for (of, _), s in self.summaries.items() if of == case and np.isfinite(s.best)]
        return min(found, default=float("nan"))


def settled_after(result: dict[str, Any], objective_upper_bound: float) -> tuple[int, int] | None:
    """After how many iterations the cost was within 1 % of the last, and of how many; None without a feasible plan."""
    cost = np.array(result["history"]["cost"], dtype=np.float64)
    if not cost[-1] <= objective_upper_bound:
        return None
    return int(np.argmax(cost <= cost[-1] * (1.0 + SETTLED))), len(cost) - 1
