"""The report: one self-contained HTML page."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import date
from math import isfinite
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from tpbso_casadi.animation import SCRIPT, STYLE
from tpbso_casadi.campaign import Record
from tpbso_casadi.campaign.statistics import Summary
from tpbso_casadi.reproduction.antenna_sign import compare_signs
from tpbso_casadi.reproduction.case_figures import Illustration, Picture
from tpbso_casadi.reproduction.claims import CLAIMS, Claim
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import BASES, EVALUATIONS, EXTENSIONS, ITERATIONS, PRINTED_SIGN, Size, label
from tpbso_casadi.reproduction.overview_figures import figure_17, scaling_figure
from tpbso_casadi.reproduction.paper import FIGURES, NAMES, RIVALS, SPACE_ORDERS, TABLE_1, TIME_ORDERS, Order, Printed
from tpbso_casadi.reproduction.rules import ClaimOutcome, Finding, against
from tpbso_casadi.scenario.builtin import TITLES
from tpbso_casadi.storage.versions import versions

FOLDER = Path(__file__).parent
NEGLIGIBLE = 1e-9  # a smaller number, such as the standard deviation of equal numbers, is shown as 0
TABLE_SOLVERS = ("ga", "pso", "bso", PRINTED_SIGN)
SOLVER_TITLES = {**NAMES, PRINTED_SIGN: "TPBSO, (28) as printed"}
EXTENSION_TITLES = {
    "abso": "adaptive beetle swarm",
    "bso+polish": "TPBSO, then IPOPT",
    "ipopt": "IPOPT alone, 20 starts",
}


@dataclass(frozen=True, kw_only=True)
class Row:
    """A solver on a case.

    Attributes:
        name: of the solver, in words.
        summary: of its runs.
        relation: of TPBSO to it: "better", "worse" or "equal"; empty for TPBSO itself.
        p: of that comparison, corrected.
        printed: its numbers in the paper's Table 1, if they stand there.
    """

    name: str
    summary: Summary
    relation: str = ""
    p: float = 1.0
    printed: Printed | None = None


@dataclass(frozen=True, kw_only=True)
class CaseSection:
    """A case on the page.

    Attributes:
        name: of the scenario.
        title: in words.
        figure: its number in the paper.
        unit: of the objective.
        conclusion: the relation of TPBSO to its rivals, in words.
        rows: by basis.
        extensions: rows of solvers that came after the paper.
        best_known: the lowest objective of any run.
        illustration: the median run; None where no run was done.
        repeated_exactly: whether the repeated run has the same objective as the stored one.
    """

    name: str
    title: str
    figure: int
    unit: str
    conclusion: str
    rows: dict[str, list[Row]]
    extensions: list[Row]
    best_known: float
    illustration: Illustration | None
    repeated_exactly: bool


def render(evidence: Evidence, illustrations: Iterable[Illustration], size: Size, command: str, seconds: float) -> str:
    """The page.

    Args:
        evidence: of the runs and measurements.
        illustrations: of the cases, each of those that were done.
        size: of the reproduction.
        command: that makes the page.
        seconds: total time of the runs, added up over all workers.
    """
    environment = Environment(loader=FileSystemLoader(FOLDER), autoescape=True, undefined=StrictUndefined)
    environment.filters |= {"number": number, "picture": picture}
    judged = [(claim, claim.findings(evidence)) for claim in CLAIMS]
    by_case = {illustration.case: illustration for illustration in illustrations}
    return environment.get_template("report.html").render(
        player_style=STYLE,
        player_script=SCRIPT,
        style=Markup((FOLDER / "report.css").read_text(encoding="utf-8")),
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
        signs=compare_signs(evidence),
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


def case_section(name: str, evidence: Evidence, illustration: Illustration | None) -> CaseSection:
    """Everything about one case."""
    rows: dict[str, list[Row]] = {}
    conclusions, printed = [], TABLE_1.get(name, {})
    for basis in BASES:
        comparisons = against(evidence, [name], basis, (*RIVALS, PRINTED_SIGN))
        relations = {comparison.other: (comparison.relation(p), p) for comparison, p in comparisons}
        rows[basis] = []
        for solver in TABLE_SOLVERS:
            relation, p = relations.get(label(solver, basis), ("", 1.0))
            summary = evidence.of(name, solver, basis)
            title = SOLVER_TITLES[solver]
            rows[basis].append(Row(name=title, summary=summary, relation=relation, p=p, printed=printed.get(solver)))
        sentence = in_words({other: relation for other, (relation, _) in relations.items()}, basis)
        conclusions.append(f"{basis}: {sentence}")
    summaries = {solver: evidence.summaries.get((name, label(solver, EVALUATIONS))) for solver in EXTENSIONS}
    return CaseSection(
        name=name,
        title=TITLES[name].partition(": ")[2],
        figure=FIGURES[name],
        unit=rows[EVALUATIONS][0].summary.unit,
        conclusion="; ".join(conclusions),
        rows=rows,
        extensions=[
            Row(name=EXTENSION_TITLES[solver], summary=summary)
            for solver, summary in summaries.items()
            if summary is not None
        ],
        best_known=evidence.best_known(name),
        illustration=illustration,
        repeated_exactly=illustration is not None
        and illustration.objective == record_of(evidence, illustration).objective,
    )


def record_of(evidence: Evidence, illustration: Illustration) -> Record:
    """The stored record of the run that is illustrated."""
    solver = label("bso", ITERATIONS)
    records = (record for record in evidence.records if (record.case, record.solver) == (illustration.case, solver))
    return next(record for record in records if record.seed == illustration.seed)


def in_words(relations: Mapping[str, str], basis: str) -> str:
    """The relation of TPBSO to both rivals, as a sentence.

    Args:
        relations: "better", "worse" or "equal" by label of the other solver.
        basis: of the comparison.
    """
    rivals: dict[str, list[str]] = {}
    for rival in RIVALS:
        rivals.setdefault(relations[label(rival, basis)], []).append(NAMES[rival])
    phrases = {"better": "better than", "worse": "worse than", "equal": "no different from"}
    parts = ", ".join(f"{phrases[relation]} {' and '.join(names)}" for relation, names in rivals.items())
    return f"TPBSO is {parts}, and {phrases[relations[label(PRINTED_SIGN, basis)]]} itself with (28) as printed"


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
) -> tuple[list[dict[str, Any]], Picture | None]:
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


def number(value: float | None, digits: int = 4) -> str:
    """A number for a table, a dash where there is none."""
    if value is None or not isfinite(value):
        return "-"
    return f"{value:.{digits}g}" if abs(value) > NEGLIGIBLE else "0"


def picture(image: Picture, alt: str) -> Markup:
    """An image with its caption, its data within the page."""
    data = base64.b64encode(image.image).decode("ascii")
    return Markup(
        '<figure><img alt="{}" src="data:image/webp;base64,{}" loading="lazy"><figcaption>{}</figcaption></figure>'
    ).format(f"{alt}: {image.caption}", data, image.caption)
