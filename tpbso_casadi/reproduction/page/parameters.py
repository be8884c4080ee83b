"""Everything that the results depend on, as the page states it: scenarios, search boxes, weights, solver constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from problems.encodings.encoding import Variable
from solvers import SOLVERS
from tpbso_casadi.reproduction.paper import NAMES
from tpbso_casadi.scenario.cases.builtin import TITLES, builtin

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
class Setting:
    """A hyper-parameter: its meaning and its value in each solver that has it."""

    name: str
    meaning: str
    values: dict[str, str]


def case_parameters() -> list[CaseParameters]:
    """Of every case."""
    return [_parameters(case) for case in TITLES]


def _parameters(case: str) -> CaseParameters:
    content = builtin(case).model_dump(exclude_none=True)
    problem = builtin(case).problem()
    weights = problem.weights
    return CaseParameters(
        case=case,
        arm=listed(content["arm"]),
        task=listed(content["task"]),
        obstacles="; ".join(map(listed, content["obstacles"])) or "none",
        model=listed({key: value for key, value in content["model"].items() if value != []}),
        box=box_in_words(problem.variables),
        weights=f"{in_words(weights.limit)}, {in_words(weights.reach)}",
    )


def box_in_words(variables: Sequence[Variable]) -> str:
    """The ranges of the decision variables; those of an array together."""
    groups: dict[str, Variable] = {}
    counts: dict[str, int] = {}
    for variable in variables:
        name = variable.name.partition("[")[0]
        groups[name], counts[name] = variable, counts.get(name, 0) + 1
    return ", ".join(
        f"{name}{f' ({counts[name]})' if counts[name] > 1 else ''} {in_words(v.lower)} to {in_words(v.upper)} {v.unit}"
        for name, v in groups.items()
    )


def listed(table: Mapping[str, Any]) -> str:
    """Keys and values of a table of a scenario, in words."""
    return ", ".join(f"{key.replace('_', ' ')} {in_words(value)}" for key, value in table.items())


def in_words(value: object) -> str:
    """A value: numbers with at most five digits, lists in brackets."""
    if isinstance(value, float | int):
        return f"{value:.5g}"
    if isinstance(value, list | tuple):
        return f"({', '.join(map(in_words, value))})"
    return str(value)


def settings() -> list[Setting]:
    """The hyper-parameters of the paper's three solvers, and those that its printed form sets otherwise."""
    columns: dict[str, Any] = {NAMES[name]: SOLVERS[name]() for name in NAMES}
    columns["TPBSO as printed"] = SOLVERS["bso"](**SOLVERS["bso"].presets["printed"])
    names = dict.fromkeys(field.name for solver in columns.values() for field in fields(solver))
    return [
        Setting(
            name=name,
            meaning=MEANINGS[name],
            values={title: in_words(getattr(solver, name, "")) for title, solver in columns.items()},
        )
        for name in names
    ]
