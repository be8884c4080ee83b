"""Rules on what TPBSO's plans keep to: the obstacle and the given points."""

from __future__ import annotations

from typing import Any

import numpy as np

from tpbso_casadi.reproduction.claims.finding import Finding, finding
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.paper import OBSTACLES, PATHS, PENTAGRAM
from tpbso_casadi.scenario.cases.builtin import builtin

WELL_FOLLOWED = 0.02  # of the width of the path: a millimetre in a picture of five centimetres, about the line's width


def avoids_obstacle(evidence: Evidence, basis: str) -> Finding:
    """The median run of each case is proven clear of the obstacle for all t."""
    summaries = [evidence.of(case, "bso", basis) for case in OBSTACLES]
    without_plan = {summary.case: summary.infeasible for summary in summaries if summary.infeasible}
    runs = sum(summary.objectives.size for summary in summaries)
    words = f"{runs - sum(without_plan.values())} of {runs} runs certified for all t"
    words += "".join(f"; {count} without a plan in {case}" for case, count in without_plan.items())
    return finding(all(np.isfinite(summary.median) for summary in summaries), words)


def follows_path(evidence: Evidence, basis: str) -> Finding:
    """The median run along the pentagram passes every given point at less than what a picture shows."""
    medians = {case: float(np.median(evidence.distances[case, basis] or [np.inf])) for case in PATHS}
    shares = {case: median / path_width(case) for case, median in medians.items()}
    words = ", ".join(f"{medians[case]:.3f} m, {100.0 * share:.1f} % ({case})" for case, share in shares.items())
    runs = sum(evidence.of(case, "bso", basis).objectives.size for case in PATHS)
    without_plan = sum(evidence.of(case, "bso", basis).infeasible for case in PATHS)
    return finding(
        all(shares[case] <= WELL_FOLLOWED for case in PENTAGRAM),
        f"largest distance from a given point, and its share of the path's width: {words}; medians; "
        f"{runs - without_plan} of {runs} runs keep the accuracy of 0.1 m",
    )


def path_width(case: str) -> float:
    """The larger side of the box around the given points, m."""
    task: Any = builtin(case).task
    return float(np.ptp(task.path().array, axis=0).max())
