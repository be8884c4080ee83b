"""How the geometry and limits of the built-in paths were chosen: the calibration to Table 1.

The paper publishes neither. For each candidate shape this prints BSO's mean least rotation beside the TPBSO row, and
the acceleration limit with which its mean least time would meet that row too. The times scale with one over the square
root of that limit, as long as no speed limit is met. Radius, waves and depth are chosen by the rotation, then the limit
by the time; ``tpbso reproduce`` says how the choice does.

    python -m benchmarks.calibrate --runs 5 --workers 2
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from typing import Any

import numpy as np

from solvers import BSO, SearchBox, minimize
from tpbso_casadi.reproduction.experiment import TABLE_1
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.scenario.cases import THREE_METRES

REFERENCE_ACCELERATION = 3000.0  # rad/s^2, at which times are measured
STARS = [{"shape": "pentagram", "radius": radius} for radius in (0.8, 0.9, 1.0, 1.1, 1.2)]
CURVES = [
    {"shape": "closed-curve", "radius": radius, "waves": waves, "depth": depth}
    for radius, waves, depth in product((1.2, 1.35, 1.45), (5, 6), (-0.3, -0.35, -0.4))
]


def mean(shape: dict[str, Any], objective: str, runs: int) -> float:
    """BSO's mean over feasible runs; NaN when there is none."""
    common = {"kind": "path", "objective": objective, "elbow": "up", "accuracy": 0.1}
    arm = THREE_METRES | {"max_acceleration": REFERENCE_ACCELERATION}
    problem = parse_scenario({"arm": arm, "task": {**common, **shape}}).problem()
    box = SearchBox(*problem.bounds)
    costs = [minimize(problem.cost, box, BSO(), BSO.default_budget, seed).cost for seed in range(1, runs + 1)]
    feasible_costs = [cost for cost in costs if cost <= problem.objective_upper_bound]
    return float(np.mean(feasible_costs)) if feasible_costs else float("nan")


def calibrated(shape: dict[str, Any], runs: int) -> tuple[float, float]:
    """Mean rotation in rad, and the acceleration limit in rad/s^2 that brings the mean time to the paper's."""
    goal = TABLE_1[f"{shape['shape']}-time"]["bso"].mean
    return mean(shape, "rotation", runs), REFERENCE_ACCELERATION * (mean(shape, "time", runs) / goal) ** 2


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    print("| shape | rotation, paper | rotation, ours [rad] | acceleration limit needed [rad/s²] |\n|---|---|---|---|")
    with ProcessPoolExecutor(options.workers) as pool:
        jobs = [(shape, pool.submit(calibrated, shape, options.runs)) for shape in (*STARS, *CURVES)]
        for shape, job in jobs:
            rotation, limit = job.result()
            goal = TABLE_1[f"{shape['shape']}-rotation"]["bso"].mean
            keys = ", ".join(f"{key} {value}" for key, value in shape.items() if key != "shape")
            print(f"| {shape['shape']}, {keys} | {goal:.2f} | {rotation:.2f} | {limit:.0f} |", flush=True)


if __name__ == "__main__":
    main()
