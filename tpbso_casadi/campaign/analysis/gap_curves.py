"""The gap of a solver to the best plan over evaluations: its median run, and the quartiles of its runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.quantiles import quantile
from tpbso_casadi.campaign.analysis.references import gaps_of
from tpbso_casadi.campaign.analysis.results import Results

GRID = 240  # numbers of evaluations at which quartiles are computed
FEWEST_FOR_QUARTILES = 4  # runs; fewer have a median alone


@dataclass(frozen=True, kw_only=True)
class GapCurve:
    """The runs of one solver on one case.

    Attributes:
        end: evaluations of its longest run.
        evaluations: up to the end of the longest run of any solver, (n,).
        lower: quartile of the gaps, (n,), inf where that run has no plan.
        median: likewise.
        upper: likewise.
    """

    end: int
    evaluations: FloatArray
    lower: FloatArray
    median: FloatArray
    upper: FloatArray


def gap_curve(results: Results, case: str, solver: str) -> GapCurve:
    """The curve of one solver; a run without a plan, or without one yet, is infinitely far from the best."""
    longest = max(run.done for run in results.convergences if run.case == case)
    evaluations = np.geomspace(1.0, max(2, longest), GRID)
    runs = results.runs_of(solver, case)
    gaps = gaps_of(np.array([run.at(evaluations) for run in runs]), results.references[case])
    shares = (0.25, 0.5, 0.75) if len(runs) >= FEWEST_FOR_QUARTILES else (0.5, 0.5, 0.5)
    lower, median, upper = (quantile(gaps, share) for share in shares)
    return GapCurve(end=max(run.done for run in runs), evaluations=evaluations, lower=lower, median=median, upper=upper)
