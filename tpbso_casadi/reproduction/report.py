"""The report: the cases, the claims, the paper's tables and all parameters on one page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from problems import Variable
from solvers import BSO, SOLVERS
from tpbso_casadi.animation.player import SCRIPT, STYLE
from tpbso_casadi.html import data_address, number
from tpbso_casadi.judging.page import page
from tpbso_casadi.judging.statistics import Judgement, Relation, compare_summaries, judge
from tpbso_casadi.reproduction.claims import CLAIMS, MINIMUM_RUNS, Claim
from tpbso_casadi.reproduction.experiment import (
    BASES,
    EVALUATIONS,
    EXTENSIONS,
    FIGURES,
    ITERATIONS,
    LOW_LAMBDA,
    LOW_LAMBDA_PRINTED_SIGN,
    NAMES,
    PRINTED,
    PRINTED_LOW_LAMBDA,
    PRINTED_SIGN,
    RIVALS,
    SPACE_ORDERS,
    TABLE_1,
    TIME_ORDERS,
    Evidence,
    Order,
    Size,
    label,
)
from tpbso_casadi.reproduction.judgements import ClaimOutcome, Finding, against
from tpbso_casadi.reproduction.page_figures import Illustration, ReportPicture, figure_17, scaling_figure
from tpbso_casadi.reproduction.scaling import PACE_CASES
from tpbso_casadi.scenario import TITLES, builtin

Row = dict[str, Any]  # of a table of the page, by the names of its columns
NEGLIGIBLE = 1e-9  # a smaller number, such as the standard deviation of equal numbers, is shown as 0


def render(evidence: Evidence, illustrations: Iterable[Illustration], size: Size, command: str, seconds: float) -> str:
    """The page of a reproduction.

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
        "report",
        {"number": lambda value, digits=4: number(value, digits, NEGLIGIBLE), "picture": image_with_caption},
        Path(__file__).parent,
        player_style=STYLE,
        player_script=SCRIPT,
        date=date.today().isoformat(),
        size=size,
        command=command,
        seconds=seconds,
        bases=BASES,
        judged=judged,
        counts=counts(judged),
        cases=[case_section(name, evidence, by_case.get(name)) for name in TITLES],
        figure_17=figure_17(evidence),
        table_1=table_1(evidence),
        tables=[
            ("Table 2: time", *scaling_table(evidence.scaling["time"], TIME_ORDERS, "seconds")),
            ("Table 3: memory", *scaling_table(evidence.scaling["space"], SPACE_ORDERS, "bytes")),
        ],
        quick=size.runs < MINIMUM_RUNS,
        as_printed=compare_with_printed(evidence),
        antenna_shares=antenna_shares(),
        parameters=[case_parameters(case) for case in TITLES],
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


CONSTRAINTS = (  # quantity, its equation point to point, its equation along a path
    ("objective: time", "(8)", "(19)"),
    ("objective: joint rotation", "(9)", "(20)"),
    ("objective: travel length", "(10)", "-"),
    ("joint speed", "(11), (16)", "(21), (16)"),
    ("joint acceleration", "(12), (17)", "(22), (17)"),
    ("redundant parameters", "(13)", "(23), by (7)"),
    ("obstacle", "(14), (18)", "-"),
    ("accuracy", "-", "(24)"),
    ("cost", "(15)", "(25)"),
)

MEANINGS = {
    "population": "m, members at equal evaluations",
    "lambda_": "λ of (26), share of the velocity in a step",
    "c1": "c1 of (27), towards the member's own best",
    "c2": "c2 of (27), towards the swarm's best",
    "inertia_first": "inertia w before V in (27), at the start",
    "inertia_last": "inertia w at the end, linear in between",
    "velocity_range": "v_max of Algorithm 1 over the width of the box; v_min is -v_max",
    "delta_0": "δ_0 of (32), first step size",
    "eta": "η of (32), decay of the step size",
    "c": "c of (31), step size over antenna length",
    "antenna_sign": "sign of (28): descend is -, printed is +",
    "tournament": "individuals that compete to become a parent",
    "crossover_rate": "share of pairs that cross over",
    "crossover_eta": "distribution index of the simulated binary crossover",
    "mutation_rate": "share of genes that mutate",
    "mutation_eta": "distribution index of the polynomial mutation",
}


