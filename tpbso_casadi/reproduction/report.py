"""The report: one HTML page that holds everything and fetches nothing."""

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
from tpbso_casadi.reproduction.antenna_sign import signs
from tpbso_casadi.reproduction.case_figures import Illustration, Picture
from tpbso_casadi.reproduction.claims import CLAIMS, Claim, Finding, Verdict, against
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import BASES, BEYOND, EVALUATIONS, ITERATIONS, PRINTED, Size, label
from tpbso_casadi.reproduction.overview_figures import figure_17, growth_figure
from tpbso_casadi.reproduction.paper import FIGURES, NAMES, RIVALS, SPACE_ORDERS, TABLE_1, TIME_ORDERS, Order, Printed
from tpbso_casadi.scenario.builtin import TITLES
from tpbso_casadi.storage.versions import versions

HERE = Path(__file__).parent
ROUNDING = 1e-9  # what a standard deviation of equal numbers may be
ARMS = ("ga", "pso", "bso", PRINTED)
TITLE_OF = {**NAMES, PRINTED: "TPBSO, (28) as printed"}
TITLE_BEYOND = {"abso": "adaptive beetle swarm", "bso+polish": "TPBSO, then IPOPT", "ipopt": "IPOPT alone, 20 starts"}


@dataclass(frozen=True)
class Row:
    """A solver on a case, in words."""

    name: str
    summary: Summary
    against: str = ""
    p: float = 1.0
    printed: Printed | None = None


@dataclass(frozen=True)
class Case:
    """A case and all that there is to show of it."""

    name: str
    title: str
    figure: int
    unit: str
    verdict: str
    rows: dict[str, list[Row]]
    beyond: list[Row]
    best_known: float
    illustration: Illustration | None
    same: bool


def render(evidence: Evidence, illustrations: Iterable[Illustration], size: Size, command: str, seconds: float) -> str:
    """The page.

    Args:
        evidence: what was found.
        illustrations: by case.
        size: of the reproduction.
        command: that makes it.
        seconds: that its runs took, added up over all workers.
    """
    environment = Environment(loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined)
    environment.filters |= {"number": number, "picture": picture}
    judged = [(claim, claim.findings(evidence)) for claim in CLAIMS]
    shown = {illustration.case: illustration for illustration in illustrations}
    return environment.get_template("report.html").render(
        player_style=STYLE,
        player_script=SCRIPT,
        style=Markup((HERE / "report.css").read_text(encoding="utf-8")),
        date=date.today().isoformat(),
        size=size,
        command=command,
        seconds=seconds,
        versions=versions(),
        bases=BASES,
        judged=judged,
        counts=counts(judged),
        cases=[case_of(name, evidence, shown.get(name)) for name in TITLES],
        figure_17=figure_17(evidence),
        table_1=table_1(evidence),
        names=NAMES,
        tables=[
            ("Table 2: time", *growth_table(evidence.growth["time"], TIME_ORDERS, "seconds")),
            ("Table 3: memory", *growth_table(evidence.growth["space"], SPACE_ORDERS, "bytes")),
        ],
        signs=signs(evidence),
        failed=[record for record in evidence.records if record.error],
        records=evidence.records,
        missing=len(evidence.runs) - len(evidence.records),
    )


def counts(judged: Iterable[tuple[Claim, Mapping[str, Finding]]]) -> dict[str, Counter[Verdict]]:
    """How many claims have each verdict, by basis; a claim that has nothing to do with them counts on both."""
    found = {basis: Counter(dict.fromkeys(Verdict, 0)) for basis in BASES}
    for _, findings in judged:
        for basis in BASES:
            found[basis][findings[basis if basis in findings else ""].verdict] += 1
    return found


def case_of(name: str, evidence: Evidence, illustration: Illustration | None) -> Case:
    """Everything about one case."""
    rows: dict[str, list[Row]] = {}
    words, printed = [], TABLE_1.get(name, {})
    for basis in BASES:
        tests = {pair.theirs: (pair.verdict(p), p) for pair, p in against(evidence, [name], basis, (*RIVALS, PRINTED))}
        rows[basis] = []
        for arm in ARMS:
            verdict, p = tests.get(label(arm, basis), ("", 1.0))
            rows[basis].append(Row(TITLE_OF[arm], evidence.of(name, arm, basis), verdict, p, printed.get(arm)))
        words.append(f"{basis}: {in_words({rival: verdict for rival, (verdict, _) in tests.items()}, basis)}")
    known = {arm: evidence.summaries.get((name, label(arm, EVALUATIONS))) for arm in BEYOND}
    beyond = [Row(TITLE_BEYOND[arm], summary) for arm, summary in known.items() if summary is not None]
    unit = rows[EVALUATIONS][0].summary.unit
    title, verdicts = TITLES[name].partition(": ")[2], "; ".join(words)
    same = illustration is not None and illustration.objective == drawn_record(evidence, illustration).objective
    best = evidence.best_known(name)
    return Case(name, title, FIGURES[name], unit, verdicts, rows, beyond, best, illustration, same)


def drawn_record(evidence: Evidence, illustration: Illustration) -> Record:
    """What is kept of the run that is drawn."""
    arm = label("bso", ITERATIONS)
    of_arm = (record for record in evidence.records if (record.case, record.solver) == (illustration.case, arm))
    return next(record for record in of_arm if record.seed == illustration.seed)


def in_words(verdicts: Mapping[str, str], basis: str) -> str:
    """How TPBSO stands to both rivals, as a sentence."""
    by_word: dict[str, list[str]] = {}
    for rival in RIVALS:
        by_word.setdefault(verdicts[label(rival, basis)], []).append(NAMES[rival])
    phrases = {"better": "better than", "worse": "worse than", "equal": "no different from"}
    stands = ", ".join(f"{phrases[word]} {' and '.join(who)}" for word, who in by_word.items())
    return f"TPBSO is {stands}, and {phrases[verdicts[label(PRINTED, basis)]]} itself with (28) as printed"


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


def growth_table(
    grown: Mapping[str, Any], orders: Mapping[str, Order], unit: str
) -> tuple[list[dict[str, Any]], Picture | None]:
    """The rows of Table 2 or 3 beside what was measured, and its picture."""
    if not grown:
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
        for symbol, by_solver in grown[experiment].items()
    ]
    return rows, growth_figure(grown, orders, unit)


def number(value: float | None, digits: int = 4) -> str:
    """A number for a table, a dash where there is none."""
    if value is None or not isfinite(value):
        return "-"
    return f"{value:.{digits}g}" if abs(value) > ROUNDING else "0"


def picture(shown: Picture, alt: str) -> Markup:
    """An image with its caption, the data in it."""
    data = base64.b64encode(shown.image).decode("ascii")
    return Markup(
        '<figure><img alt="{}" src="data:image/webp;base64,{}" loading="lazy"><figcaption>{}</figcaption></figure>'
    ).format(f"{alt}: {shown.caption}", data, shown.caption)
