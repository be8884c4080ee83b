"""The rules by which evidence decides a claim of the paper: each gives a finding on one basis."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import comb
from typing import TypeAlias

import numpy as np
from scipy.stats import levene

from tpbso_casadi.campaign.statistics import SIGNIFICANCE_LEVEL, Comparison, compare_summaries, holm
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.paper import (
    NAMES,
    OBSTACLES,
    PATHS,
    POINT_TO_POINT,
    RIVALS,
    ROTATION,
    TABLE_1,
    Order,
)

CLOSE_MEANS = 0.05  # largest relative difference of two means that are "close"
CONVERGED_GAP = 0.10  # of the best known: largest relative gap of a median that "converges well"
FEW_ITERATIONS = 0.10  # of all iterations: "very small"
SIMILAR_RATIO = 1.5  # of two numbers of iterations that do "not differ too much"
EXPONENT_TOLERANCE = 0.2  # by which a measured exponent may exceed the printed one


class ClaimOutcome(StrEnum):
    """Whether a claim could be reproduced."""

    REPRODUCED = "reproduced"
    NOT_REPRODUCED = "not reproduced"
    NOT_TESTABLE = "not testable"


@dataclass(frozen=True)
class Finding:
    """The outcome of a claim on one basis, and the evidence in words."""

    outcome: ClaimOutcome
    evidence: str


Rule: TypeAlias = Callable[[Evidence, str], Finding]  # of the evidence and a basis of comparison


def finding(holds: bool, evidence: str) -> Finding:
    """Reproduced or not."""
    return Finding(ClaimOutcome.REPRODUCED if holds else ClaimOutcome.NOT_REPRODUCED, evidence)


def percent(share: float, sign: str = "") -> str:
    """A share as a percentage; "(no plan)" where it is not finite."""
    return f"{100.0 * share:{sign}.0f} %" if np.isfinite(share) else "(no plan)"


def against(
    evidence: Evidence, cases: Sequence[str], basis: str, rivals: Sequence[str] = RIVALS
) -> list[tuple[Comparison, float]]:
    """TPBSO against each rival on each case, with p after Holm's correction over all of them."""
    comparisons = [
        compare_summaries(evidence.of(case, "bso", basis), evidence.of(case, rival, basis))
        for case in cases
        for rival in rivals
    ]
    return list(zip(comparisons, holm([comparison.p for comparison in comparisons]), strict=True))


def best_mean(cases: Sequence[str]) -> Rule:
    """TPBSO ranks first everywhere, and at least half of the differences are statistically significant."""

    def judge(evidence: Evidence, basis: str) -> Finding:
        comparisons = against(evidence, cases, basis)
        ahead = sum(comparison.ahead for comparison, _ in comparisons)
        relations = [comparison.relation(p) for comparison, p in comparisons]
        better, worse = relations.count("better"), relations.count("worse")
        counts = (
            f"ahead in {ahead} of {len(comparisons)} comparisons; significantly better in {better}, worse in {worse}"
        )
        runs = evidence.of(cases[0], "bso", basis).objectives.size
        if len(comparisons) * smallest_p(runs) > SIGNIFICANCE_LEVEL:
            return Finding(ClaimOutcome.NOT_TESTABLE, f"{runs} runs are too few for any test; {counts}")
        return finding(ahead == len(comparisons) and 2 * better >= len(comparisons), counts)

    return judge


def smallest_p(runs: int) -> float:
    """The smallest p that a two-sided rank-sum test of so many runs against as many can give."""
    return 2.0 / comb(2 * runs, runs)


def mean_ratios(evidence: Evidence, rival: str, cases: Sequence[str], basis: str) -> list[float]:
    """A rival's mean over TPBSO's, case by case."""
    return [evidence.of(case, rival, basis).mean / evidence.of(case, "bso", basis).mean for case in cases]


def close_in_some_poor_in_others(rival: str, close: Sequence[str], poor: Sequence[str]) -> Rule:
    """A rival is as good as TPBSO in some cases and clearly worse in most of some others."""

    def judge(evidence: Evidence, basis: str) -> Finding:
        in_close, in_poor = (mean_ratios(evidence, rival, cases, basis) for cases in (close, poor))
        close_words, poor_words = (", ".join(percent(r - 1.0, "+") for r in ratios) for ratios in (in_close, in_poor))
        holds = all(ratio <= 1.0 + CLOSE_MEANS for ratio in in_close)
        clearly_worse = sum(not ratio <= 1.0 + CLOSE_MEANS for ratio in in_poor)
        words = f"its mean against TPBSO's: {close_words} where it is said to be close; {poor_words} where poor"
        return finding(holds and 2 * clearly_worse > len(in_poor), words)

    return judge


