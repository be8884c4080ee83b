"""The paper's claims, each with a rule that the evidence decides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import comb

import numpy as np
from scipy.stats import levene

from tpbso_casadi.campaign.statistics import LEVEL, Comparison, compared, holm
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import BASES
from tpbso_casadi.reproduction.paper import (
    NAMES,
    OBSTACLES,
    PATHS,
    POINT_TO_POINT,
    RIVALS,
    SPACE_ORDERS,
    TABLE_1,
    TIME_ORDERS,
    Order,
)

CLOSE = 0.05  # of two means: "close performance"
NEAR = 0.10  # of the best known: "converges well"
SOON = 0.10  # of the iterations: "very small"
ALIKE = 1.5  # ratio of two numbers of iterations: "does not differ too much"
SLACK = 0.2  # by which a measured exponent may be above the printed one
TIME = tuple(case for case in POINT_TO_POINT if case.startswith("time"))
ROTATION = tuple(case for case in POINT_TO_POINT if case.startswith("rotation"))


class Verdict(StrEnum):
    """What became of a claim."""

    REPRODUCED = "reproduced"
    NOT_REPRODUCED = "not reproduced"
    NOT_TESTABLE = "not testable"


@dataclass(frozen=True)
class Finding:
    """A verdict and what it rests on, in words."""

    verdict: Verdict
    evidence: str


@dataclass(frozen=True)
class Claim:
    """Something that the paper says.

    Attributes:
        where: in the paper.
        says: its words, or what they come to.
        rule: when we call it reproduced.
        judge: the evidence, on one basis.
        bases: on which it is judged; empty where it has nothing to do with them.
    """

    where: str
    says: str
    rule: str
    judge: Callable[[Evidence, str], Finding]
    bases: tuple[str, ...] = BASES

    def findings(self, evidence: Evidence) -> dict[str, Finding]:
        """By basis; under "" where there is none."""
        return {basis: self.judge(evidence, basis) for basis in self.bases or ("",)}


def finding(holds: bool, evidence: str) -> Finding:
    """Reproduced or not."""
    return Finding(Verdict.REPRODUCED if holds else Verdict.NOT_REPRODUCED, evidence)


def percent(share: float, sign: str = "") -> str:
    """A share in words."""
    return f"{100.0 * share:{sign}.0f} %" if np.isfinite(share) else "(no plan)"


def against(
    evidence: Evidence, cases: Sequence[str], basis: str, rivals: Sequence[str] = RIVALS
) -> list[tuple[Comparison, float]]:
    """TPBSO against each rival on each case, with p after Holm's correction over all of them."""
    pairs = [
        compared(evidence.of(case, "bso", basis), evidence.of(case, rival, basis)) for case in cases for rival in rivals
    ]
    return list(zip(pairs, holm([pair.p for pair in pairs]), strict=True))


def best(cases: Sequence[str]) -> Callable[[Evidence, str], Finding]:
    """TPBSO has the best mean everywhere, and at least half of the differences are more than chance."""

    def judge(evidence: Evidence, basis: str) -> Finding:
        pairs = against(evidence, cases, basis)
        lower = sum(pair.lower for pair, _ in pairs)
        verdicts = [pair.verdict(p) for pair, p in pairs]
        better, worse = verdicts.count("better"), verdicts.count("worse")
        words = (
            f"ahead in {lower} of {len(pairs)} comparisons; by more than chance in {better}, behind by more than "
            f"chance in {worse}"
        )
        runs = evidence.of(cases[0], "bso", basis).objectives.size
        if len(pairs) * least_p(runs) > LEVEL:
            return Finding(Verdict.NOT_TESTABLE, f"{runs} runs are too few for any test; {words}")
        return finding(lower == len(pairs) and 2 * better >= len(pairs), words)

    return judge


def least_p(runs: int) -> float:
    """The smallest p that a two-sided rank-sum test of so many runs against as many can give."""
    return 2.0 / comb(2 * runs, runs)


def closeness(evidence: Evidence, rival: str, cases: Sequence[str], basis: str) -> tuple[list[bool], str]:
    """Where a rival's mean is at most 5 % above TPBSO's, and its ratios in words."""
    ratios = [evidence.of(case, rival, basis).mean / evidence.of(case, "bso", basis).mean for case in cases]
    return [ratio <= 1.0 + CLOSE for ratio in ratios], ", ".join(percent(ratio - 1.0, "+") for ratio in ratios)


