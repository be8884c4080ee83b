"""The report: one self-contained HTML page."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Iterable, Mapping
from datetime import date
from math import isfinite
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from tpbso_casadi.animation import SCRIPT, STYLE
from tpbso_casadi.campaign.statistics import p_text
from tpbso_casadi.reproduction.as_printed import antenna_shares, compare_with_printed
from tpbso_casadi.reproduction.claims.catalogue import CLAIMS
from tpbso_casadi.reproduction.claims.claim import MINIMUM_RUNS, Claim
from tpbso_casadi.reproduction.claims.finding import ClaimOutcome, Finding
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import BASES, Size
from tpbso_casadi.reproduction.pace import CASES as PACE_CASES
from tpbso_casadi.reproduction.page.case_figures import Illustration, Picture
from tpbso_casadi.reproduction.page.case_sections import case_section
from tpbso_casadi.reproduction.page.overview_figures import figure_17, scaling_figure
from tpbso_casadi.reproduction.page.parameters import CONSTRAINTS, case_parameters, settings
from tpbso_casadi.reproduction.paper import NAMES, SPACE_ORDERS, TABLE_1, TIME_ORDERS, Order
from tpbso_casadi.scenario.cases.builtin import TITLES
from tpbso_casadi.storage.versions import versions

FOLDER = Path(__file__).parent
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
    environment = Environment(loader=FileSystemLoader(FOLDER), autoescape=True, undefined=StrictUndefined)
    environment.filters |= {"number": number, "picture": picture, "p_text": p_text}
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
