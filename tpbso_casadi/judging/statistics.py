"""Statistics of runs: summaries, tests of pairs, effect sizes, Holm's correction, ranks over cases.

Runs of two solvers on one case are independent samples, which a rank-sum test compares, unless they have their searches
in common: a search and its polish are compared seed by seed, by Wilcoxon's signed-rank test.

The procedure is Demsar's [1]: a Friedman test in the form of Iman and Davenport; where that rejects, each pair of
solvers is compared. Pairs are compared by Wilcoxon's signed-rank test, corrected by Holm, rather than by Nemenyi's
test, whose outcome for one pair depends on the other solvers [2].

[1] J. Demsar, "Statistical comparisons of classifiers over multiple data sets", JMLR 7, 2006.
[2] A. Benavoli, G. Corani, F. Mangili, "Should we really use post-hoc tests based on mean-ranks?", JMLR 17, 2016.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import combinations
from math import comb
from typing import Any

import numpy as np
import scipy  # whose parts are loaded when they are used

from problems.base import FloatArray
from tpbso_casadi.judging.run import RunRecord
from tpbso_casadi.judging.targets import PLANS, TIE_TOLERANCE, Measure, quantile

SIGNIFICANCE_LEVEL = 0.05
EXACT_PARTITIONS = 20_000  # two samples with ties are permuted up to so many ways; beyond, p is asymptotic
SMALLEST_SHOWN_P = 0.001


@dataclass(frozen=True, kw_only=True)
class Summary:
    """The runs of one solver on one case.

    Attributes:
        case: of the scenario.
        solver: its label.
        unit: of the objective.
        objectives: of the runs that did not fail, (n,); inf where the plan is not feasible.
        failed: runs that raised.
        evaluations: of a run, mean.
        seconds: of a run, median.
        measure: that the runs are judged by.
        searches: digests of the searches of the runs that did not fail, in the order of ``objectives``; or none.
        expected_running_time: evaluations until a plan within the measure's aim is expected; NaN where unknown.
    """

    case: str
    solver: str
    unit: str
    objectives: FloatArray
    failed: int
    evaluations: float
    seconds: float
    measure: Measure = PLANS
    searches: tuple[str, ...] = ()
    expected_running_time: float = float("nan")

    @property
    def feasible_objectives(self) -> FloatArray:
        """The objectives of the feasible plans."""
        return self.objectives[np.isfinite(self.objectives)]

    @property
    def infeasible(self) -> int:
        """Runs that ended without a feasible plan."""
        return self.objectives.size - self.feasible_objectives.size

    @property
    def mean(self) -> float:
        """The mean objective of feasible plans; NaN where there is none."""
        return float(self.feasible_objectives.mean()) if self.feasible_objectives.size else float("nan")

    @property
    def std(self) -> float:
        """Standard deviation of the feasible plans, n - 1 in the denominator; NaN where there are fewer than two."""
        return float(self.feasible_objectives.std(ddof=1)) if self.feasible_objectives.size > 1 else float("nan")

    @property
    def best(self) -> float:
        """The lowest objective of a feasible plan; NaN where there is none."""
        return float(self.feasible_objectives.min()) if self.feasible_objectives.size else float("nan")

    @property
    def median(self) -> float:
        """The median objective of all plans, infeasible ones last: inf where more than half are."""
        return float(np.median(self.objectives)) if self.objectives.size else float("nan")

    @property
    def quartiles(self) -> tuple[float, float]:
        """The lower and the upper one of all plans, infeasible ones last; NaN where there is none."""
        if not self.objectives.size:
            return float("nan"), float("nan")
        return float(quantile(self.objectives, 0.25)), float(quantile(self.objectives, 0.75))

    @property
    def interquartile_range(self) -> float:
        """The interquartile range of feasible plans; inf where there are fewer than two."""
        plans = self.feasible_objectives
        return float(np.subtract(*np.quantile(plans, (0.75, 0.25)))) if plans.size > 1 else float("inf")

    @property
    def rank_key(self) -> tuple[int, float]:
        """The key by which solvers are ranked: the number of runs that failed or are infeasible, then the mean."""
        return self.failed + self.infeasible, self.mean if self.feasible_objectives.size else float("inf")


def summarise(records: Iterable[RunRecord], measure: Measure = PLANS) -> list[Summary]:
    """One summary for each case and solver, in the order in which they appear."""
    groups: dict[tuple[str, str], list[RunRecord]] = {}
    for record in records:
        groups.setdefault((record.case, record.solver), []).append(record)
    return [_summary(*labels, group, measure) for labels, group in groups.items()]


def _summary(case: str, solver: str, records: Sequence[RunRecord], measure: Measure) -> Summary:
    done = [record for record in records if not record.error]
    objectives = [record.objective if record.feasible else None for record in done]
    values = np.array([np.inf if objective is None else objective for objective in objectives], dtype=np.float64)
    evaluations = float(np.mean([record.evaluations or 0 for record in done])) if done else float("nan")
    seconds = float(np.median([record.seconds for record in done])) if done else float("nan")
    unit = next((record.unit for record in done), "")
    return Summary(
        case=case,
        solver=solver,
        unit=unit,
        objectives=values,
        failed=len(records) - len(done),
        evaluations=evaluations,
        seconds=seconds,
        measure=measure,
        searches=tuple(record.search for record in done),
    )


class Relation(StrEnum):
    """The relation that the runs of two solvers show."""

    BETTER = "better"
    WORSE = "worse"
    NOT_SHOWN = "no difference shown"
    NOT_JUDGED = "not judged"  # so few runs that no outcome of theirs could have been significant


@dataclass(frozen=True, kw_only=True)
class PairComparison:
    """The runs of one solver compared with those of another, on one case.

    Attributes:
        case: of both.
        solver: the label of the one.
        other: the label of the other.
        ahead: whether the one ranks before the other: fewer runs without a plan, then the lower mean.
        a12: effect size of Vargha and Delaney, the probability that a run of the one is better than one of the other,
            ties half; of pairs the share of the ranks of their differences that speaks for the one. From 0 to 1, 0.5
            where they are alike.
        p: of the two-sided test, infeasible runs last.
        smallest_p: that this test can give with so many runs.
        paired: whether the runs have their searches in common, so that the test is Wilcoxon's of pairs (signed ranks)
            rather than Mann and Whitney's of independent runs (rank sum).
    """

    case: str
    solver: str
    other: str
    ahead: bool
    a12: float
    p: float
    smallest_p: float
    paired: bool = False

    @property
    def test(self) -> str:
        """The name of the test."""
        return "signed rank" if self.paired else "rank sum"


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """A comparison judged as one of a family of tests.

    Attributes:
        comparison: itself.
        p: corrected by Holm over the family.
        relation: of the one solver to the other.
    """

    comparison: PairComparison
    p: float
    relation: Relation


def judge(comparisons: Sequence[PairComparison]) -> list[Judgement]:
    """The comparisons as one family of tests at 5 %, Holm-corrected."""
    corrected = holm([comparison.p for comparison in comparisons])
    return [
        Judgement(comparison=comparison, p=p, relation=_relation(comparison, p, len(comparisons)))
        for comparison, p in zip(comparisons, corrected, strict=True)
    ]


def _relation(comparison: PairComparison, p: float, tests: int) -> Relation:
    if p < SIGNIFICANCE_LEVEL and comparison.a12 != 0.5:
        return Relation.BETTER if comparison.a12 > 0.5 else Relation.WORSE
    return Relation.NOT_SHOWN if tests * comparison.smallest_p < SIGNIFICANCE_LEVEL else Relation.NOT_JUDGED


def compare_summaries(first: Summary, second: Summary) -> PairComparison:
    """Compare two solvers on a case, run by run where these have their searches in common.

    Objectives within 0.01 % of the best of both count as equal to it.
    """
    one, other = with_ties(first.objectives, second.objectives, first.measure.reached)
    pairs = pairs_of(first, second)
    if pairs:
        one, other = one[[place for place, _ in pairs]], other[[place for _, place in pairs]]
        effect, p, least = share_of_ranks(one, other), signed_rank(one, other), min(1.0, 2.0 ** (1 - len(pairs)))
    else:
        (effect, p), least = rank_sum(one, other), smallest_p(one.size, other.size)
    return PairComparison(
        case=first.case,
        solver=first.solver,
        other=second.solver,
        ahead=first.rank_key < second.rank_key,
        a12=effect,
        p=p,
        smallest_p=least,
        paired=bool(pairs),
    )


def pairs_of(first: Summary, second: Summary) -> list[tuple[int, int]]:
    """The places of runs of two solvers on a case that have their search in common."""
    places = {search: place for place, search in enumerate(second.searches) if search}
    return [(place, places[search]) for place, search in enumerate(first.searches) if search in places]


def against_first(summaries: Sequence[Summary]) -> dict[tuple[str, str], Judgement]:
    """Judgements of each solver against the first, by case and solver; the whole table is one family of tests."""
    first = {summary.case: summary for summary in reversed(summaries)}
    judgements = judge([compare_summaries(s, first[s.case]) for s in summaries if s is not first[s.case]])
    return {(j.comparison.case, j.comparison.solver): j for j in judgements}


def rank_sum(a: FloatArray, b: FloatArray) -> tuple[float, float]:
    """A12, the probability that a value of ``a`` (n,) is lower than one of ``b`` (m,), and p; 0.5 and 1 if all are one.

    p is exact for small samples, ties or none.
    """
    if not (a.size and b.size) or np.unique([*a, *b]).size == 1:
        return 0.5, 1.0
    ranks = scipy.stats.rankdata([*a, *b])
    ways = comb(ranks.size, a.size)
    few_with_ties = ways <= EXACT_PARTITIONS and np.unique(ranks).size < ranks.size
    method: Any = scipy.stats.PermutationMethod(n_resamples=EXACT_PARTITIONS) if few_with_ties else "auto"
    return a12(a, b), float(scipy.stats.mannwhitneyu(ranks[: a.size], ranks[a.size :], method=method).pvalue)


def a12(a: FloatArray, b: FloatArray) -> float:
    """The probability that a value of ``a`` (n,) is lower than one of ``b`` (m,), ties half; 0.5 if one is empty."""
    if not (a.size and b.size):
        return 0.5
    return float((a[:, None] < b).mean() + 0.5 * (a[:, None] == b).mean())


def smallest_p(n: int, m: int) -> float:
    """The smallest p that a two-sided rank-sum test of n runs against m can give."""
    return min(1.0, 2.0 / comb(n + m, n))


def p_text(p: float) -> str:
    """P for a table: three digits, or that it is below the smallest of them."""
    return f"{p:.3f}" if p >= SMALLEST_SHOWN_P else f"< {SMALLEST_SHOWN_P}"


def with_ties(a: FloatArray, b: FloatArray, reached: float = -np.inf) -> tuple[FloatArray, FloatArray]:
    """Two samples in which values close enough to the best of both, and all up to ``reached``, are replaced by it."""
    best = min((float(values.min()) for values in (a, b) if values.size), default=np.inf)
    limit = max(best + TIE_TOLERANCE * abs(best), reached)
    return np.where(a <= limit, best, a), np.where(b <= limit, best, b)


def holm(p_values: Sequence[float]) -> list[float]:
    """Holm's correction: of n, the smallest counts n times, the next n - 1 times, never less than the one before."""
    corrected, largest = np.ones(len(p_values)), 0.0
    for rank, index in enumerate(np.argsort(p_values, kind="stable")):
        largest = max(largest, min(1.0, p_values[index] * (len(p_values) - rank)))
        corrected[index] = largest
    return [float(p) for p in corrected]