def close_in_one_poor_in_other(rival: str, close: Sequence[str], poor: Sequence[str]) -> Callable[..., Finding]:
    """A rival is as good as TPBSO in some cases and clearly worse in most of some others."""

    def judge(evidence: Evidence, basis: str) -> Finding:
        near, near_words = closeness(evidence, rival, close, basis)
        far, far_words = closeness(evidence, rival, poor, basis)
        words = f"its mean against TPBSO's: {near_words} where it is said to be close; {far_words} where poor"
        return finding(all(near) and 2 * sum(not is_near for is_near in far) > len(far), words)

    return judge


def lower_spread(evidence: Evidence, basis: str) -> Finding:
    """TPBSO has the smallest standard deviation in each column of Table 1."""
    pairs = [(evidence.of(case, "bso", basis), evidence.of(case, rival, basis)) for case in PATHS for rival in RIVALS]
    smaller = [(ours.held, theirs.held) for ours, theirs in pairs if ours.std < theirs.std]
    lower, clear = len(smaller), sum(bool(levene(*both).pvalue < LEVEL) for both in smaller)
    words = f"smaller in {lower} of 8 comparisons, in {clear} by more than chance (Brown and Forsythe, uncorrected)"
    return finding(lower == 8, words)


def converges(evidence: Evidence, basis: str) -> Finding:
    """Every run ends with a plan, and the median is near the best known, with two to five links."""
    lost, gaps = 0, []
    for case in POINT_TO_POINT:
        ours = evidence.of(case, "bso", basis)
        lost += ours.infeasible
        gaps.append(ours.median / evidence.best_known(case) - 1.0)
    shown = ", ".join(f"{case} {percent(gap)}" for case, gap in zip(POINT_TO_POINT, gaps, strict=True))
    return finding(
        lost == 0 and max(gaps) <= NEAR, f"{lost} runs without a plan; medians above the best known: {shown}"
    )


def settles(evidence: Evidence, case: str, basis: str) -> float:
    """The median share of its iterations after which TPBSO had converged; NaN without a plan."""
    shares = [after / total for after, total in evidence.settled[case, basis]]
    return float(np.median(shares)) if shares else float("nan")


def soon_with_two_links(evidence: Evidence, basis: str) -> Finding:
    """Least rotation with two links converges soonest, in a tenth of the iterations."""
    shares = [settles(evidence, case, basis) for case in ROTATION]
    words = "within 1 % of the end after " + ", ".join(percent(share) for share in shares)
    holds = shares[0] <= SOON and not any(share < shares[0] for share in shares[1:])
    return finding(holds, f"{words} of the iterations with 2, 3, 4, 5 links (medians)")


def curves_settle_alike(evidence: Evidence, basis: str) -> Finding:
    """Along the two paths the numbers of iterations to convergence are much the same."""
    shares = {case: settles(evidence, case, basis) for case in PATHS}
    pairs = [(shares[f"pentagram-{what}"], shares[f"closed-curve-{what}"]) for what in ("time", "rotation")]
    words = "; ".join(
        f"{what} {percent(star)} and {percent(curve)}"
        for what, (star, curve) in zip(("time", "rotation"), pairs, strict=True)
    )
    holds = all(max(pair) <= ALIKE * min(pair) for pair in pairs)
    return finding(holds, f"of the iterations, pentagram and closed curve: {words} (medians)")


def avoids(evidence: Evidence, basis: str) -> Finding:
    """The median run of each case is proven clear of the obstacle for all t."""
    found = [evidence.of(case, "bso", basis) for case in OBSTACLES]
    lost = {summary.case: summary.infeasible for summary in found if summary.infeasible}
    runs = sum(summary.objectives.size for summary in found)
    words = f"{runs - sum(lost.values())} of {runs} runs certified for all t"
    words += "".join(f"; {count} lost in {case}" for case, count in lost.items())
    return finding(all(np.isfinite(summary.median) for summary in found), words)


def follows(evidence: Evidence, basis: str) -> Finding:
    """Every run along a path keeps the accuracy."""
    runs = sum(evidence.of(case, "bso", basis).objectives.size for case in PATHS)
    lost = sum(evidence.of(case, "bso", basis).infeasible for case in PATHS)
    far = ", ".join(f"{evidence.accuracy[case, basis]:.3f} m ({case})" for case in PATHS)
    return finding(lost == 0, f"{runs - lost} of {runs} runs keep 0.1 m; the farthest from a given point: {far}")


def numbers_of_table_1(evidence: Evidence, basis: str) -> Finding:
    """Geometry and limits are not published."""
    off = [evidence.of(case, "bso", basis).mean / TABLE_1[case]["bso"].mean - 1.0 for case in PATHS]
    words = ", ".join(percent(value, "+") for value in off)
    return Finding(
        Verdict.NOT_TESTABLE,
        f"the paper prints neither the paths' geometry nor the arm's lengths and limits; ours were chosen so that "
        f"these means come near (TPBSO: {words} off)",
    )


