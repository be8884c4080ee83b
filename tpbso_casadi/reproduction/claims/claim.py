"""A claim of the paper and how it is judged."""

from __future__ import annotations

from dataclasses import dataclass

from tpbso_casadi.reproduction.claims.finding import ClaimOutcome, Finding, Rule
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import BASES

MINIMUM_RUNS = 10  # of each solver on each case; with fewer no claim is judged


@dataclass(frozen=True)
class Claim:
    """A claim of the paper.

    Attributes:
        where: in the paper.
        statement: its words, or a summary of them.
        criterion: when we call it reproduced.
        judge: the rule.
        bases: of comparison on which it is judged; empty where it does not depend on them.
    """

    where: str
    statement: str
    criterion: str
    judge: Rule
    bases: tuple[str, ...] = BASES

    def findings(self, evidence: Evidence) -> dict[str, Finding]:
        """By basis; under "" where the claim does not depend on it."""
        return {basis: self._finding(evidence, basis) for basis in self.bases or ("",)}

    def _finding(self, evidence: Evidence, basis: str) -> Finding:
        finding = self.judge(evidence, basis)
        rests_on_runs = bool(self.bases) and finding.outcome is not ClaimOutcome.NOT_TESTABLE
        if evidence.fewest_runs >= MINIMUM_RUNS or not rests_on_runs:
            return finding
        return Finding(ClaimOutcome.NOT_JUDGED, f"{evidence.fewest_runs} runs are too few; {finding.evidence}")
