"""What the gaps of a campaign are measured from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.quantiles import gap
from tpbso_casadi.campaign.statistics import Summary


def references(summaries: Sequence[Summary]) -> dict[str, float | None]:
    """By case the lowest objective: where it is known that of all, else that of a certified plan of any solver.

    None where there is no plan.
    """
    plans: dict[str, list[float]] = {summary.case: [] for summary in summaries}
    known = {summary.case: summary.measure.known for summary in summaries}
    for summary in summaries:
        plans[summary.case] += summary.feasible_objectives.tolist()
    lowest = {case: min(objectives, default=None) for case, objectives in plans.items()}
    return {case: value if value is None or known[case] is None else known[case] for case, value in lowest.items()}


def gaps_of(objectives: FloatArray, reference: float | None) -> FloatArray:
    """The gaps of objectives; inf where there is no plan at all."""
    return np.full(np.shape(objectives), np.inf) if reference is None else gap(objectives, reference)
