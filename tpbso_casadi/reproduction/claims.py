"""The paper's claims."""

from __future__ import annotations

from dataclasses import dataclass

from tpbso_casadi.reproduction.experiment import (
    BASES,
    OBSTACLES,
    PATHS,
    ROTATION,
    SPACE_ORDERS,
    TIME,
    TIME_ORDERS,
    Evidence,
)
from tpbso_casadi.reproduction.judgements import (
    EXPONENT_TOLERANCE,
    ClaimOutcome,
    Finding,
    Rule,
    avoids_obstacle,
    best_mean,
    close_in_some_poor_in_others,
    converges,
    fast,
    few_iterations_with_two_links,
    follows_path,
    grows_as,
    lower_spread,
    numbers_of_table_1,
    robust,
    similar_convergence_along_paths,
    sooner,
)

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
        """The findings by basis; under "" where the claim does not depend on it."""
        return {basis: self._finding(evidence, basis) for basis in self.bases or ("",)}

    def _finding(self, evidence: Evidence, basis: str) -> Finding:
        finding = self.judge(evidence, basis)
        rests_on_runs = bool(self.bases) and finding.outcome is not ClaimOutcome.NOT_TESTABLE
        if evidence.fewest_runs >= MINIMUM_RUNS or not rests_on_runs:
            return finding
        return Finding(ClaimOutcome.NOT_JUDGED, f"{evidence.fewest_runs} runs are too few; {finding.evidence}")


BEST = "ahead (fewer runs without a plan, then the lower mean) of both in every case, significantly in half of them"
CLAIMS = (
    Claim("IV-D.1, Fig. 17", "TPBSO has the best execution time of the three, 2 to 5 links.", BEST, best_mean(TIME)),
    Claim(
        "IV-D.1, Fig. 17", "TPBSO has the least joint rotation of the three, 2 to 5 links.", BEST, best_mean(ROTATION)
    ),
    Claim(
        "IV-D.1",
        "PSO is close to TPBSO in execution time but poor in joint rotation.",
        "its mean is at most 5 % above TPBSO's in all time cases, and more in most rotation cases",
        close_in_some_poor_in_others("pso", TIME, ROTATION),
    ),
    Claim(
        "IV-D.1",
        "GA is just the opposite: close in joint rotation, poor in execution time.",
        "its mean is at most 5 % above TPBSO's in all rotation cases, and more in most time cases",
        close_in_some_poor_in_others("ga", ROTATION, TIME),
    ),
    Claim("IV-D.2, Table 1", "Along both paths TPBSO has the best mean time and rotation.", BEST, best_mean(PATHS)),
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
        few_iterations_with_two_links,
    ),
    Claim(
        "IV-B, Figs 10-12", "The robot avoids the obstacle.", "each median run is certified for all t", avoids_obstacle
    ),
    Claim(
        "IV-C.1, Fig. 13",
        "Along the pentagram the robot follows the given points well.",
        "along it, for both objectives, the median run passes every given point within 2 % of its width",
        follows_path,
    ),
    Claim(
        "IV-C.2, Figs 13-16",
        "Convergence takes much the same number of iterations along both paths.",
        "medians within a factor of 1.5",
        similar_convergence_along_paths,
    ),
    Claim(
        "IV-D.3, Table 2",
        "Time grows as O(n_i n_p n_d n_o), and O(n_i n_p n_o) along a path, for all three.",
        f"no exponent is more than {EXPONENT_TOLERANCE} above the printed one",
        grows_as("time", TIME_ORDERS),
        (),
    ),
    Claim(
        "IV-D.3, Table 3",
        "Memory grows as O((n_p + n_o) n_d), and O(n_o + n_in + n_p n_d) along a path, for all three.",
        f"no exponent is more than {EXPONENT_TOLERANCE} above the printed one",
        grows_as("space", SPACE_ORDERS),
        (),
    ),
    Claim(
        "Abstract",
        "TPBSO has a relatively fast computational speed.",
        "neither of the others takes less than 90 % of its time, with 95 % confidence",
        fast,
    ),
    Claim(
        "III-C",
        "The BSO algorithm has good robustness.",
        "no more of its runs than of either other solver's end without a plan, all cases together, and "
        "its interquartile range is no larger in half of the comparisons",
        robust,
    ),
    Claim(
        "III-C",
        "The BSO algorithm has good speed.",
        "it comes within 10 % of the best known after a significantly smaller share of the search than the others more "
        "often than after a larger one",
        sooner,
    ),
    Claim(
        "III-C",
        "It exhibits higher performance when dealing with nonlinear constraints.",
        f"with an obstacle (14) or an accuracy (24) to keep: {BEST}",
        best_mean((*OBSTACLES, *PATHS)),
    ),
)
