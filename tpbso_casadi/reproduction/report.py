"""The report."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from solvers import BSO
from tpbso_casadi.animation.player import SCRIPT, STYLE
from tpbso_casadi.html import data_address, number, page
from tpbso_casadi.judging.statistics import Relation, compare_summaries, judge, p_text
from tpbso_casadi.plain import versions
from tpbso_casadi.reproduction.case_sections import CONSTRAINTS, case_parameters, case_section, settings
from tpbso_casadi.reproduction.claims import CLAIMS, MINIMUM_RUNS, Claim
from tpbso_casadi.reproduction.experiment import (
    BASES,
    EVALUATIONS,
    ITERATIONS,
    LOW_LAMBDA,
    LOW_LAMBDA_PRINTED_SIGN,
    NAMES,
    PRINTED,
    PRINTED_LOW_LAMBDA,
    PRINTED_SIGN,
    SPACE_ORDERS,
    TABLE_1,
    TIME_ORDERS,
    Evidence,
    Order,
    Size,
)
from tpbso_casadi.reproduction.judgements import ClaimOutcome, Finding
from tpbso_casadi.reproduction.page_figures import Illustration, ReportPicture, figure_17, scaling_figure
from tpbso_casadi.reproduction.scaling import PACE_CASES
from tpbso_casadi.scenario import TITLES

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


NEGLIGIBLE = 1e-9  # a smaller number, such as the standard deviation of equal numbers, is shown as 0


def render(evidence: Evidence, illustrations: Iterable[Illustration], size: Size, command: str, seconds: float) -> str:
    """The page.

    Args:
        evidence: of the runs and measurements.
        illustrations: of the cases, each of those that were done.
        size: of the reproduction.
        command: that makes the page.
        seconds: total time of the runs, added up over all workers.
    """
    judged = [(claim, claim.findings(evidence)) for claim in CLAIMS]
    by_case = {illustration.case: illustration for illustration in illustrations}
    return page(
        Path(__file__).parent,
        "report",
        {
            "number": lambda value, digits=4: number(value, digits, NEGLIGIBLE),
            "picture": image_with_caption,
            "p_text": p_text,
        },
        player_style=STYLE,
        player_script=SCRIPT,
        date=date.today().isoformat(),
        size=size,
        command=command,
        seconds=seconds,
        versions=versions(),
        bases=BASES,
        judged=judged,
        counts=counts(judged),
        cases=[case_section(name, evidence, by_case.get(name)) for name in TITLES],
        figure_17=figure_17(evidence),
        table_1=table_1(evidence),
        names=NAMES,
        tables=[
            ("Table 2: time", *scaling_table(evidence.scaling["time"], TIME_ORDERS, "seconds")),
            ("Table 3: memory", *scaling_table(evidence.scaling["space"], SPACE_ORDERS, "bytes")),
        ],
        quick=size.runs < MINIMUM_RUNS,
        as_printed=compare_with_printed(evidence),
        antenna_shares=antenna_shares(),
        parameters=case_parameters(),
        settings=settings(),
        constraints=CONSTRAINTS,
        pace_cases=PACE_CASES,
        failed=[record for record in evidence.records if record.error],
        records=evidence.records,
        missing=len(evidence.runs) - len(evidence.records),
    )


def counts(judged: Iterable[tuple[Claim, Mapping[str, Finding]]]) -> dict[str, Counter[ClaimOutcome]]:
    """How many claims have each outcome, by basis; a claim that does not depend on the basis counts on both."""
    by_basis = {basis: Counter(dict.fromkeys(ClaimOutcome, 0)) for basis in BASES}
    for _, findings in judged:
        for basis in BASES:
            by_basis[basis][findings[basis if basis in findings else ""].outcome] += 1
    return by_basis


def table_1(evidence: Evidence) -> list[dict[str, Any]]:
    """The paper's rows beside ours."""
    return [
        {
            "case": case,
            "solver": NAMES[solver],
            "printed": printed,
            "ours": {basis: evidence.of(case, solver, basis) for basis in BASES},
        }
        for case, rows in TABLE_1.items()
        for solver, printed in rows.items()
    ]


def scaling_table(
    scaling: Mapping[str, Any], orders: Mapping[str, Order], unit: str
) -> tuple[list[dict[str, Any]], ReportPicture | None]:
    """The rows of Table 2 or 3 beside the measured exponents, and a picture of the measurements."""
    if not scaling:
        return [], None
    rows = [
        {
            "title": order.title,
            "formula": order.formula,
            "symbol": symbol,
            "printed": order.exponents[symbol],
            "measured": {NAMES[solver]: row["exponent"] for solver, row in by_solver.items()},
        }
        for experiment, order in orders.items()
        for symbol, by_solver in scaling[experiment].items()
    ]
    return rows, scaling_figure(scaling, orders, unit)


def image_with_caption(image: ReportPicture, alt: str) -> Markup:
    """An image with its caption, its data within the page."""
    return Markup('<figure><img alt="{}" src="{}" loading="lazy"><figcaption>{}</figcaption></figure>').format(
        f"{alt}: {image.caption}", data_address(image.image, "webp"), image.caption
    )
