"""The experiment: cases of the paper, sizes, what its tables print, and the evidence gathered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.judging.grid import SolverSpec, grid, parse_solver
from tpbso_casadi.judging.run import Run, RunRecord
from tpbso_casadi.judging.statistics import Summary, summarise
from tpbso_casadi.scenario import TITLES, SolverSection, builtin, find_solver

FIGURES: dict[str, int] = {case: number for number, case in enumerate(TITLES, start=2)}  # in the paper's own order
POINT_TO_POINT = tuple(case for case in TITLES if case.startswith(("time", "rotation")))
TIME = tuple(case for case in TITLES if case.startswith("time"))
ROTATION = tuple(case for case in TITLES if case.startswith("rotation"))
OBSTACLES = tuple(case for case in TITLES if case.startswith("obstacle"))
PENTAGRAM = tuple(case for case in TITLES if case.startswith("pentagram"))
PATHS = tuple(case for case in TITLES if case.startswith(("pentagram", "closed-curve")))

NAMES = {"bso": "TPBSO", "pso": "PSO", "ga": "GA"}
RIVALS = ("pso", "ga")


@dataclass(frozen=True)
class Printed:
    """A mean and a standard deviation over 20 runs, s or rad."""

    mean: float
    std: float


TABLE_1: dict[str, dict[str, Printed]] = {
    "pentagram-time": {
        "ga": Printed(0.7982, 0.0757),
        "pso": Printed(0.7432, 0.0603),
        "bso": Printed(0.7139, 0.0420),
    },
    "pentagram-rotation": {
        "ga": Printed(25.4070, 1.3351),
        "pso": Printed(22.8910, 1.9832),
        "bso": Printed(22.3850, 1.0973),
    },
    "closed-curve-time": {
        "ga": Printed(1.4088, 0.1982),
        "pso": Printed(1.2569, 0.0370),
        "bso": Printed(1.1863, 0.0043),
    },
    "closed-curve-rotation": {
        "ga": Printed(24.3354, 0.2205),
        "pso": Printed(24.3594, 0.2050),
        "bso": Printed(24.1952, 0.2365),
    },
}


@dataclass(frozen=True)
class Order:
    """The growth that the paper prints in Table 2 or 3 for one experiment.

    Attributes:
        title: of the experiment.
        formula: as printed.
        exponents: by symbol, the power with which time or memory grows at most: n_i iterations, n_p population,
            n_d dimension, n_o points of the output, n_in of the input.
    """

    title: str
    formula: str
    exponents: dict[str, int]


TIME_ORDERS = {  # Table 2
    "algorithm": Order("in one iteration", "O(n_p n_d)", {"n_p": 1, "n_d": 1}),
    "point-to-point": Order("Experiment I", "O(n_i n_p n_d n_o)", {"n_i": 1, "n_p": 1, "n_d": 1, "n_o": 1}),
    "path": Order("Experiment II", "O(n_i n_p n_o)", {"n_i": 1, "n_p": 1, "n_d": 0, "n_o": 1}),
}
SPACE_ORDERS = {  # Table 3
    "algorithm": Order("the algorithm itself", "O(n_p n_d)", {"n_p": 1, "n_d": 1}),
    "point-to-point": Order("Experiment I", "O((n_p + n_o) n_d)", {"n_p": 1, "n_d": 1, "n_o": 1}),
    "path": Order("Experiment II", "O(n_o + n_in + n_p n_d)", {"n_p": 1, "n_d": 1, "n_o": 1, "n_in": 1}),
}


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
QUICK = Size(runs=1, iterations=10, population=50, evaluations=1_500, extensions=False)

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


CONVERGENCE_TOLERANCE = 0.01  # a search has converged when its best cost is within 1 % of its last
NEAR_BEST_KNOWN = 0.10  # a search has arrived when its best cost is within 10 % of the best known objective
CostHistory: TypeAlias = Sequence[float | None]  # the best cost after each iteration, None where it is not finite


@dataclass(frozen=True)
class Evidence:
    """Results of all runs and measurements of a reproduction.

    Attributes:
        runs: all of the reproduction.
        records: of those that were done.
        convergence: by case and basis, after how many iterations each run of TPBSO had converged, and of how many.
        distances: by path case and basis, the largest distance from a given point in each run of TPBSO, m.
        histories: of each run, by case, solver (of the paper's three) and basis.
        scaling: of time and memory, see :func:`tpbso_casadi.reproduction.scaling.measure_scaling`.
        pace: s, by basis, case and solver, see :func:`tpbso_casadi.reproduction.scaling.measure_pace`.
    """

    runs: list[Run]
    records: list[RunRecord]
    convergence: dict[tuple[str, str], list[tuple[int, int]]]
    distances: dict[tuple[str, str], list[float]]
    histories: Mapping[tuple[str, str, str], list[CostHistory]]
    scaling: dict[str, Any]
    pace: dict[str, dict[str, dict[str, list[float]]]]

    @cached_property
    def summaries(self) -> dict[tuple[str, str], Summary]:
        """The summaries by case and label of the solver."""
        return {(summary.case, summary.solver): summary for summary in summarise(self.records)}

    def of(self, case: str, solver: str, basis: str) -> Summary:
        """The runs of a solver.

        Raises:
            KeyError: there are none.
        """
        return self.summaries[case, label(solver, basis)]

    def best_known(self, case: str) -> float:
        """The lowest objective of any feasible plan of any solver; NaN where there is none."""
        lowest = [summary.best for (name, _), summary in self.summaries.items() if name == case]
        return min(filter(np.isfinite, lowest), default=float("nan"))

    @cached_property
    def fewest_runs(self) -> int:
        """The fewest runs of any of the paper's three solvers on any case and basis."""
        labels = {label(solver, basis) for solver in NAMES for basis in BASES}
        return min(summary.objectives.size for (_, solver), summary in self.summaries.items() if solver in labels)

    def arrivals(self, case: str, solver: str, basis: str) -> FloatArray:
        """The share of each search after which its best cost was near the best known, (runs,); inf where never."""
        near = self.best_known(case) * (1.0 + NEAR_BEST_KNOWN)
        return np.array([arrival(history, near) for history in self.histories[case, solver, basis]], dtype=np.float64)

    def pace_ratios(self, rival: str, basis: str) -> list[float]:
        """A rival's time over that of TPBSO, geometric mean over the cases, in each round of the measurement."""
        ratios = [np.array(seconds[rival]) / np.array(seconds["bso"]) for seconds in self.pace[basis].values()]
        return [float(ratio) for ratio in np.exp(np.mean(np.log(ratios), axis=0))]


def arrival(history: CostHistory, near: float) -> float:
    """The share of a search after which its best cost was at most ``near``; inf where it never was."""
    there = np.array(history, dtype=np.float64) <= near
    return float(np.argmax(there)) / max(there.size - 1, 1) if there.any() else float("inf")


def convergence_iteration(history: CostHistory, objective_upper_bound: float) -> tuple[int, int] | None:
    """After how many iterations a search had converged, and of how many; None without a feasible plan.

    Args:
        history: the best cost after each iteration, the initial population first; None where it is not finite.
        objective_upper_bound: that no feasible cost exceeds.
    """
    cost = np.array(history, dtype=np.float64)
    if not cost[-1] <= objective_upper_bound:
        return None
    return int(np.argmax(cost <= cost[-1] * (1.0 + CONVERGENCE_TOLERANCE))), len(cost) - 1
