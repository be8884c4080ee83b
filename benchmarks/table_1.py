"""Table 1 of the paper, and the calibration of our paths to it.

The paper publishes neither the geometry of its two paths nor the limits of its arm. The built-in path scenarios were
chosen so that the mean of BSO over 20 runs falls near the TPBSO row; this prints what each solver reaches there.

    python -m benchmarks.table_1 --runs 20 --workers 2
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import cache

import numpy as np

from problems import Problem
from solvers import SOLVERS, Box, Budget, minimize
from tpbso_casadi.builtin import builtin
from tpbso_casadi.scenario import DEFAULT_EVALUATIONS

TABLE_1 = {
    "pentagram-time": {"ga": (0.7982, 0.0757), "pso": (0.7432, 0.0603), "bso": (0.7139, 0.0420)},
    "pentagram-rotation": {"ga": (25.4070, 1.3351), "pso": (22.8910, 1.9832), "bso": (22.3850, 1.0973)},
    "closed-curve-time": {"ga": (1.4088, 0.1982), "pso": (1.2569, 0.0370), "bso": (1.1863, 0.0043)},
    "closed-curve-rotation": {"ga": (24.3354, 0.2205), "pso": (24.3594, 0.2050), "bso": (24.1952, 0.2365)},
}


@cache
def problem(case: str) -> Problem:
    return builtin(case).problem()


def run(case: str, solver: str, seed: int) -> tuple[float, bool]:
    """Cost of one run, and whether it is feasible."""
    planned = problem(case)
    found = minimize(planned.cost, Box(*planned.bounds), SOLVERS[solver](), Budget(DEFAULT_EVALUATIONS), seed)
    return found.cost, found.cost <= planned.feasible_below


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    print("| case | solver | paper: mean ± std | ours: mean ± std | best | feasible runs |\n|---|---|---|---|---|---|")
    with ProcessPoolExecutor(options.workers) as pool:
        for case, rows in TABLE_1.items():
            for solver, (mean, deviation) in rows.items():
                jobs = [pool.submit(run, case, solver, seed) for seed in range(1, options.runs + 1)]
                costs, feasible = zip(*(job.result() for job in jobs), strict=True)
                held = np.array(costs)[list(feasible)]
                ours = f"{held.mean():.4f} ± {held.std(ddof=1):.4f} | {held.min():.4f}" if held.size > 1 else "- | -"
                row = f"{case} | {solver} | {mean:.4f} ± {deviation:.4f} | {ours} | {held.size} of {len(jobs)}"
                print(f"| {row} |", flush=True)


if __name__ == "__main__":
    main()
