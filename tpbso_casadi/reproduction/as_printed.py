"""The algorithm as printed, without inertia in (27) and with the sign of (28), against ours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers import BSO
from tpbso_casadi.campaign.statistics import Relation, compare_summaries, judge
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import (
    EVALUATIONS,
    ITERATIONS,
    LOW_LAMBDA,
    LOW_LAMBDA_PRINTED_SIGN,
    PRINTED,
    PRINTED_LOW_LAMBDA,
    PRINTED_SIGN,
)
from tpbso_casadi.scenario.cases.builtin import TITLES

SIGN, LETTER = "the sign of (28)", "(27) without inertia, and the sign of (28)"
COMPARISONS = (  # what is as printed, lambda, our solver, the printed one, basis
    (SIGN, 0.95, "bso", PRINTED_SIGN, ITERATIONS),
    (SIGN, 0.95, "bso", PRINTED_SIGN, EVALUATIONS),
    (SIGN, 0.4, LOW_LAMBDA, LOW_LAMBDA_PRINTED_SIGN, EVALUATIONS),
    (LETTER, 0.95, "bso", PRINTED, ITERATIONS),
    (LETTER, 0.95, "bso", PRINTED, EVALUATIONS),
    (LETTER, 0.4, LOW_LAMBDA, PRINTED_LOW_LAMBDA, EVALUATIONS),
)
LAMBDAS = (0.95, 0.4)


@dataclass(frozen=True, kw_only=True)
class PrintedComparison:
    """Ours compared with what is printed, over all cases.

    Attributes:
        printed: what is as printed.
        lambda_: of both.
        basis: of the comparison.
        ahead: cases in which ours ranks first.
        behind: cases in which the printed one does.
        better: cases in which ours is significantly better.
        worse: cases in which the printed one is.
        a12: the probability that a run of ours is better, mean over the cases.
        conclusion: in words.
    """

    printed: str
    lambda_: float
    basis: str
    ahead: int
    behind: int
    better: int
    worse: int
    a12: float
    conclusion: str


def compare_with_printed(evidence: Evidence) -> list[PrintedComparison]:
    """Each of the comparisons of which the runs were done."""
    done = []
    for part, lambda_, ours, printed, basis in COMPARISONS:
        try:
            pairs = [(evidence.of(case, ours, basis), evidence.of(case, printed, basis)) for case in TITLES]
        except KeyError:  # not run
            continue
        judgements = judge([compare_summaries(*pair) for pair in pairs])
        relations = [judgement.relation for judgement in judgements]
        done.append(
            PrintedComparison(
                printed=part,
                lambda_=lambda_,
                basis=basis,
                ahead=sum(judgement.comparison.ahead for judgement in judgements),
                behind=sum(theirs.rank_key < mine.rank_key for mine, theirs in pairs),
                better=relations.count(Relation.BETTER),
                worse=relations.count(Relation.WORSE),
                a12=float(np.mean([judgement.comparison.a12 for judgement in judgements])),
                conclusion=_conclusion(relations),
            )
        )
    return done


def _conclusion(relations: list[Relation]) -> str:
    better, worse = relations.count(Relation.BETTER), relations.count(Relation.WORSE)
    if better == worse:
        if better:
            return "as many cases either way"
        return str(Relation.NOT_SHOWN if Relation.NOT_SHOWN in relations else Relation.NOT_JUDGED)
    return "ours is better" if better > worse else "as printed is better"


@dataclass(frozen=True, kw_only=True)
class AntennaShare:
    """The share of (1 - lambda) xi in a step (26), where the antennae's costs differ: |xi| is delta |V| in (28).

    Attributes:
        lambda_: of (26).
        first: of the first iteration.
        later: of iteration 50.
        mean: over 200 iterations.
    """

    lambda_: float
    first: float
    later: float
    mean: float


def antenna_shares() -> list[AntennaShare]:
    """With the step size of our defaults."""
    solver = BSO()
    delta = solver.delta_0 * solver.eta ** np.arange(200.0)
    shares = []
    for lambda_ in LAMBDAS:
        antennae = (1.0 - lambda_) * delta
        share = antennae / (lambda_ + antennae)
        shares.append(
            AntennaShare(lambda_=lambda_, first=float(share[0]), later=float(share[50]), mean=float(share.mean()))
        )
    return shares