FEWEST_SOLVERS = 3
MOST_EXACT = 200  # cases up to which p of a signed-rank test is exact


@dataclass(frozen=True)
class Ranking:
    """Solvers ranked over cases.

    Attributes:
        solvers: best mean rank first, (k,).
        ranks: their mean ranks, 1 for the best, ties sharing theirs, (k,).
        cases: over which ranks are averaged.
        p: of the Friedman test in the form of Iman and Davenport.
        groups: largest runs of neighbours without a significant difference within, as first and last index.
    """

    solvers: tuple[str, ...]
    ranks: FloatArray
    cases: int
    p: float
    groups: tuple[tuple[int, int], ...]


def cases_needed(solvers: int) -> int:
    """The number of cases from which on a pair of so many solvers can be found to differ significantly."""
    pairs, cases = solvers * (solvers - 1) / 2, 1
    while pairs * 2.0 ** (1 - cases) >= SIGNIFICANCE_LEVEL:
        cases += 1
    return cases


def ranking(solvers: Sequence[str], scores: FloatArray) -> Ranking:
    """The ranking of solvers over cases.

    Args:
        solvers: labels, (k,).
        scores: lower is better, comparable between cases, inf for the worst, (cases, k).
    """
    ranks = scipy.stats.rankdata(scores, axis=1).mean(axis=0)
    order = np.argsort(ranks, kind="stable")
    p = friedman(scores)
    different = np.zeros((len(solvers), len(solvers)), dtype=bool)
    if p < SIGNIFICANCE_LEVEL:
        pairs = list(combinations(range(len(solvers)), 2))
        corrected = holm([signed_rank(scores[:, order[i]], scores[:, order[j]]) for i, j in pairs])
        for (i, j), of_pair in zip(pairs, corrected, strict=True):
            different[i, j] = of_pair < SIGNIFICANCE_LEVEL
    labels = tuple(solvers[index] for index in order)
    return Ranking(labels, ranks[order], len(scores), p, groups_of(different))


