"""The runs of the reproduction: solvers, budgets and bases of comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tpbso_casadi.campaign import Run, SolverSpec, grid
from tpbso_casadi.campaign.grid import parse_solver
from tpbso_casadi.scenario.cases.builtin import TITLES, builtin
from tpbso_casadi.scenario.catalogues import find_solver
from tpbso_casadi.scenario.scenario import SolverSection


@dataclass(frozen=True)
class Size:
    """How large a reproduction is.

    Attributes:
        runs: of each solver on each case.
        iterations: of a swarm of ``population``, the paper's basis of comparison.
        population: m there.
        evaluations: of each run, the fair basis: as many as the beetles need for these iterations.
        extensions: whether solvers that came after the paper run too.
    """

    runs: int
    iterations: int
    population: int
    evaluations: int
    extensions: bool


FULL = Size(runs=20, iterations=200, population=50, evaluations=30_000, extensions=True)
QUICK = Size(runs=3, iterations=20, population=50, evaluations=3_000, extensions=False)

ITERATIONS, EVALUATIONS = "equal iterations", "equal evaluations"
BASES = (ITERATIONS, EVALUATIONS)
PRINTED_SIGN = "bso(antenna_sign=printed)"
LOW_LAMBDA = "bso(lambda_=0.4)"
LOW_LAMBDA_PRINTED_SIGN = "bso(lambda_=0.4,antenna_sign=printed)"
PRINTED = "bso(printed)"  # (27) without inertia and (28) with its sign
PRINTED_LOW_LAMBDA = "bso(printed,lambda_=0.4)"
ON_BOTH_BASES = ("bso", PRINTED_SIGN, PRINTED, PRINTED_LOW_LAMBDA, "pso", "ga")
ON_EVALUATIONS_ONLY = (LOW_LAMBDA, LOW_LAMBDA_PRINTED_SIGN)
EXTENSIONS = ("abso", "bso+polish", "ipopt")


def label(solver: str, basis: str) -> str:
    """The label of a solver on a basis of comparison, in the store and in tables."""
    return f"{solver}, {basis}"


def campaign(size: Size) -> list[Run]:
    """All runs; a gradient-based solver, which counts no candidates, has its own default budget."""
    compared = [(solver, basis) for basis in BASES for solver in ON_BOTH_BASES]
    if size.extensions:
        compared += [(solver, EVALUATIONS) for solver in (*ON_EVALUATIONS_ONLY, *EXTENSIONS)]
    specs = [_spec(solver, basis, size) for solver, basis in compared]
    return grid({case: builtin(case) for case in TITLES}, specs, range(1, size.runs + 1))


def solver_section(name: str, basis: str, size: Size) -> SolverSection:
    """A metaheuristic with its defaults and the budget of a basis of comparison."""
    return SolverSection(name=name, **_budget(basis, size))


def _budget(basis: str, size: Size) -> dict[str, Any]:
    budgets = {
        ITERATIONS: {"population": size.population, "iterations": size.iterations},
        EVALUATIONS: {"evaluations": size.evaluations},
    }
    return budgets[basis]


def _spec(solver: str, basis: str, size: Size) -> SolverSpec:
    spec = parse_solver(solver)
    table = {} if find_solver(spec.name).solves_program else _budget(basis, size)
    return SolverSpec(label(solver, basis), spec.name, spec.settings, spec.polish_starts, table)