def case_parameters(case: str) -> Row:
    """The numbers of a case, in words: arm, task, obstacles, model, search box and weights."""
    content = builtin(case).table()
    problem = builtin(case).problem()
    return {
        "case": case,
        "arm": listed(content["arm"]),
        "task": listed(content["task"]),
        "obstacles": "; ".join(map(listed, content["obstacles"])) or "none",
        "model": listed({key: value for key, value in content["model"].items() if value != []}),
        "box": box_in_words(problem.variables),
        "weights": f"{value_in_words(problem.weights.limit)}, {value_in_words(problem.weights.reach)}",
    }


def box_in_words(variables: Sequence[Variable]) -> str:
    """The ranges of the decision variables; those of an array together."""
    groups: dict[str, Variable] = {}
    counts: dict[str, int] = {}
    for variable in variables:
        name = variable.name.partition("[")[0]
        groups[name], counts[name] = variable, counts.get(name, 0) + 1
    return ", ".join(
        f"{name}{f' ({counts[name]})' if counts[name] > 1 else ''} {value_in_words(v.lower)} to "
        f"{value_in_words(v.upper)} {v.unit}"
        for name, v in groups.items()
    )


def listed(table: Mapping[str, Any]) -> str:
    """Keys and values of a table of a scenario, in words."""
    stated = {key: value for key, value in table.items() if value is not None}
    return ", ".join(f"{key.replace('_', ' ')} {value_in_words(value)}" for key, value in stated.items())


def value_in_words(value: object) -> str:
    """A value: numbers with at most five digits, lists in brackets."""
    if isinstance(value, float | int):
        return f"{value:.5g}"
    if isinstance(value, list | tuple):
        return f"({', '.join(map(value_in_words, value))})"
    return str(value)


def settings() -> list[Row]:
    """The hyper-parameters of the paper's three solvers, and those that its printed form sets otherwise."""
    columns: dict[str, Any] = {NAMES[name]: SOLVERS[name]() for name in NAMES}
    columns["TPBSO as printed"] = SOLVERS["bso"](**SOLVERS["bso"].presets["printed"])
    names = dict.fromkeys(field.name for solver in columns.values() for field in fields(solver))
    return [
        {
            "name": name,
            "meaning": MEANINGS[name],
            "by_solver": {title: value_in_words(getattr(solver, name, "")) for title, solver in columns.items()},
        }
        for name in names
    ]


AS_PRINTED = {
    PRINTED_SIGN: "TPBSO with (28) as printed",
    PRINTED: "TPBSO as printed (λ = 0.95)",
    PRINTED_LOW_LAMBDA: "TPBSO as printed (λ = 0.4)",
}
SOLVER_TITLES = {"ga": NAMES["ga"], "pso": NAMES["pso"], "bso": NAMES["bso"], **AS_PRINTED}
EXTENSION_TITLES = {
    "abso": "adaptive beetle swarm",
    "bso+polish": "TPBSO, then IPOPT",
    "ipopt": "IPOPT alone, 20 starts",
}


