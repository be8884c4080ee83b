"""What the page says of each case: its rows, comparisons and illustration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from tpbso_casadi.campaign import Record
from tpbso_casadi.campaign.statistics import Judgement, Relation, Summary
from tpbso_casadi.reproduction.claims.against_rivals import against
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.experiment import (
    BASES,
    EVALUATIONS,
    EXTENSIONS,
    ITERATIONS,
    PRINTED,
    PRINTED_LOW_LAMBDA,
    PRINTED_SIGN,
    label,
)
from tpbso_casadi.reproduction.page.case_figures import Illustration
from tpbso_casadi.reproduction.paper import FIGURES, NAMES, RIVALS, TABLE_1, Printed
from tpbso_casadi.scenario.cases.builtin import TITLES

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


@dataclass(frozen=True, kw_only=True)
class Row:
    """A solver on a case.

    Attributes:
        name: of the solver, in words.
        summary: of its runs.
        judgement: of TPBSO against it; None for TPBSO itself.
        printed: its numbers in the paper's Table 1, if they stand there.
    """

    name: str
    summary: Summary
    judgement: Judgement | None = None
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


def case_section(name: str, evidence: Evidence, illustration: Illustration | None) -> CaseSection:
    """Everything about one case."""
    rows: dict[str, list[Row]] = {}
    conclusions, printed = [], TABLE_1.get(name, {})
    for basis in BASES:
        others = (*RIVALS, *AS_PRINTED)
        judgements = dict(zip(others, against(evidence, [name], basis, others), strict=True))
        rows[basis] = [
            Row(
                name=title,
                summary=evidence.of(name, solver, basis),
                judgement=judgements.get(solver),
                printed=printed.get(solver),
            )
            for solver, title in SOLVER_TITLES.items()
        ]
        conclusions.append(f"{basis}: TPBSO is {in_words(judgements)}")
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
