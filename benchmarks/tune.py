"""How the solvers' defaults were chosen: the same random search, with the same effort, for each of them.

Every trial draws hyper-parameters from the ranges below and runs them on generated scenarios that no other benchmark
uses, a few seeds each. Its score is the mean shortfall ln(cost / best known), at most 3 and 3 where infeasible; the
best known is the lowest cost that any run of any solver reached. The first trial of each solver is its present
default. The best few are run again with fresh seeds, and that second score decides.

    python -m benchmarks.tune --trials 32 --evaluations 15000 --seeds 2 --workers 2
"""

from __future__ import annotations

import argparse
from concurrent.futures import Executor, ProcessPoolExecutor
from functools import cache
from typing import Any

import numpy as np

from benchmarks.random_scenarios import random_scenarios
from problems import Problem
from problems.base import FloatArray
from problems.evaluation import EvaluationOptions, PopulationFunction
from solvers import SOLVERS, Budget, SearchBox, minimize

TRAINING_SEED, TRAINING_CASES = 7, 16  # not the seed of benchmarks.solvers
FINALISTS, CONFIRMING_SEEDS = 3, 8
MAX_SHORTFALL = 3.0


def draw(solver: str, rng: np.random.Generator) -> dict[str, Any]:
    """One random setting of a solver."""
    population = int(rng.choice([15, 20, 30, 40, 50, 70, 100]))
    effort = int(rng.choice([40, 60, 80, 120, 170, 240]))
    if solver == "ga":
        return {
            "population": population,
            "tournament": int(rng.integers(2, 5)),
            "crossover_rate": round(rng.uniform(0.6, 1.0), 2),
            "crossover_eta": round(float(10 ** rng.uniform(0.0, 1.5)), 1),
            "mutation_rate": round(rng.uniform(0.03, 0.4), 2),
            "mutation_eta": round(float(10 ** rng.uniform(0.7, 2.0)), 1),
        }
    if solver == "abso":
        return {
            "effort": effort,
            "antenna": round(rng.uniform(0.35, 0.7), 2),
            "momentum": round(rng.uniform(0.0, 0.8), 2),
            "leaders_first": round(rng.uniform(0.1, 0.6), 2),
            "leaders_last": round(rng.uniform(0.03, 0.2), 2),
            "directions_first": round(rng.uniform(0.4, 1.0), 2),
            "directions_last": round(rng.uniform(0.7, 1.0), 2),
            "principal": round(rng.uniform(0.0, 1.0), 2),
            "archive_rate": round(rng.uniform(0.0, 2.0), 2),
        }
    if solver == "lshade":
        return {
            "effort": effort,
            "memory_size": int(rng.integers(3, 12)),
            "best": round(rng.uniform(0.05, 0.3), 2),
            "archive_rate": round(rng.uniform(0.0, 3.0), 2),
        }
    swarm = {
        "population": population,
        "c1": round(rng.uniform(1.0, 2.2), 2),
        "c2": round(rng.uniform(1.0, 2.2), 2),
        "inertia_first": round(rng.uniform(0.6, 1.0), 2),
        "inertia_last": round(rng.uniform(0.2, 0.6), 2),
        "velocity_range": round(float(10 ** rng.uniform(-1.5, -0.3)), 3),
    }
    if solver == "pso":
        return swarm
    return swarm | {
        "lambda_": round(1.0 - float(10 ** rng.uniform(-2.0, -0.3)), 3),
        "eta": round(1.0 - float(10 ** rng.uniform(-2.5, -0.8)), 4),
        "delta_0": round(float(10 ** rng.uniform(-0.5, 0.7)), 2),
        "c": round(float(10 ** rng.uniform(0.0, 1.2)), 2),
    }


@cache
def problem(case: int) -> Problem[Any]:
    return random_scenarios(TRAINING_SEED, case + 1)[case].problem()


@cache
def evaluator(case: int) -> PopulationFunction:
    return problem(case).evaluator(EvaluationOptions("native"))


def run(solver: str, settings: dict[str, Any], evaluations: int, seeds: range) -> FloatArray:
    """Costs of one setting, (cases, seeds); inf where infeasible."""
    costs = np.full((TRAINING_CASES, len(seeds)), np.inf)
    for case in range(TRAINING_CASES):
        planned = problem(case)
        for column, seed in enumerate(seeds):
            search, budget = SOLVERS[solver](**settings), Budget(evaluations)
            result = minimize(evaluator(case), SearchBox(*planned.bounds), search, budget, seed)
            if result.cost <= planned.objective_upper_bound:
                costs[case, column] = result.cost
    return costs


def score(costs: FloatArray, best: FloatArray) -> float:
    """Mean shortfall of one setting's costs (cases, seeds) against the best known (cases,)."""
    return float(np.minimum(np.log(costs / best[:, None]), MAX_SHORTFALL).mean())


Trials = dict[str, list[tuple[dict[str, Any], FloatArray]]]


def tried(pool: Executor, settings: dict[str, list[dict[str, Any]]], evaluations: int, seeds: range) -> Trials:
    """All settings of all solvers."""
    jobs = {
        solver: [pool.submit(run, solver, s, evaluations, seeds) for s in many] for solver, many in settings.items()
    }
    return {
        solver: [(setting, job.result()) for setting, job in zip(settings[solver], submitted, strict=True)]
        for solver, submitted in jobs.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solvers", default=",".join(SOLVERS))
    parser.add_argument("--trials", type=int, default=32)
    parser.add_argument("--evaluations", type=int, default=15_000)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    solvers = options.solvers.split(",")
    settings = {s: [{}, *(draw(s, np.random.default_rng(k)) for k in range(1, options.trials))] for s in solvers}
    with ProcessPoolExecutor(options.workers) as pool:
        list(pool.map(evaluator, range(TRAINING_CASES)))
        first = tried(pool, settings, options.evaluations, range(1000, 1000 + options.seeds))
        best = best_known([first])
        final_settings = {s: finalists(trials, best) for s, trials in first.items()}
        second = tried(pool, final_settings, options.evaluations, range(2000, 2000 + CONFIRMING_SEEDS))
    best = best_known([first, second])
    print("| solver | setting | first score | second score |\n|---|---|---|---|")
    for solver in solvers:
        scores = {str(setting): score(costs, best) for setting, costs in first[solver]}
        for setting, costs in second[solver]:
            name = ", ".join(f"{key} {value}" for key, value in setting.items()) or "the default"
            print(f"| {solver} | {name} | {scores[str(setting)]:.4f} | {score(costs, best):.4f} |")


def best_known(every: list[Trials]) -> FloatArray:
    """The lowest cost of each case, (cases,)."""
    costs = [costs.min(axis=1) for trials in every for many in trials.values() for _, costs in many]
    return np.asarray(np.min(costs, axis=0))


def finalists(trials: list[tuple[dict[str, Any], FloatArray]], best: FloatArray) -> list[dict[str, Any]]:
    """The default and the best few others."""
    others = sorted(trials[1:], key=lambda trial: score(trial[1], best))[:FINALISTS]
    return [trials[0][0], *(setting for setting, _ in others)]


if __name__ == "__main__":
    main()