def case_section(name: str, evidence: Evidence, illustration: Illustration | None) -> Row:
    """The section of a case: a row of each solver by basis, conclusions, extensions, the median run in pictures."""
    rows: dict[str, list[Row]] = {}
    conclusions, printed = [], TABLE_1.get(name, {})
    for basis in BASES:
        others = (*RIVALS, *AS_PRINTED)
        judgements = dict(zip(others, against(evidence, [name], basis, others), strict=True))
        rows[basis] = [
            {
                "name": title,
                "summary": evidence.of(name, solver, basis),
                "judgement": judgements.get(solver),
                "printed": printed.get(solver),
            }
            for solver, title in SOLVER_TITLES.items()
        ]
        conclusions.append(f"{basis}: TPBSO is {in_words(judgements)}")
    summaries = {solver: evidence.summaries.get((name, label(solver, EVALUATIONS))) for solver in EXTENSIONS}
    return {
        "name": name,
        "title": TITLES[name].partition(": ")[2],
        "figure": FIGURES[name],
        "unit": rows[EVALUATIONS][0]["summary"].unit,
        "conclusion": "; ".join(conclusions),
        "rows": rows,
        "extensions": [
            {"name": EXTENSION_TITLES[solver], "summary": summary}
            for solver, summary in summaries.items()
            if summary is not None
        ],
        "best_known": evidence.best_known(name),
        "illustration": illustration,
        "repeated_exactly": illustration is not None and is_repeated_exactly(evidence, illustration),
    }


def is_repeated_exactly(evidence: Evidence, illustration: Illustration) -> bool:
    """Whether the run that was repeated for the pictures has the objective that is stored."""
    labels = illustration.case, label("bso", ITERATIONS), illustration.seed
    records = (record for record in evidence.records if (record.case, record.solver, record.seed) == labels)
    return illustration.objective == next(records).objective


def in_words(judgements: Mapping[str, Judgement]) -> str:
    """The relations of TPBSO to other solvers.

    Args:
        judgements: of TPBSO against them, by solver.
    """
    phrases = {
        Relation.BETTER: "better than {}",
        Relation.WORSE: "worse than {}",
        Relation.NOT_SHOWN: "not shown to differ from {}",
        Relation.NOT_JUDGED: "not judged against {}, for want of runs",
    }
    others: dict[Relation, list[str]] = {}
    for solver, judgement in judgements.items():
        others.setdefault(judgement.relation, []).append(SOLVER_TITLES[solver])
    return "; ".join(phrases[relation].format(joined(names)) for relation, names in others.items())


def joined(names: Sequence[str]) -> str:
    """Names with commas, and "and" before the last: a, b and c."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


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


def compare_with_printed(evidence: Evidence) -> list[Row]:
    """The comparisons of ours with what is printed, over all cases, of which the runs were done.

    Rows have what is as printed, lambda and basis; numbers of cases in which ours is ahead, behind,
    significantly better and worse; the mean A12 of ours; and a conclusion in words.
    """
    done = []
    for part, lambda_, ours, printed, basis in COMPARISONS:
        try:
            pairs = [(evidence.of(case, ours, basis), evidence.of(case, printed, basis)) for case in TITLES]
        except KeyError:  # not run
            continue
        judgements = judge([compare_summaries(*pair) for pair in pairs])
        relations = [judgement.relation for judgement in judgements]
        done.append(
            {
                "printed": part,
                "lambda_": lambda_,
                "basis": basis,
                "ahead": sum(judgement.comparison.ahead for judgement in judgements),
                "behind": sum(theirs.rank_key < mine.rank_key for mine, theirs in pairs),
                "better": relations.count(Relation.BETTER),
                "worse": relations.count(Relation.WORSE),
                "a12": float(np.mean([judgement.comparison.a12 for judgement in judgements])),
                "conclusion": _conclusion(relations),
            }
        )
    return done


def _conclusion(relations: list[Relation]) -> str:
    better, worse = relations.count(Relation.BETTER), relations.count(Relation.WORSE)
    if better == worse:
        if better:
            return "as many cases either way"
        return str(Relation.NOT_SHOWN if Relation.NOT_SHOWN in relations else Relation.NOT_JUDGED)
    return "ours is better" if better > worse else "as printed is better"


def antenna_shares() -> list[Row]:
    """The share of a step that is the antennae's, by lambda, with the step size of our defaults."""
    solver = BSO()
    delta = solver.delta_0 * solver.eta ** np.arange(200.0)
    rows = []
    for lambda_ in LAMBDAS:
        antennae = (1.0 - lambda_) * delta
        share = antennae / (lambda_ + antennae)
        rows.append({"lambda_": lambda_, "first": share[0], "later": share[50], "mean": share.mean()})
    return rows