def lower_spread(evidence: Evidence, basis: str) -> Finding:
    """TPBSO has the smallest standard deviation in each column of Table 1."""
    pairs = [(evidence.of(case, "bso", basis), evidence.of(case, rival, basis)) for case in PATHS for rival in RIVALS]
    smaller = [(a.feasible_objectives, b.feasible_objectives) for a, b in pairs if a.std < b.std]
    significant = sum(bool(levene(*samples).pvalue < SIGNIFICANCE_LEVEL) for samples in smaller)
    words = (
        f"smaller in {len(smaller)} of 8 comparisons, significantly in {significant} (Brown and Forsythe, uncorrected)"
    )
    return finding(len(smaller) == 8, words)


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


def avoids_obstacle(evidence: Evidence, basis: str) -> Finding:
    """The median run of each case is proven clear of the obstacle for all t."""
    summaries = [evidence.of(case, "bso", basis) for case in OBSTACLES]
    without_plan = {summary.case: summary.infeasible for summary in summaries if summary.infeasible}
    runs = sum(summary.objectives.size for summary in summaries)
    words = f"{runs - sum(without_plan.values())} of {runs} runs certified for all t"
    words += "".join(f"; {count} without a plan in {case}" for case, count in without_plan.items())
    return finding(all(np.isfinite(summary.median) for summary in summaries), words)


def follows_path(evidence: Evidence, basis: str) -> Finding:
    """Every run along a path keeps the accuracy."""
    runs = sum(evidence.of(case, "bso", basis).objectives.size for case in PATHS)
    without_plan = sum(evidence.of(case, "bso", basis).infeasible for case in PATHS)
    distances = ", ".join(f"{evidence.accuracy[case, basis]:.3f} m ({case})" for case in PATHS)
    words = f"{runs - without_plan} of {runs} runs keep 0.1 m; the largest distance from a given point: {distances}"
    return finding(without_plan == 0, words)


def numbers_of_table_1(evidence: Evidence, basis: str) -> Finding:
    """Geometry and limits are not published."""
    differences = [evidence.of(case, "bso", basis).mean / TABLE_1[case]["bso"].mean - 1.0 for case in PATHS]
    words = ", ".join(percent(difference, "+") for difference in differences)
    return Finding(
        ClaimOutcome.NOT_TESTABLE,
        f"the paper prints neither the paths' geometry nor the robot's lengths and limits; ours were chosen so that "
        f"these means come near (TPBSO: {words} off)",
    )


def grows_as(kind: str, orders: dict[str, Order]) -> Rule:
    """No measured exponent of growth exceeds the printed one.

    Args:
        kind: "time" or "space".
        orders: as printed, by experiment.
    """

    def judge(evidence: Evidence, basis: str) -> Finding:
        if not evidence.scaling[kind]:
            return Finding(ClaimOutcome.NOT_TESTABLE, "not measured in a quick run, or on this system")
        exponents = [
            (order.exponents[symbol], row["exponent"])
            for experiment, order in orders.items()
            for symbol, by_solver in evidence.scaling[kind][experiment].items()
            for row in by_solver.values()
        ]
        above = sum(measured > printed + EXPONENT_TOLERANCE for printed, measured in exponents)
        largest = max(measured - printed for printed, measured in exponents)
        words = (
            f"{len(exponents) - above} of {len(exponents)} measured exponents are at most {EXPONENT_TOLERANCE} above "
            f"the printed ones (largest excess {largest:+.2f})"
        )
        return finding(above == 0, words)

    return judge


def fastest(evidence: Evidence, basis: str) -> Finding:
    """TPBSO takes no longer than its rivals."""
    seconds = evidence.scaling["pace"][basis]
    words = ", ".join(f"{NAMES[solver]} {seconds[solver] / seconds['bso']:.2f}" for solver in RIVALS)
    holds = all(seconds["bso"] <= seconds[rival] for rival in RIVALS)
    return finding(holds, f"time of the others over that of TPBSO: {words} (least time, 3 links)")
