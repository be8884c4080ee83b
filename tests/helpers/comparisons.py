"""Results of campaigns that nobody ran."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from tpbso_casadi.judging.results import Results
from tpbso_casadi.judging.run import RunRecord
from tpbso_casadi.judging.targets import Convergence

Steps = Sequence[tuple[float, float]]  # evaluations, and the objective from then on; none for a run without a plan


def convergence(steps: Steps, done: int = 100, case: str = "case", solver: str = "a", seed: int = 1) -> Convergence:
    evaluations, objectives = np.array(steps, dtype=np.float64).reshape(-1, 2).T
    return Convergence(case=case, solver=solver, seed=seed, evaluations=evaluations, values=objectives, done=done)


def record(case: str, solver: str, seed: int, steps: Steps, done: int = 100, error: str = "") -> RunRecord:
    return RunRecord(
        case=case,
        solver=solver,
        seed=seed,
        seconds=0.1,
        error=error,
        feasible=bool(steps),
        objective=steps[-1][1] if steps else None,
        unit="s",
        cost=1.0,
        evaluations=done,
        iterations=1,
        stop_reason="evaluations",
    )


def results(runs: Mapping[tuple[str, str], Sequence[Steps]], done: int = 100) -> Results:
    """By case and solver, the steps of each run."""
    every = [
        (case, solver, seed, steps)
        for (case, solver), group in runs.items()
        for seed, steps in enumerate(group, start=1)
    ]
    return Results(
        [record(case, solver, seed, steps, done) for case, solver, seed, steps in every],
        [convergence(steps, done, case, solver, seed) for case, solver, seed, steps in every],
    )


def final(objectives: Sequence[float | None]) -> list[Steps]:
    """Runs that found their plan after ten evaluations; None for one that found none."""
    return [[] if value is None else [(10.0, value)] for value in objectives]


def random_results(cases: int, solvers: int, runs: int, seed: int = 1) -> Results:
    """Solvers of which each is better than the one before, on every case."""
    rng = np.random.default_rng(seed)
    return results(
        {
            (f"case-{case}", f"solver-{solver}"): [
                [(10.0, 3.0), (50.0, 1.0 + 2.0**-solver * (1.0 + 0.1 * rng.random()))] for _ in range(runs)
            ]
            for case in range(cases)
            for solver in range(solvers)
        }
    )
