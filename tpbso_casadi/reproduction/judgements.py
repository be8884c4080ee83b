"""Judgements on claims: each by what was measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, TypeAlias

import numpy as np
from scipy.stats import levene, quantile_test

from tpbso_casadi.judging.statistics import (
    SIGNIFICANCE_LEVEL,
    Judgement,
    PairComparison,
    Relation,
    compare_summaries,
    judge,
    rank_sum,
    smallest_p,
)
from tpbso_casadi.reproduction.experiment import (
    NAMES,
    OBSTACLES,
    PATHS,
    PENTAGRAM,
    POINT_TO_POINT,
    RIVALS,
    ROTATION,
    TABLE_1,
    Evidence,
    Order,
)
from tpbso_casadi.scenario import TITLES, builtin


class ClaimOutcome(StrEnum):
    """Whether a claim could be reproduced."""

    REPRODUCED = "reproduced"
    NOT_REPRODUCED = "not reproduced"
    NOT_TESTABLE = "not testable"  # by anyone: the paper does not print what it would take
    NOT_JUDGED = "not judged"  # by these runs or measurements: too few, or too close to tell


@dataclass(frozen=True)
class Finding:
    """The outcome of a claim on one basis, and the evidence in words."""

    outcome: ClaimOutcome
    evidence: str


Rule: TypeAlias = Callable[[Evidence, str], Finding]  # of the evidence and a basis of comparison


def finding(holds: bool, evidence: str) -> Finding:
    """The finding that a claim is reproduced, or not."""
    return Finding(ClaimOutcome.REPRODUCED if holds else ClaimOutcome.NOT_REPRODUCED, evidence)


def percent(share: float, sign: str = "") -> str:
    """A share as a percentage; "(no plan)" where it is not finite."""
    return f"{round(100.0 * share):{sign}d} %" if np.isfinite(share) else "(no plan)"


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
    """The numbers of comparisons in which TPBSO is significantly better, and significantly worse."""
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


def _sooner(evidence: Evidence, case: str, rival: str, basis: str) -> PairComparison:
    ours, theirs = (evidence.arrivals(case, solver, basis) for solver in ("bso", rival))
    a12, p = rank_sum(ours, theirs)
    return PairComparison(
        case=case,
        solver="bso",
        other=rival,
        ahead=a12 > 0.5,
        a12=a12,
        p=p,
        smallest_p=smallest_p(ours.size, theirs.size),
    )


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


EXPONENT_TOLERANCE = 0.2  # by which a measured exponent may exceed the printed one
PACE_MARGIN = 0.1  # of a solver's time: a smaller difference is no difference
CONFIDENCE = 0.95


def grows_as(kind: str, orders: dict[str, Order]) -> Rule:
    """No measured exponent of growth exceeds the printed one.

    Args:
        kind: "time" or "space".
        orders: as printed, by experiment.
    """

    def decide(evidence: Evidence, basis: str) -> Finding:
        if not evidence.scaling[kind]:
            return Finding(ClaimOutcome.NOT_JUDGED, "not measured in a quick run, or on this system")
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
        if any(set(row) < set(NAMES) for symbols in evidence.scaling[kind].values() for row in symbols.values()):
            return Finding(ClaimOutcome.NOT_JUDGED, f"one solver measured, once; {words}")
        return finding(above == 0, words)

    return decide


def fast(evidence: Evidence, basis: str) -> Finding:
    """TPBSO takes no longer than its rivals, but for a margin."""
    intervals = {rival: interval(evidence.pace_ratios(rival, basis)) for rival in RIVALS}
    middles = ", ".join(
        f"{NAMES[rival]} {middle:.2f} ({low:.2f} to {high:.2f})" for rival, (low, middle, high) in intervals.items()
    )
    words = f"time of the others over that of TPBSO: {middles}; medians and their 95 % intervals"
    least = 1.0 - PACE_MARGIN
    if any(high < least for _, _, high in intervals.values()):
        return finding(False, words)
    if all(low >= least for low, _, _ in intervals.values()):
        return finding(True, words)
    return Finding(ClaimOutcome.NOT_JUDGED, f"too few or too noisy measurements; {words}")


def interval(values: Sequence[float]) -> tuple[float, float, float]:
    """The median between the limits of its 95 % confidence interval; from 0 to inf for too few values."""
    test: Any = quantile_test(values, p=0.5)
    low, high = test.confidence_interval(CONFIDENCE)
    return float(np.nan_to_num(low, nan=0.0)), float(np.median(values)), float(np.nan_to_num(high, nan=np.inf))
