"""The sign of (28): as printed, a beetle steps towards the worse antenna."""

from __future__ import annotations

from dataclasses import dataclass

from tpbso_casadi.campaign.statistics import compare_summaries, holm
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import (
    EVALUATIONS,
    ITERATIONS,
    LOW_LAMBDA,
    LOW_LAMBDA_PRINTED_SIGN,
    PRINTED_SIGN,
)
from tpbso_casadi.scenario.builtin import TITLES

COMPARISONS = (  # setting, solver that descends, solver with the printed sign, basis
    ("λ = 0.95 (our default: the antennae decide 5 % of a step)", "bso", PRINTED_SIGN, ITERATIONS),
    ("λ = 0.95", "bso", PRINTED_SIGN, EVALUATIONS),
    ("λ = 0.4 (they decide 60 %)", LOW_LAMBDA, LOW_LAMBDA_PRINTED_SIGN, EVALUATIONS),
)


@dataclass(frozen=True, kw_only=True)
class SignComparison:
    """Stepping towards the better antenna compared with (28) as printed, over all cases.

    Attributes:
        setting: lambda.
        basis: of the comparison.
        ahead: cases in which descending ranks first.
        behind: cases in which the printed sign ranks first.
        better: cases in which descending is significantly better.
        worse: cases in which the printed sign is.
    """

    setting: str
    basis: str
    ahead: int
    behind: int
    better: int
    worse: int

    @property
    def conclusion(self) -> str:
        """In words."""
        if self.better == self.worse:
            return "no significant difference" if not self.better else "as many cases either way"
        return "descending is better" if self.better > self.worse else "the printed sign is better"


def compare_signs(evidence: Evidence) -> list[SignComparison]:
    """Each of the comparisons of which the runs were done."""
    done = []
    for setting, descending, printed, basis in COMPARISONS:
        try:
            pairs = [(evidence.of(case, descending, basis), evidence.of(case, printed, basis)) for case in TITLES]
        except KeyError:  # not run
            continue
        comparisons = [compare_summaries(*pair) for pair in pairs]
        corrected = holm([comparison.p for comparison in comparisons])
        relations = [comparison.relation(p) for comparison, p in zip(comparisons, corrected, strict=True)]
        done.append(
            SignComparison(
                setting=setting,
                basis=basis,
                ahead=sum(comparison.ahead for comparison in comparisons),
                behind=sum(printed.rank_key < descending.rank_key for descending, printed in pairs),
                better=relations.count("better"),
                worse=relations.count("worse"),
            )
        )
    return done
