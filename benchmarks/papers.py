"""Cases that papers publish with all their numbers: what their encodings cost against motions at free times.

Each case is a file of ``examples/papers``. L-SHADE searches interval times for each interpolation, in least time.
Beside them stand the fastest motion that is found at free times and a lower bound of all. Every motion is certified,
of a robot whose joints alone matter. Then come paths, a weighted jerk, and solvers for the interval times of
Lin's cubic splines.

    python -m benchmarks.papers --evaluations 10000 --seeds 5
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import casadi as ca
import numpy as np

import tpbso_casadi as tp
from problems.families.via_times import INTERPOLATIONS, via_times
from tpbso_casadi.display.passing_tables import joint_peaks
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.scenario import read_scenario

FOLDER = Path(__file__).parent.parent / "examples" / "papers"
THROUGH = ("lin-1983", "piazzi-visioli", "zhao-2022", "hofa-2024")
UNSEARCHED = ("fang-2020-task-1", "fang-2020-task-2", "yu-2025-one-joint")
PATHS = ("constantinescu-elbow-down", "constantinescu-elbow-up")
PUBLISHED_INTERVALS = (5.13, 3.93, 2.53, 2.49, 5.7)  # s, of Zhao, Zhu and Song
SMOOTH, WEIGHTS = "zhao-2022", (0.1, 1.0, 10.0)  # of the integral of the squared jerk beside 0.7 of the time
SOLVERS = ("abso", "lshade", "pso", "bso", "ga")


def by_encodings(name: str, evaluations: int) -> Iterator[tuple[str, Plan]]:
    """Plans of a case by each interpolation that passes so many postures, by its name."""
    vias = len(read_scenario(FOLDER / f"{name}.toml").task.via)
    for key, rule in INTERPOLATIONS.items():
        if rule.vias in (None, vias):
            yield key, tp.plan(FOLDER / f"{name}.toml", interpolation=key, solver="lshade", evaluations=evaluations)


def at_free_times(name: str) -> Plan:
    """The plan of the same move, for which nothing is searched."""
    return tp.plan(read_scenario(FOLDER / f"{name}.toml").criteria().task, solver="direct")


def print_encodings(evaluations: int) -> None:
    """Durations of a case's interpolations over that at free times, and the bound."""
    for name in THROUGH:
        free = at_free_times(name)
        bound = free.least_duration
        assert free.certified and bound is not None
        gap = free.duration / bound - 1.0
        print(f"{name}: at free times {free.duration:.4f} s, lower bound {bound:.4f} s, gap {gap:.1%}")
        for key, plan in by_encodings(name, evaluations):
            assert plan.certified
            print(f"  {key}: {plan.duration:.4f} s, {plan.duration / free.duration - 1.0:.1%} above", flush=True)


def print_unsearched() -> None:
    """Durations of moves past nothing, or past angles on the way, and along given paths."""
    for name in (*UNSEARCHED, *PATHS):
        plan = tp.plan(FOLDER / f"{name}.toml", **({} if name in PATHS else {"solver": "direct"}))
        assert plan.certified
        print(f"{name}: {plan.duration:.5f} s", flush=True)


def print_published_intervals() -> None:
    """How much of its time a motion needs that has the interval times which a paper prints."""
    task = read_scenario(FOLDER / f"{SMOOTH}.toml").criteria().task
    problem = via_times(task, interpolation="b-spline", formulation="paper")
    motion = problem.trajectory(np.array(PUBLISHED_INTERVALS))
    share = problem.criteria.safe_time_scale(motion)
    print(f"{SMOOTH}, the intervals of the paper: {motion.duration:.2f} s, of which {share:.3f} suffice", flush=True)


def print_smooth(evaluations: int) -> None:
    """Durations and mean absolute jerks of a case whose jerk costs, too."""
    jerk = tp.Cost(lambda m: ca.sumsqr(m.jerk), name="squared jerk", unit="rad^2/s^5")
    for weight in WEIGHTS:
        objective = [(0.7, "time"), (weight, jerk)]
        plan = tp.plan(FOLDER / f"{SMOOTH}.toml", objective=objective, solver="lshade", evaluations=evaluations)
        assert plan.certified
        jerks = "  ".join(f"{value:.2f}" for value in np.degrees(joint_peaks(plan.trajectory)[:, 3]))
        print(f"{SMOOTH}, weight {weight:g}: {plan.duration:.3f} s, mean |jerk| {jerks} deg/s^3", flush=True)


def print_solvers(evaluations: int, seeds: int) -> None:
    """The durations that solvers find for Lin's splines, and their seconds."""
    file = FOLDER / "lin-1983.toml"
    for name in SOLVERS:
        found, seconds = [], []
        for seed in range(1, seeds + 1):
            began = time.process_time()
            plan = tp.plan(file, solver=name, evaluations=evaluations, seed=seed)
            seconds.append(time.process_time() - began)
            found.append(plan.duration if plan.certified else np.inf)
        values = f"{min(found):.4f} / {median(found):.4f} / {max(found):.4f} s"
        print(f"{name}: {values} (best / median / worst of {seeds}), {median(seconds):.2f} CPU s", flush=True)


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--evaluations", type=int, default=10_000)
    parser.add_argument("--seeds", type=int, default=5)
    given = parser.parse_args()
    print_encodings(given.evaluations)
    print_unsearched()
    print_published_intervals()
    print_smooth(2 * given.evaluations)
    print_solvers(2 * given.evaluations, given.seeds)


if __name__ == "__main__":
    main()