def grows_as(kind: str, orders: dict[str, Order]) -> Callable[[Evidence, str], Finding]:
    """No measured exponent is above the printed one."""

    def judge(evidence: Evidence, basis: str) -> Finding:
        if not evidence.growth[kind]:
            return Finding(Verdict.NOT_TESTABLE, "not measured in a quick run, or on this system")
        rows = [
            (order.exponents[symbol], row["exponent"])
            for experiment, order in orders.items()
            for symbol, by_solver in evidence.growth[kind][experiment].items()
            for row in by_solver.values()
        ]
        above = sum(measured > printed + SLACK for printed, measured in rows)
        largest = max(measured - printed for printed, measured in rows)
        words = f"{len(rows) - above} of {len(rows)} measured exponents are at most {SLACK} above the printed ones"
        return finding(above == 0, f"{words} (largest excess {largest:+.2f})")

    return judge


def faster(evidence: Evidence, basis: str) -> Finding:
    """TPBSO takes no longer than its rivals."""
    pace = evidence.growth["pace"][basis]
    words = ", ".join(f"{NAMES[solver]} {pace[solver] / pace['bso']:.2f}" for solver in RIVALS)
    holds = all(pace["bso"] <= pace[rival] for rival in RIVALS)
    return finding(holds, f"time that the others take, TPBSO's being 1: {words} (least time, 3 links)")


BEST = (
    "ahead (fewer runs without a plan, then the lower mean) of both in every case, by more than chance in half of them"
)
CLAIMS = (
    Claim("IV-D.1, Fig. 17", "TPBSO has the best execution time of the three, 2 to 5 links.", BEST, best(TIME)),
    Claim("IV-D.1, Fig. 17", "TPBSO has the least joint rotation of the three, 2 to 5 links.", BEST, best(ROTATION)),
    Claim(
        "IV-D.1",
        "PSO is close to TPBSO in execution time but poor in joint rotation.",
        "its mean is at most 5 % above TPBSO's in all time cases, and more in most rotation cases",
        close_in_one_poor_in_other("pso", TIME, ROTATION),
    ),
    Claim(
        "IV-D.1",
        "GA is just the opposite: close in joint rotation, poor in execution time.",
        "its mean is at most 5 % above TPBSO's in all rotation cases, and more in most time cases",
        close_in_one_poor_in_other("ga", ROTATION, TIME),
    ),
    Claim("IV-D.2, Table 1", "Along both paths TPBSO has the best mean time and rotation.", BEST, best(PATHS)),
    Claim(
        "IV-D.2, Table 1",
        "Along both paths TPBSO has the lower variance (its own table has PSO and GA lower in one column of four).",
        "its standard deviation is the smallest in each column",
        lower_spread,
    ),
    Claim(
        "IV-D.2, Table 1",
        "The numbers themselves.",
        "geometry and limits were known and the means agreed",
        numbers_of_table_1,
    ),
    Claim(
        "IV-A.1, Figs 2-9",
        "As the number of links grows, TPBSO can converge well.",
        "every run ends with a plan, and each median is at most 10 % above the best known",
        converges,
    ),
    Claim(
        "IV-A.2, Fig. 6",
        "Least rotation with two links needs very few iterations.",
        "a tenth of the iterations at the most, and no more than with more links",
        soon_with_two_links,
    ),
    Claim("IV-B, Figs 10-12", "The arm avoids the obstacle.", "each median run is certified for all t", avoids),
    Claim("IV-C.1, Fig. 13", "The arm follows the given points well.", "every run keeps the accuracy", follows),
    Claim(
        "IV-C.2, Figs 13-16",
        "Convergence takes much the same number of iterations along both paths.",
        "medians within a factor of 1.5",
        curves_settle_alike,
    ),
    Claim(
        "IV-D.3, Table 2",
        "Time grows as O(n_i n_p n_d n_o), and O(n_i n_p n_o) along a path, for all three.",
        f"no exponent is more than {SLACK} above the printed one",
        grows_as("time", TIME_ORDERS),
        (),
    ),
    Claim(
        "IV-D.3, Table 3",
        "Memory grows as O((n_p + n_o) n_d), and O(n_o + n_in + n_p n_d) along a path, for all three.",
        f"no exponent is more than {SLACK} above the printed one",
        grows_as("space", SPACE_ORDERS),
        (),
    ),
    Claim(
        "Abstract",
        "TPBSO is relatively fast.",
        "it takes no longer than either of the others",
        faster,
    ),
)
