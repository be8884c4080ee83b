"""The best plan in a second: how often ``--within`` reaches the best known, on every built-in case.

"Solved" is the share of seeds whose plan is feasible and within 0.1 % of the best known: the best of the seeds here, or
of ``BEST_KNOWN``, which longer runs found. Seconds are those of planning, from the scenario to the verified motion.

    python -m benchmarks.within --seconds 1 --seeds 20
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np

from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.scenario.cases import TITLES, builtin

SOLVED_TOLERANCE = 1e-3
BEST_KNOWN = {  # of benchmarks/results/within.md
    "time-2": 0.7016,
    "time-3": 0.4618,
    "time-4": 0.3737,
    "time-5": 0.3220,
    "rotation-2": 2.4135,
    "rotation-3": 2.0352,
    "rotation-4": 1.6284,
    "rotation-5": 1.4322,
    "obstacle-3": 1.5946,
    "obstacle-4": 1.5945,
    "obstacle-5": 1.5945,
    "pentagram-time": 0.5465,
    "pentagram-rotation": 12.1330,
    "closed-curve-time": 0.7397,
    "closed-curve-rotation": 17.5680,
}


def run(case: str, solver: str, seconds: float, seed: int) -> tuple[float, float, int]:
    """Objective (inf if infeasible), seconds and rounds of one plan."""
    content = builtin(case).table()
    content["solver"] |= {"name": solver, "within": seconds, "seed": 1000 * seed}
    scenario = parse_scenario(content)
    began = time.perf_counter()
    solution = plan(scenario)
    taken = time.perf_counter() - began
    return solution.objective if solution.feasible else float("inf"), taken, solution.rounds


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=1.0)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--solver", default="abso")
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    print("| case | best | mean | solved | seconds | rounds |\n|---|---|---|---|---|---|")
    with ProcessPoolExecutor(options.workers) as pool:
        for case in TITLES:
            run(case, options.solver, options.seconds, 0)  # compiled code is in the cache
            seeds = range(1, options.seeds + 1)
            jobs = [pool.submit(run, case, options.solver, options.seconds, seed) for seed in seeds]
            results = np.array([job.result() for job in jobs])
            objectives, (seconds, rounds) = results[:, 0], np.median(results[:, 1:], axis=0)
            best = min(objectives.min(), BEST_KNOWN[case])
            solved = np.mean(objectives <= best * (1.0 + SOLVED_TOLERANCE))
            cells = f"{objectives.min():.4f} | {objectives.mean():.4f} | {solved:.0%} | {seconds:.2f} | {rounds:.0f}"
            print(f"| {case} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
