"""BSO alone, BSO polished by IPOPT, and IPOPT from many starts for the same seconds, on every built-in case.

Each seed searches once with BSO's default budget, refines its best, and gives IPOPT's multi-start as many seconds as
both took together. "Solved" is the share of runs within 0.1 % of the best that any run of the case found; means are
over feasible runs.

    python -m benchmarks.polish --runs 20 --workers 2
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np

from tpbso_casadi.planning import JudgedMotion, plan
from tpbso_casadi.scenario import Scenario, parse_scenario
from tpbso_casadi.scenario.cases import TITLES, builtin

SOLVED_TOLERANCE = 1e-3


@dataclass(frozen=True)
class Outcome:
    """One run of one method: NaN when infeasible."""

    objective: float
    seconds: float


def outcome(motion: JudgedMotion, seconds: float) -> Outcome:
    return Outcome(motion.objective if motion.feasible else float("nan"), seconds)


def solving(scenario: Scenario, **solver: object) -> Scenario:
    """The scenario with other keys in [solver]."""
    content = scenario.table()
    content["solver"] |= solver
    return parse_scenario(content)


def run(case: str, elbow: str, seed: int, starts: int) -> tuple[Outcome, Outcome, Outcome]:
    """The three methods with one seed."""
    content = builtin(case).table()
    content["task"]["elbow"] = elbow
    scenario = parse_scenario(content)
    began = time.perf_counter()
    polished = plan(solving(scenario, seed=seed, polish_starts=starts))
    together = time.perf_counter() - began
    assert polished.polish is not None
    alone = outcome(polished.polish.before, together - polished.polish.seconds)
    descended = plan(solving(scenario, name="ipopt", seed=seed, time_limit=together))
    return alone, outcome(polished.motion, together), outcome(descended.motion, descended.search.seconds)


def cells(outcomes: Sequence[Outcome], best: float) -> str:
    """Mean, best, share solved, seconds."""
    objectives = np.array([o.objective for o in outcomes])
    feasible = objectives[np.isfinite(objectives)]
    solved = np.mean(np.nan_to_num(objectives, nan=np.inf) <= best * (1.0 + SOLVED_TOLERANCE))
    seconds = np.mean([o.seconds for o in outcomes])
    if not feasible.size:
        return f"- | - | 0 % | {seconds:.2f}"
    missing = "" if feasible.size == objectives.size else f" ({feasible.size} of {objectives.size})"
    return f"{feasible.mean():.4f}{missing} | {feasible.min():.4f} | {solved:.0%} | {seconds:.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", default=list(TITLES))
    parser.add_argument("--elbow", default="up")
    parser.add_argument("--runs", type=int, default=20)
    parser.add_argument("--starts", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    print("| case | way | mean | best | solved | seconds |\n|---|---|---|---|---|---|")
    with ProcessPoolExecutor(options.workers) as pool:
        for case in options.cases:
            seeds = range(1, options.runs + 1)
            jobs = [pool.submit(run, case, options.elbow, seed, options.starts) for seed in seeds]
            ways = list(zip(*(job.result() for job in jobs), strict=True))
            best = np.nanmin([o.objective for way in ways for o in way])
            for name, outcomes in zip(("BSO", "BSO + polish", "IPOPT multi-start"), ways, strict=True):
                print(f"| {case} | {name} | {cells(outcomes, float(best))} |", flush=True)


if __name__ == "__main__":
    main()
