"""Ranks of solvers over many cases, and which of them differ significantly.

The procedure is Demsar's [1]: a Friedman test in the form of Iman and Davenport; where that rejects, each pair of
solvers is compared. Pairs are compared by Wilcoxon's signed-rank test, corrected by Holm, rather than by Nemenyi's
test, whose outcome for one pair depends on the other solvers [2].

[1] J. Demsar, "Statistical comparisons of classifiers over multiple data sets", JMLR 7, 2006.
[2] A. Benavoli, G. Corani, F. Mangili, "Should we really use post-hoc tests based on mean-ranks?", JMLR 17, 2016.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from scipy.stats import PermutationMethod, f, friedmanchisquare, rankdata, wilcoxon

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.statistics import SIGNIFICANCE_LEVEL, holm

FEWEST_SOLVERS = 3
EXACT_SIGNS = 20_000  # ways to choose the signs of differences up to which p is exact where there are ties


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
    """With how many cases a pair of so many solvers can be found to differ significantly at all."""
    pairs, cases = solvers * (solvers - 1) / 2, 1
    while pairs * 2.0 ** (1 - cases) >= SIGNIFICANCE_LEVEL:
        cases += 1
    return cases


def ranking(solvers: Sequence[str], scores: FloatArray) -> Ranking:
    """Rank solvers.

    Args:
        solvers: labels, (k,).
        scores: lower is better, comparable between cases, inf for the worst, (cases, k).
    """
    ranks = rankdata(scores, axis=1).mean(axis=0)
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
    if (np.ptp(rankdata(scores, axis=1), axis=1) == 0.0).all():
        return 1.0
    chi_squared = float(friedmanchisquare(*scores.T).statistic)
    freedom = n * (k - 1) - chi_squared
    if freedom <= 0.0:  # all cases agree
        return 0.0
    return float(f.sf((n - 1) * chi_squared / freedom, k - 1, (k - 1) * (n - 1)))


def signed_rank(a: FloatArray, b: FloatArray) -> float:
    """P of Wilcoxon's two-sided test of paired scores (n,), equal ones shared between both sides.

    An infinite score is worse than any finite one, by more than those differ anywhere.
    """
    finite = np.concatenate([a[np.isfinite(a)], b[np.isfinite(b)]])
    worst = 1.0 + 2.0 * float(np.ptp(finite)) + float(finite.max()) if finite.size else 0.0
    differences = np.where(np.isfinite(a), a, worst) - np.where(np.isfinite(b), b, worst)
    if not differences.any():
        return 1.0
    plain = np.unique(np.abs(differences)).size == differences.size and differences.all()
    exact = not plain and 2.0**differences.size <= EXACT_SIGNS
    method: Any = PermutationMethod(n_resamples=EXACT_SIGNS) if exact else "auto"
    return float(wilcoxon(differences, zero_method="zsplit", method=method).pvalue)


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