def friedman(scores: FloatArray) -> float:
    """P of the Friedman test over cases (n, k), as corrected by Iman and Davenport; 1 where no case has a winner."""
    n, k = scores.shape
    if (np.ptp(scipy.stats.rankdata(scores, axis=1), axis=1) == 0.0).all():
        return 1.0
    chi_squared = float(scipy.stats.friedmanchisquare(*scores.T).statistic)
    freedom = n * (k - 1) - chi_squared
    if freedom <= 0.0:  # all cases agree
        return 0.0
    return float(scipy.stats.f.sf((n - 1) * chi_squared / freedom, k - 1, (k - 1) * (n - 1)))


def differences_of(a: FloatArray, b: FloatArray) -> FloatArray:
    """Differences of paired scores (n,), (n,); an infinite score is worse by more than finite ones differ."""
    finite = np.concatenate([a[np.isfinite(a)], b[np.isfinite(b)]])
    worst = 1.0 + 2.0 * float(np.ptp(finite)) + float(finite.max()) if finite.size else 0.0
    return np.asarray(np.where(np.isfinite(a), a, worst) - np.where(np.isfinite(b), b, worst))


def share_of_ranks(a: FloatArray, b: FloatArray) -> float:
    """The share of ranks of differences of paired scores (n,) in which ``a`` is lower, ties half."""
    differences = differences_of(a, b)
    ranks = scipy.stats.rankdata(np.abs(differences))
    return float((ranks @ ((differences < 0.0) + 0.5 * (differences == 0.0))) / ranks.sum())


