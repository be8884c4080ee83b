"""How the solvers' defaults were chosen: the same random search, with the same effort, for each of them.

Every trial draws hyper-parameters from the ranges below and runs them on the paper's eight point-to-point cases
without obstacle (2 to 5 links, least time and least rotation, paper formulation), a few seeds each. Its score is the
mean over cases and seeds of min(ln(cost / best known), 3): 0 is perfect, 0.1 is 10 % worse. The first trial of each
solver is its textbook setting. The best few are run again with fresh seeds, and that second score decides.

    python -m benchmarks.tune --trials 40 --evaluations 15000 --seeds 3 --workers 2
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from typing import Any

import numpy as np

from problems import Problem
from solvers import SOLVERS, Box, Budget, minimize
from tpbso_casadi.builtin import builtin

CASES = [f"{objective}-{links}" for objective in ("time", "rotation") for links in range(2, 6)]
BEST_KNOWN = dict(zip(CASES, (0.7015, 0.462, 0.372, 0.351, 2.4135, 2.035, 1.628, 1.432), strict=True))
FINALISTS, CONFIRMING_SEEDS = 4, 12

TEXTBOOK: dict[str, dict[str, Any]] = {
    "bso": {"population": 30, "lambda_": 0.95, "c1": 1.7, "c2": 1.7, "velocity_range": 0.1},
    "pso": {"population": 50, "c1": 1.49, "c2": 1.49, "velocity_range": 0.2},
    "ga": {"population": 30, "crossover_eta": 10.0, "mutation_rate": 0.2, "mutation_eta": 20.0},
}


def draw(solver: str, rng: np.random.Generator) -> dict[str, Any]:
    """One random setting of a solver."""
    population = int(rng.choice([15, 20, 30, 40, 50, 70, 100]))
    if solver == "ga":
        return {
            "population": population,
            "tournament": int(rng.integers(2, 5)),
            "crossover_rate": round(rng.uniform(0.6, 1.0), 2),
            "crossover_eta": round(float(10 ** rng.uniform(0.0, 1.5)), 1),
            "mutation_rate": round(rng.uniform(0.03, 0.4), 2),
            "mutation_eta": round(float(10 ** rng.uniform(0.7, 2.0)), 1),
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
def problem(case: str) -> Problem:
    return builtin(case).problem()


def score(solver: str, settings: dict[str, Any], evaluations: int, seeds: list[int]) -> float:
    """Mean shortfall of one setting, see the module's text."""
    shortfalls = []
    for case in CASES:
        for seed in seeds:
            planned = problem(case)
            search = SOLVERS[solver](**settings)
            found = minimize(planned.cost, Box(*planned.bounds), search, Budget(evaluations), seed)
            shortfalls.append(min(float(np.log(found.cost / BEST_KNOWN[case])), 3.0))
    return float(np.mean(shortfalls))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--solvers", default="bso,pso,ga")
    parser.add_argument("--trials", type=int, default=40)
    parser.add_argument("--evaluations", type=int, default=15_000)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    seeds = list(range(1000, 1000 + options.seeds))
    fresh = list(range(2000, 2000 + CONFIRMING_SEEDS))
    with ProcessPoolExecutor(options.workers) as pool:
        for solver in options.solvers.split(","):
            rng = np.random.default_rng(7)
            trials = [TEXTBOOK[solver], *(draw(solver, rng) for _ in range(options.trials - 1))]
            first = [pool.submit(score, solver, trial, options.evaluations, seeds) for trial in trials]
            order = np.argsort([job.result() for job in first], kind="stable")
            finalists = list(dict.fromkeys([0, *order[:FINALISTS].tolist()]))
            second = {i: pool.submit(score, solver, trials[i], options.evaluations, fresh) for i in finalists}
            for i in sorted(finalists, key=lambda i: second[i].result()):
                print(f"{solver} {first[i].result():.3f} {second[i].result():.3f} {trials[i]}", flush=True)


if __name__ == "__main__":
    main()
