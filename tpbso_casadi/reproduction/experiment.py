"""Who is compared with whom, and with how much effort: the runs of the reproduction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tpbso_casadi.campaign import Run, SolverSpec, grid
from tpbso_casadi.campaign.grid import parse_solver
from tpbso_casadi.scenario.builtin import TITLES, builtin


@dataclass(frozen=True)
class Size:
    """How large a reproduction is.

    Attributes:
        runs: of each arm on each case.
        iterations: of a swarm of ``population``, the paper's basis of comparison.
        population: m there.
        evaluations: of each run, the fair basis: those that the beetles price in so many iterations.
        beyond: whether what came after the paper runs too.
    """

    runs: int
    iterations: int
    population: int
    evaluations: int
    beyond: bool


FULL = Size(runs=20, iterations=200, population=50, evaluations=30_000, beyond=True)
QUICK = Size(runs=3, iterations=20, population=50, evaluations=3_000, beyond=False)

ITERATIONS, EVALUATIONS = "equal iterations", "equal evaluations"
BASES = (ITERATIONS, EVALUATIONS)
PRINTED = "bso(antenna_sign=printed)"
LOW = "bso(lambda_=0.4)"
LOW_PRINTED = "bso(lambda_=0.4,antenna_sign=printed)"
BOTH_BASES = ("bso", PRINTED, "pso", "ga")
EVALUATIONS_ALONE = (LOW, LOW_PRINTED)
BEYOND = ("abso", "bso+polish", "ipopt")


def label(solver: str, basis: str) -> str:
    """What an arm is called in the store and in tables."""
    return f"{solver}, {basis}"


def campaign(size: Size) -> list[Run]:
    """All runs; with IPOPT, which counts no candidates, its own budget of starts."""
    budgets: dict[str, dict[str, Any]] = {
        ITERATIONS: {"population": size.population, "iterations": size.iterations},
        EVALUATIONS: {"evaluations": size.evaluations},
    }
    arms = [(solver, basis) for basis in BASES for solver in BOTH_BASES]
    if size.beyond:
        arms += [(solver, EVALUATIONS) for solver in (*EVALUATIONS_ALONE, *BEYOND)]
    specs = [_spec(solver, basis, budgets[basis]) for solver, basis in arms]
    return grid({case: builtin(case) for case in TITLES}, specs, range(1, size.runs + 1))


def _spec(solver: str, basis: str, budget: dict[str, Any]) -> SolverSpec:
    found = parse_solver(solver)
    own = {} if found.name == "ipopt" else budget
    return SolverSpec(label(solver, basis), found.name, found.settings, found.polish_starts, own)
