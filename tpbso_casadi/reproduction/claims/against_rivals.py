"""Rules on what TPBSO finds against what PSO and GA find: means, spread, robustness, speed of convergence."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import levene

from tpbso_casadi.campaign.statistics import (
    SIGNIFICANCE_LEVEL,
    Comparison,
    Judgement,
    Relation,
    compare_summaries,
    judge,
    rank_sum,
    smallest_p,
)
from tpbso_casadi.reproduction.claims.finding import ClaimOutcome, Finding, Rule, finding, percent
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.paper import NAMES, PATHS, RIVALS, TABLE_1
from tpbso_casadi.scenario.cases.builtin import TITLES

CLOSE_MEANS = 0.05  # largest relative difference of two means that are "close"


def against(evidence: Evidence, cases: Sequence[str], basis: str, rivals: Sequence[str] = RIVALS) -> list[Judgement]:
    """TPBSO against each rival on each case, as one family of tests."""
    return judge(
        [
            compare_summaries(evidence.of(case, "bso", basis), evidence.of(case, rival, basis))
            for case in cases
            for rival in rivals
        ]
    )


def counts(judgements: Sequence[Judgement]) -> tuple[int, int]:
    """In how many TPBSO is significantly better, and in how many significantly worse."""
    relations = [judgement.relation for judgement in judgements]
    return relations.count(Relation.BETTER), relations.count(Relation.WORSE)


def best_mean(cases: Sequence[str]) -> Rule:
    """TPBSO ranks first everywhere, and at least half of the differences are statistically significant."""

    def decide(evidence: Evidence, basis: str) -> Finding:
        judgements = against(evidence, cases, basis)
        ahead = sum(judgement.comparison.ahead for judgement in judgements)
        better, worse = counts(judgements)
        total = len(judgements)
        words = f"ahead in {ahead} of {total} comparisons; significantly better in {better}, worse in {worse}"
        return finding(ahead == total and 2 * better >= total, words)

    return decide


def mean_ratios(evidence: Evidence, rival: str, cases: Sequence[str], basis: str) -> list[float]:
    """A rival's mean over TPBSO's, case by case."""
    return [evidence.of(case, rival, basis).mean / evidence.of(case, "bso", basis).mean for case in cases]


def close_in_some_poor_in_others(rival: str, close: Sequence[str], poor: Sequence[str]) -> Rule:
    """A rival is as good as TPBSO in some cases and clearly worse in most of some others."""

    def decide(evidence: Evidence, basis: str) -> Finding:
        in_close, in_poor = (mean_ratios(evidence, rival, cases, basis) for cases in (close, poor))
        close_words, poor_words = (", ".join(percent(r - 1.0, "+") for r in ratios) for ratios in (in_close, in_poor))
        holds = all(ratio <= 1.0 + CLOSE_MEANS for ratio in in_close)
        clearly_worse = sum(not ratio <= 1.0 + CLOSE_MEANS for ratio in in_poor)
        words = f"its mean against TPBSO's: {close_words} where it is said to be close; {poor_words} where poor"
        return finding(holds and 2 * clearly_worse > len(in_poor), words)

    return decide


def lower_spread(evidence: Evidence, basis: str) -> Finding:
    """TPBSO has the smallest standard deviation in each column of Table 1."""
    pairs = [(evidence.of(case, "bso", basis), evidence.of(case, rival, basis)) for case in PATHS for rival in RIVALS]
    smaller = [(a.feasible_objectives, b.feasible_objectives) for a, b in pairs if a.std < b.std]
    significant = sum(bool(levene(*samples).pvalue < SIGNIFICANCE_LEVEL) for samples in smaller)
    words = (
        f"smaller in {len(smaller)} of 8 comparisons, significantly in {significant} (Brown and Forsythe, uncorrected)"
    )
    return finding(len(smaller) == 8, words)


def numbers_of_table_1(evidence: Evidence, basis: str) -> Finding:
    """Geometry and limits are not published."""
    differences = [evidence.of(case, "bso", basis).mean / TABLE_1[case]["bso"].mean - 1.0 for case in PATHS]
    words = ", ".join(percent(difference, "+") for difference in differences)
    return Finding(
        ClaimOutcome.NOT_TESTABLE,
        f"the paper prints neither the paths' geometry nor the robot's lengths and limits; ours were chosen so that "
        f"these means come near (TPBSO: {words} off)",
    )


def robust(evidence: Evidence, basis: str) -> Finding:
    """TPBSO ends without a plan no more often than either rival, and its plans vary no more in half of the cases."""
    without_plan = {
        solver: sum(evidence.of(case, solver, basis).infeasible for case in TITLES) for solver in ("bso", *RIVALS)
    }
    smaller = sum(
        evidence.of(case, "bso", basis).interquartile_range <= evidence.of(case, rival, basis).interquartile_range
        for case in TITLES
        for rival in RIVALS
    )
    total = len(TITLES) * len(RIVALS)
    counted = ", ".join(f"{NAMES[solver]} {count}" for solver, count in without_plan.items())
    holds = all(without_plan["bso"] <= without_plan[rival] for rival in RIVALS) and 2 * smaller >= total
    return finding(holds, f"runs without a plan: {counted}; no larger interquartile range in {smaller} of {total}")


def sooner(evidence: Evidence, basis: str) -> Finding:
    """TPBSO comes near the best known after a smaller share of the search than its rivals, more often than not."""
    judgements = judge([_sooner(evidence, case, rival, basis) for case in TITLES for rival in RIVALS])
    earlier, later = counts(judgements)
    arrived = {
        solver: float(np.mean(np.isfinite(np.concatenate([evidence.arrivals(case, solver, basis) for case in TITLES]))))
        for solver in ("bso", *RIVALS)
    }
    words = ", ".join(f"{NAMES[solver]} {percent(share)}" for solver, share in arrived.items())
    return finding(
        earlier > later,
        f"significantly sooner in {earlier} of {len(judgements)} comparisons, later in {later}; runs that "
        f"come so near at all: {words}",
    )


def _sooner(evidence: Evidence, case: str, rival: str, basis: str) -> Comparison:
    ours, theirs = (evidence.arrivals(case, solver, basis) for solver in ("bso", rival))
    a12, p = rank_sum(ours, theirs)
    return Comparison(
        case=case,
        solver="bso",
        other=rival,
        ahead=a12 > 0.5,
        a12=a12,
        p=p,
        smallest_p=smallest_p(ours.size, theirs.size),
    )