def signed_rank(a: FloatArray, b: FloatArray) -> float:
    """P of Wilcoxon's two-sided test of paired scores (n,), exact with ties too; equal pairs count for both sides."""
    differences = differences_of(a, b)
    if not differences.any():
        return 1.0
    if differences.size > MOST_EXACT:
        return float(scipy.stats.wilcoxon(differences, zero_method="zsplit", method="approx").pvalue)
    doubled = np.rint(2.0 * scipy.stats.rankdata(np.abs(differences))).astype(int)  # whole numbers with ties too
    probabilities = np.ones(1)  # of the sum of the ranks whose sign is positive, where signs are tosses of a coin
    for rank in doubled[differences != 0.0]:
        padding = np.zeros(rank)
        probabilities = (np.concatenate([probabilities, padding]) + np.concatenate([padding, probabilities])) / 2.0
    middle = (probabilities.size - 1) / 2.0
    away = abs(doubled[differences > 0.0].sum() - middle)
    return min(1.0, float(probabilities[np.abs(np.arange(probabilities.size) - middle) >= away].sum()))


def groups_of(different: np.ndarray[Any, np.dtype[np.bool_]]) -> tuple[tuple[int, int], ...]:
    """The largest runs of at least two neighbours of which no two differ; ``different`` (k, k) above its diagonal."""
    groups: list[tuple[int, int]] = []
    for first in range(len(different)):
        last = first
        while last + 1 < len(different) and not different[first : last + 1, last + 1].any():
            last += 1
        if last > first and (not groups or last > groups[-1][1]):
            groups.append((first, last))
    return tuple(groups)
