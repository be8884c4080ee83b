"""All solvers against each other: equal evaluations, equal iterations, built-in and generated cases.

Every run has its own generator and an exact budget. A run's shortfall is ln(cost / best known), at most 3, where the
best known is the lowest cost that any run of the case reached; an infeasible run has 3. Ranks are by mean shortfall
within a case and averaged over cases; p-values are Wilcoxon signed-rank tests of the case means against those of
``abso``, corrected by Holm. The tables go to standard output, the runs to a CSV file, the anytime curves to a picture.

    python -m benchmarks.solvers --out runs/solvers                          the whole comparison
    python -m benchmarks.solvers --solvers abso,pso --budgets 5000 --seeds 5 a part of it
    python -m benchmarks.solvers --functions                                 standard functions with known optima
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import astuple, dataclass, fields
from functools import cache
from itertools import groupby, product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import rankdata, wilcoxon

from benchmarks.random_scenarios import random_scenarios
from problems import Problem
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, PopulationFunction
from solvers import EXTERNAL, SOLVERS, Budget, SearchBox, Solver, minimize
from tpbso_casadi import find_solver
from tpbso_casadi.judging.statistics import holm
from tpbso_casadi.scenario.cases import TITLES, builtin

GENERATED_SEED = 2024
MAX_SHORTFALL = 3.0
SOLVED_SHORTFALL = 0.01
EQUAL_ITERATIONS = 200
REFERENCE_SOLVER = "abso"
TARGETS = np.logspace(0.0, -4.0, 41)  # shortfalls
MOMENTS = np.logspace(1.0, 5.0, 81)  # evaluations


@dataclass(frozen=True)
class Job:
    """One run: a case, a solver, its budget in evaluations (0: ``EQUAL_ITERATIONS`` iterations of 50), a seed."""

    case: str
    solver: str
    budget: int
    seed: int


@dataclass(frozen=True)
class Run(Job):
    """A job and its result."""

    cost: float
    feasible: bool
    evaluations: int
    seconds: float
    reached: tuple[float, ...] = ()


@cache
def problem(case: str) -> Problem[Any]:
    """A built-in case, or the n-th generated one."""
    if case in TITLES:
        return builtin(case).problem()
    number = int(case.removeprefix("random-"))
    return random_scenarios(GENERATED_SEED, number + 1)[number].problem()


@cache
def evaluator(case: str) -> PopulationFunction:
    return problem(case).evaluator(EvaluationOptions("native"))


def compiled(case: str) -> str:
    """Fill the cache before anything is timed."""
    evaluator(case)(problem(case).bounds[0][None])
    return case


def solve(job: Job) -> Run:
    planned, kind = problem(job.case), find_solver(job.solver)
    assert issubclass(kind, Solver)
    equal_iterations = job.budget == 0
    solver = kind(population=50) if equal_iterations else kind()
    budget = Budget(iterations=EQUAL_ITERATIONS) if equal_iterations else Budget(job.budget)
    result = minimize(evaluator(job.case), SearchBox(*planned.bounds), solver, budget, job.seed)
    assert job.budget in (0, result.evaluations)
    at = np.searchsorted(result.history.evaluations, MOMENTS, side="right") - 1
    so_far = np.where(at >= 0, result.history.cost[at], np.inf)
    feasible = result.cost <= planned.objective_upper_bound
    return Run(*astuple(job), result.cost, feasible, result.evaluations, result.seconds, tuple(so_far.tolist()))


def shortfalls(runs: Sequence[Run]) -> dict[Job, float]:
    """The shortfall of each job: how far its cost is above the best known."""
    best = {case: min(run.cost for run in group if run.feasible) for case, group in by(runs, "case").items()}
    return {job_of(run): shortfall(run.cost, best[run.case]) if run.feasible else MAX_SHORTFALL for run in runs}


def shortfall(cost: float, best: float) -> float:
    return min(float(np.log(max(cost, best) / best)), MAX_SHORTFALL)


def by(runs: Sequence[Run], field: str) -> dict[str, list[Run]]:
    """Runs in groups."""
    ordered = sorted(runs, key=lambda run: str(getattr(run, field)))
    return {key: list(group) for key, group in groupby(ordered, key=lambda run: str(getattr(run, field)))}


def report(runs: Sequence[Run]) -> None:
    """The tables, Markdown."""
    behind = shortfalls(runs)
    budgets = sorted({run.budget for run in runs})
    for budget in budgets:
        title = f"{budget} evaluations" if budget else f"{EQUAL_ITERATIONS} iterations of 50"
        part = [run for run in runs if run.budget == budget]
        summary(title, part, behind)


def summary(title: str, runs: Sequence[Run], behind: dict[Job, float]) -> None:
    """One budget."""
    solvers = sorted({run.solver for run in runs}, key=list({**SOLVERS, **EXTERNAL}).index)
    cases = sorted({run.case for run in runs})
    values = {(case, solver): [behind[job_of(run)] for run in group] for (case, solver), group in grouped(runs).items()}
    means = np.array([[np.mean(values[case, solver]) for solver in solvers] for case in cases])
    ranks = rankdata(np.round(means, 9), axis=1).mean(axis=0)
    others = [solver for solver in solvers if solver != REFERENCE_SOLVER and REFERENCE_SOLVER in solvers]
    p_values = dict(zip(others, holm([against(means, solvers, solver) for solver in others]), strict=True))
    print(f"\n{title}: {len(cases)} cases\n")
    print("| solver | rank | mean shortfall | std over seeds | within 1 % | infeasible | abso: + ~ - | p |")
    print("|---|---|---|---|---|---|---|---|")
    for column in np.argsort(ranks):
        solver = solvers[column]
        mine = [run for run in runs if run.solver == solver]
        every = [values[case, solver] for case in cases]
        spread = np.mean([np.std(part, ddof=1) for part in every if len(part) > 1])
        within = np.mean([value <= SOLVED_SHORTFALL for part in every for value in part])
        lost = sum(not run.feasible for run in mine)
        tally = "" if solver == REFERENCE_SOLVER else score(values, cases, solver)
        p = "" if solver == REFERENCE_SOLVER else f"{p_values.get(solver, np.nan):.1e}"
        cells = f"{means[:, column].mean():.4f} | {spread:.4f} | {within:.0%} | {lost} of {len(mine)}"
        print(f"| {solver} | {ranks[column]:.2f} | {cells} | {tally} | {p} |")


def job_of(run: Run) -> Job:
    return Job(run.case, run.solver, run.budget, run.seed)


def grouped(runs: Sequence[Run]) -> dict[tuple[str, str], list[Run]]:
    groups: dict[tuple[str, str], list[Run]] = {}
    for run in runs:
        groups.setdefault((run.case, run.solver), []).append(run)
    return groups


def against(means: FloatArray, solvers: Sequence[str], solver: str) -> float:
    """p-value that a solver's case means differ from the reference's by chance."""
    difference = means[:, solvers.index(solver)] - means[:, solvers.index(REFERENCE_SOLVER)]
    return 1.0 if np.allclose(difference, 0.0) else float(wilcoxon(difference).pvalue)


def score(values: dict[tuple[str, str], list[float]], cases: Sequence[str], solver: str) -> str:
    """Cases in which abso is better, no difference is shown, or it is worse: a rank-sum test at 5 % decides."""
    from scipy.stats import mannwhitneyu  # noqa: PLC0415

    count = {"win": 0, "tie": 0, "loss": 0}
    for case in cases:
        ours, theirs = np.round(values[case, REFERENCE_SOLVER], 6), np.round(values[case, solver], 6)
        if np.ptp([*ours, *theirs]) == 0.0 or mannwhitneyu(ours, theirs).pvalue >= 0.05:
            count["tie"] += 1
        else:
            count["win" if np.mean(ours) < np.mean(theirs) else "loss"] += 1
    return " / ".join(str(number) for number in count.values())


def anytime(runs: Sequence[Run], path: Path) -> None:
    """Share of (case, seed, target) reached against evaluations, of the runs with the largest budget."""
    import matplotlib.pyplot as plt  # noqa: PLC0415

    largest = max(run.budget for run in runs)
    best = {case: min(run.cost for run in group if run.feasible) for case, group in by(runs, "case").items()}
    figure, axes = plt.subplots(figsize=(7, 4.5), layout="constrained")
    for solver, group in by([run for run in runs if run.budget == largest], "solver").items():
        costs = np.array([run.reached for run in group])
        floor = np.array([best[run.case] for run in group])[:, None]
        gap = np.log(np.maximum(costs, floor) / floor)
        share = (gap[:, :, None] <= TARGETS).mean(axis=(0, 2))
        shown = largest >= MOMENTS
        axes.plot(MOMENTS[shown], share[shown], label=solver)
    axes.set(xscale="log", xlabel="evaluations", ylabel="targets reached", ylim=(0.0, 1.0))
    axes.set_title(f"targets: 1e-4 to 1 above the best known (log), budget {largest}")
    axes.legend()
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=120)
    plt.close(figure)


FUNCTIONS: dict[str, tuple[float, Callable[[FloatArray], FloatArray]]] = {
    "sphere": (5.0, lambda x: (x**2).sum(axis=1)),
    "Rosenbrock": (
        5.0,
        lambda x: (100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1.0 - x[:, :-1]) ** 2).sum(axis=1),
    ),
    "Rastrigin": (5.12, lambda x: (x**2 - 10.0 * np.cos(2.0 * np.pi * x) + 10.0).sum(axis=1)),
    "Ackley": (
        32.0,
        lambda x: (
            20.0
            - 20.0 * np.exp(-0.2 * np.sqrt((x**2).mean(axis=1)))
            + np.e
            - np.exp(np.cos(2.0 * np.pi * x).mean(axis=1))
        ),
    ),
}


def standard(job: tuple[str, int, str, int]) -> float:
    """Cost that a solver reaches on a standard function, shifted off the centre of its box."""
    name, dimension, solver, seed = job
    half, function = FUNCTIONS[name]
    shift = np.random.default_rng(0).uniform(-half / 4.0, half / 4.0, dimension)
    box = SearchBox(np.full(dimension, -half), np.full(dimension, half))
    kind = find_solver(solver)
    assert issubclass(kind, Solver)
    moved = (lambda x: function(x - shift)) if name != "Rosenbrock" else function
    return minimize(moved, box, kind(), Budget(5000 * dimension), seed).cost


def functions(solvers: Sequence[str], workers: int) -> None:
    """Medians of nine seeds, 5,000 d evaluations; every optimum is 0."""
    print(f"| function | d | {' | '.join(solvers)} |\n|---|---|{'---|' * len(solvers)}")
    with ProcessPoolExecutor(workers) as pool:
        for name, dimension in product(FUNCTIONS, (10, 30)):
            jobs = [(name, dimension, solver, seed) for solver in solvers for seed in range(9)]
            costs = np.array(list(pool.map(standard, jobs))).reshape(len(solvers), 9)
            cells = " | ".join(f"{value:.1e}" for value in np.median(costs, axis=1))
            print(f"| {name} | {dimension} | {cells} |", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solvers", default=",".join([*SOLVERS, *EXTERNAL]))
    parser.add_argument("--budgets", default="1500,5000,15000,50000", help="evaluations; 0 is equal iterations")
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--external-seeds", type=int, default=8, help="of external solvers, which are slow")
    parser.add_argument("--external-up-to", type=int, default=15_000, help="evaluations")
    parser.add_argument("--generated", type=int, default=30)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/solvers"))
    parser.add_argument("--functions", action="store_true")
    options = parser.parse_args()
    solvers = options.solvers.split(",")
    if options.functions:
        functions(solvers, options.workers)
        return
    cases = [*TITLES, *(f"random-{number}" for number in range(options.generated))]
    budgets = [int(budget) for budget in options.budgets.split(",")]
    options.out.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(options.workers) as pool:
        list(pool.map(compiled, cases))
        jobs = [
            Job(*job)
            for job in product(cases, solvers, budgets, range(1, options.seeds + 1))
            if job[1] in SOLVERS or (0 < job[2] <= options.external_up_to and job[3] <= options.external_seeds)
        ]
        runs = list(pool.map(solve, jobs, chunksize=options.seeds))
    with (options.out / "runs.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([field.name for field in fields(Run)][:-1])
        writer.writerows(astuple(run)[:-1] for run in runs)
    report(runs)
    anytime(runs, options.out / "anytime.png")


if __name__ == "__main__":
    main()
