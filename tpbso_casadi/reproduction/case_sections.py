"""A case's section of the report: its table, parameters and pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from problems import Variable
from solvers import SOLVERS
from tpbso_casadi.judging.run import Record
from tpbso_casadi.judging.statistics import Judgement, Relation, Summary
from tpbso_casadi.reproduction.experiment import (
    BASES,
    EVALUATIONS,
    EXTENSIONS,
    FIGURES,
    ITERATIONS,
    NAMES,
    PRINTED,
    PRINTED_LOW_LAMBDA,
    PRINTED_SIGN,
    RIVALS,
    TABLE_1,
    Evidence,
    Printed,
    label,
)
from tpbso_casadi.reproduction.judgements import against
from tpbso_casadi.reproduction.page_figures import Illustration
from tpbso_casadi.scenario import TITLES, builtin

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


@dataclass(frozen=True, kw_only=True)
class CaseParameters:
    """The numbers of a case, in words.

    Attributes:
        case: its name.
        arm: lengths in m, limits in rad/s and rad/s^2.
        task: m and s.
        obstacles: m and rad.
        model: samples, formulation and the like.
        box: of the decision variables.
        weights: lambda_1 and lambda_2 of (15), (25).
    """

    case: str
    arm: str
    task: str
    obstacles: str
    model: str
    box: str
    weights: str


@dataclass(frozen=True, kw_only=True)
class HyperParameter:
    """A hyper-parameter: its meaning and its value in each solver that has it."""

    name: str
    meaning: str
    values: dict[str, str]


def case_parameters() -> list[CaseParameters]:
    """Of every case."""
    return [_parameters(case) for case in TITLES]


def _parameters(case: str) -> CaseParameters:
    content = builtin(case).table()
    problem = builtin(case).problem()
    weights = problem.weights
    return CaseParameters(
        case=case,
        arm=listed(content["arm"]),
        task=listed(content["task"]),
        obstacles="; ".join(map(listed, content["obstacles"])) or "none",
        model=listed({key: value for key, value in content["model"].items() if value != []}),
        box=box_in_words(problem.variables),
        weights=f"{value_in_words(weights.limit)}, {value_in_words(weights.reach)}",
    )


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
    return ", ".join(f"{key.replace('_', ' ')} {value_in_words(value)}" for key, value in table.items())


def value_in_words(value: object) -> str:
    """A value: numbers with at most five digits, lists in brackets."""
    if isinstance(value, float | int):
        return f"{value:.5g}"
    if isinstance(value, list | tuple):
        return f"({', '.join(map(value_in_words, value))})"
    return str(value)


def settings() -> list[HyperParameter]:
    """The hyper-parameters of the paper's three solvers, and those that its printed form sets otherwise."""
    columns: dict[str, Any] = {NAMES[name]: SOLVERS[name]() for name in NAMES}
    columns["TPBSO as printed"] = SOLVERS["bso"](**SOLVERS["bso"].presets["printed"])
    names = dict.fromkeys(field.name for solver in columns.values() for field in fields(solver))
    return [
        HyperParameter(
            name=name,
            meaning=MEANINGS[name],
            values={title: value_in_words(getattr(solver, name, "")) for title, solver in columns.items()},
        )
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


@dataclass(frozen=True, kw_only=True)
class SolverOnCase:
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
class ReportSection:
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
    rows: dict[str, list[SolverOnCase]]
    extensions: list[SolverOnCase]
    best_known: float
    illustration: Illustration | None
    repeated_exactly: bool


def case_section(name: str, evidence: Evidence, illustration: Illustration | None) -> ReportSection:
    """Everything about one case."""
    rows: dict[str, list[SolverOnCase]] = {}
    conclusions, printed = [], TABLE_1.get(name, {})
    for basis in BASES:
        others = (*RIVALS, *AS_PRINTED)
        judgements = dict(zip(others, against(evidence, [name], basis, others), strict=True))
        rows[basis] = [
            SolverOnCase(
                name=title,
                summary=evidence.of(name, solver, basis),
                judgement=judgements.get(solver),
                printed=printed.get(solver),
            )
            for solver, title in SOLVER_TITLES.items()
        ]
        conclusions.append(f"{basis}: TPBSO is {in_words(judgements)}")
    summaries = {solver: evidence.summaries.get((name, label(solver, EVALUATIONS))) for solver in EXTENSIONS}
    return ReportSection(
        name=name,
        title=TITLES[name].partition(": ")[2],
        figure=FIGURES[name],
        unit=rows[EVALUATIONS][0].summary.unit,
        conclusion="; ".join(conclusions),
        rows=rows,
        extensions=[
            SolverOnCase(name=EXTENSION_TITLES[solver], summary=summary)
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
