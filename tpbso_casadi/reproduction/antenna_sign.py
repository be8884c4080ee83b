"""The sign of (28): as printed a beetle steps towards the worse antenna."""

from __future__ import annotations

from dataclasses import dataclass

from tpbso_casadi.campaign.statistics import compared, holm
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import EVALUATIONS, ITERATIONS, LOW, LOW_PRINTED, PRINTED
from tpbso_casadi.scenario.builtin import TITLES

PAIRS = (
    ("λ = 0.95 (our default: the antennae decide 5 % of a step)", "bso", PRINTED, ITERATIONS),
    ("λ = 0.95", "bso", PRINTED, EVALUATIONS),
    ("λ = 0.4 (they decide 60 %)", LOW, LOW_PRINTED, EVALUATIONS),
)


@dataclass(frozen=True)
class Sign:
    """Towards the better antenna, against as printed, over all cases.

    Attributes:
        setting: lambda.
        basis: of the comparison.
        ahead: cases in which descending has the better standing.
        behind: in which the printed sign has it.
        better: cases in which descending is better by more than chance.
        worse: in which the printed sign is.
    """

    setting: str
    basis: str
    ahead: int
    behind: int
    better: int
    worse: int

    @property
    def words(self) -> str:
        """What follows."""
        if self.better == self.worse:
            return "no difference beyond chance" if not self.better else "as many cases either way"
        return "descending is better" if self.better > self.worse else "the printed sign is better"


def signs(evidence: Evidence) -> list[Sign]:
    """Each pair of arms that was run."""
    found = []
    for setting, descending, printed, basis in PAIRS:
        try:
            arms = [(evidence.of(case, descending, basis), evidence.of(case, printed, basis)) for case in TITLES]
        except KeyError:  # not run
            continue
        pairs = [compared(*both) for both in arms]
        verdicts = [pair.verdict(p) for pair, p in zip(pairs, holm([pair.p for pair in pairs]), strict=True)]
        behind = sum(theirs.standing < ours.standing for ours, theirs in arms)
        tally = sum(pair.lower for pair in pairs), behind, verdicts.count("better"), verdicts.count("worse")
        found.append(Sign(setting, basis, *tally))
    return found
