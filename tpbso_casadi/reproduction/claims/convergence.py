"""Rules on how TPBSO converges: how near the best known, and after how many iterations."""

from __future__ import annotations

import numpy as np

from tpbso_casadi.reproduction.claims.finding import Finding, finding, percent
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.paper import PATHS, POINT_TO_POINT, ROTATION

CONVERGED_GAP = 0.10  # of the best known: largest relative gap of a median that "converges well"
FEW_ITERATIONS = 0.10  # of all iterations: "very small"
SIMILAR_RATIO = 1.5  # of two numbers of iterations that do "not differ too much"


def converges(evidence: Evidence, basis: str) -> Finding:
    """Every run ends with a plan, and the median is near the best known, with two to five links."""
    summaries = {case: evidence.of(case, "bso", basis) for case in POINT_TO_POINT}
    without_plan = sum(summary.infeasible for summary in summaries.values())
    gaps = {case: summary.median / evidence.best_known(case) - 1.0 for case, summary in summaries.items()}
    words = ", ".join(f"{case} {percent(gap)}" for case, gap in gaps.items())
    holds = without_plan == 0 and max(gaps.values()) <= CONVERGED_GAP
    return finding(holds, f"{without_plan} runs without a plan; medians above the best known: {words}")


def convergence_share(evidence: Evidence, case: str, basis: str) -> float:
    """The median share of its iterations after which TPBSO had converged; NaN without a plan."""
    shares = [iteration / total for iteration, total in evidence.convergence[case, basis]]
    return float(np.median(shares)) if shares else float("nan")


def few_iterations_with_two_links(evidence: Evidence, basis: str) -> Finding:
    """Least rotation with two links converges first, in a tenth of the iterations."""
    shares = [convergence_share(evidence, case, basis) for case in ROTATION]
    words = "within 1 % of the end after " + ", ".join(percent(share) for share in shares)
    holds = shares[0] <= FEW_ITERATIONS and not any(share < shares[0] for share in shares[1:])
    return finding(holds, f"{words} of the iterations with 2, 3, 4, 5 links (medians)")


def similar_convergence_along_paths(evidence: Evidence, basis: str) -> Finding:
    """Along the two paths the numbers of iterations to convergence are similar."""
    shares = {case: convergence_share(evidence, case, basis) for case in PATHS}
    objectives = ("time", "rotation")
    pairs = [(shares[f"pentagram-{name}"], shares[f"closed-curve-{name}"]) for name in objectives]
    words = "; ".join(
        f"{name} {percent(star)} and {percent(curve)}" for name, (star, curve) in zip(objectives, pairs, strict=True)
    )
    holds = all(max(pair) <= SIMILAR_RATIO * min(pair) for pair in pairs)
    return finding(holds, f"of the iterations, pentagram and closed curve: {words} (medians)")
