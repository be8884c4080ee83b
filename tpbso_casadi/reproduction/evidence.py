"""The evidence by which the claims of the paper are judged."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign import Record, Run
from tpbso_casadi.campaign.statistics import Summary, summarise
from tpbso_casadi.reproduction.experiment import BASES, label
from tpbso_casadi.reproduction.paper import NAMES

CONVERGENCE_TOLERANCE = 0.01  # a search has converged when its best cost is within 1 % of its last
NEAR_BEST_KNOWN = 0.10  # a search has arrived when its best cost is within 10 % of the best known objective
CostHistory: TypeAlias = Sequence[float | None]  # the best cost after each iteration, None where it is not finite


@dataclass(frozen=True)
class Evidence:
    """Results of all runs and measurements of a reproduction.

    Attributes:
        runs: all of the reproduction.
        records: of those that were done.
        convergence: by case and basis, after how many iterations each run of TPBSO had converged, and of how many.
        distances: by path case and basis, the largest distance from a given point in each run of TPBSO, m.
        histories: of each run, by case, solver (of the paper's three) and basis.
        scaling: of time and memory, see :func:`tpbso_casadi.reproduction.scaling.measure_scaling`.
        pace: s, by basis, case and solver, see :func:`tpbso_casadi.reproduction.pace.measure_pace`.
    """

    runs: list[Run]
    records: list[Record]
    convergence: dict[tuple[str, str], list[tuple[int, int]]]
    distances: dict[tuple[str, str], list[float]]
    histories: Mapping[tuple[str, str, str], list[CostHistory]]
    scaling: dict[str, Any]
    pace: dict[str, dict[str, dict[str, list[float]]]]

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

    @cached_property
    def fewest_runs(self) -> int:
        """Of any of the paper's three solvers on any case and basis."""
        labels = {label(solver, basis) for solver in NAMES for basis in BASES}
        return min(summary.objectives.size for (_, solver), summary in self.summaries.items() if solver in labels)

    def arrivals(self, case: str, solver: str, basis: str) -> FloatArray:
        """The share of each search after which its best cost was near the best known, (runs,); inf where never."""
        near = self.best_known(case) * (1.0 + NEAR_BEST_KNOWN)
        return np.array([arrival(history, near) for history in self.histories[case, solver, basis]], dtype=np.float64)

    def pace_ratios(self, rival: str, basis: str) -> list[float]:
        """A rival's time over that of TPBSO, geometric mean over the cases, in each round of the measurement."""
        ratios = [np.array(seconds[rival]) / np.array(seconds["bso"]) for seconds in self.pace[basis].values()]
        return [float(ratio) for ratio in np.exp(np.mean(np.log(ratios), axis=0))]


def arrival(history: CostHistory, near: float) -> float:
    """The share of a search after which its best cost was at most ``near``; inf where it never was."""
    there = np.array(history, dtype=np.float64) <= near
    return float(np.argmax(there)) / max(there.size - 1, 1) if there.any() else float("inf")


def convergence_iteration(history: CostHistory, objective_upper_bound: float) -> tuple[int, int] | None:
    """After how many iterations a search had converged, and of how many; None without a feasible plan.

    Args:
        history: the best cost after each iteration, the initial population first; None where it is not finite.
        objective_upper_bound: that no feasible cost exceeds.
    """
    cost = np.array(history, dtype=np.float64)
    if not cost[-1] <= objective_upper_bound:
        return None
    return int(np.argmax(cost <= cost[-1] * (1.0 + CONVERGENCE_TOLERANCE))), len(cost) - 1
