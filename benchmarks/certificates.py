"""Are the certificates right? Random scenarios and trajectories, each certificate against a dense sampling.

Point-to-point motions and paths of random arms with random limits, joint limits and obstacles; half of them from a
short search, so that many stand close to their limits. A certificate is false when 100,000 samples find a limit
broken that it calls certified.

    python -m benchmarks.certificates --count 1000 --workers 2
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from problems import (
    CertificateStatus,
    Ellipse,
    InvalidProblem,
    Path,
    PathFollowing,
    PlanarArm,
    PointToPoint,
    Problem,
    Trajectory,
    path_following,
    point_to_point,
)
from problems.base import as_array
from problems.certify import exact_time_scale
from problems.limits import Clearance, reachable_pairs
from solvers import PSO, Budget, SearchBox, minimize

CHECK_SAMPLES = 100_000
SAMPLES_PER_CHUNK = 5_000
RELATIVE_TOLERANCE = 1e-8  # a limit exceeded by more counts as broken


@dataclass(frozen=True)
class Checked:
    """One trajectory: the certificate's status by constraint, and which constraints the samples break."""

    statuses: dict[str, CertificateStatus]
    broken: frozenset[str]
    milliseconds: float


def random_problem(rng: np.random.Generator) -> Problem[Any]:
    """An arm, a task it can do, obstacles away from its points."""
    while True:
        k = int(rng.integers(3, 6))
        lengths = tuple(rng.uniform(0.3, 1.0, k).tolist())
        limits = tuple(rng.uniform(2.0, 6.0, k).tolist()), tuple(rng.uniform(10.0, 40.0, k).tolist())
        ranges = tuple((-a, b) for a, b in rng.uniform(2.2, 3.1, (k, 2))) if rng.random() < 0.5 else None
        arm = PlanarArm(lengths, *limits, ranges)
        angle, far = rng.uniform(-np.pi, np.pi, 4), arm.reach()[1] * rng.uniform(0.3, 0.9, 4)
        points = [(float(r * np.cos(a)), float(r * np.sin(a))) for a, r in zip(angle, far, strict=True)]
        obstacles = tuple(
            Ellipse(tuple(rng.uniform(-1.5, 1.5, 2)), tuple(rng.uniform(0.05, 0.3, 2)), rng.uniform(0.0, 3.0))
            for _ in range(rng.integers(0, 3))
        )
        objective = str(rng.choice(["time", "rotation", "length"]))
        try:
            if rng.random() < 0.3:
                path = Path.through(points[:3]).resampled(20)
                return path_following(PathFollowing(arm, path, 0.05, obstacles=obstacles), objective, "reduced")
            return point_to_point(PointToPoint(arm, points[0], points[1], obstacles=obstacles), objective, "reduced")
        except InvalidProblem:
            continue


def check(seed: int) -> Checked:
    """Certify one random motion, and check it at very many samples."""
    rng = np.random.default_rng(seed)
    problem = random_problem(rng)
    x = SearchBox(*problem.bounds).sample(rng, 1)[0]
    if seed % 2:
        x = minimize(problem.cost, SearchBox(*problem.bounds), PSO(population=30), Budget(1500), rng).x
    trajectory = problem.trajectory(x)
    if rng.random() < 0.3:  # a little too fast, and only between the samples
        trajectory = trajectory.time_scaled(
            exact_time_scale(problem.criteria.limits, trajectory) * (1.0 - 10.0 ** rng.uniform(-7.0, -3.0))
        )
    began = time.perf_counter()
    verdicts = problem.criteria.verify(trajectory)
    milliseconds = (time.perf_counter() - began) * 1e3
    about = {"speed", "acceleration", "joint range", "clearance"}
    statuses = {verdict.name: verdict.status for verdict in verdicts if verdict.name in about}
    return Checked(statuses, frozenset(broken_limits(problem, trajectory)), milliseconds)


def broken_limits(problem: Problem[Any], trajectory: Trajectory) -> Iterator[str]:
    """Which limits break at one of the dense samples."""
    arm = problem.criteria.robot
    assert isinstance(arm, PlanarArm)
    clearance = Clearance(arm, reachable_pairs(arm, problem.criteria.obstacles))
    chunks = CHECK_SAMPLES // SAMPLES_PER_CHUNK
    for times in np.array_split(np.linspace(0.0, trajectory.duration, CHECK_SAMPLES), chunks):
        at = trajectory.samples(times, arm)
        theta, speed, acceleration = (as_array(part) for part in (at.theta, at.speed, at.acceleration))
        if (np.abs(speed) > np.array(arm.max_speed) * (1.0 + RELATIVE_TOLERANCE)).any():
            yield "speed"
        if (np.abs(acceleration) > np.array(arm.max_acceleration) * (1.0 + RELATIVE_TOLERANCE)).any():
            yield "acceleration"
        if arm.joint_limits is not None:
            low, high = np.array(arm.joint_limits).T
            if ((theta < low - RELATIVE_TOLERANCE) | (theta > high + RELATIVE_TOLERANCE)).any():
                yield "joint range"
        if clearance.pairs and float(ca.mmin(clearance.constraints_at(at)[0].expression)) < 0.0:
            yield "clearance"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    with ProcessPoolExecutor(options.workers) as pool:
        every = list(pool.map(check, range(options.count), chunksize=10))
    print("| constraint | certified | violated | undecided | false certified | violated that no sample saw |")
    print("|---|---|---|---|---|---|")
    for name in ("speed", "acceleration", "joint range", "clearance"):
        outcomes = [(c.statuses[name], name in c.broken) for c in every if name in c.statuses]
        count = Counter(status for status, _ in outcomes)
        false = sum(status is CertificateStatus.CERTIFIED and broken for status, broken in outcomes)
        unseen = sum(status is CertificateStatus.VIOLATED and not broken for status, broken in outcomes)
        print(f"| {name} | {' | '.join(str(count[s]) for s in CertificateStatus)} | {false} | {unseen} |")
    milliseconds = [c.milliseconds for c in every]
    print(f"\nmilliseconds a certificate: median {np.median(milliseconds):.1f}, worst {max(milliseconds):.1f}")


if __name__ == "__main__":
    main()
