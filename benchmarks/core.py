"""The compiled core's proofs against those by pairs, and against samples, on random motions among random boxes.

Of each motion both say whether it keeps clear, for all t. They may differ where one leaves it open; where one says that
it is clear and the other that it touches, or where samples touch what the core calls clear, one of them is wrong. Of
covers there are no pairs: samples alone judge them.

    python -m benchmarks.core --count 10000 --samples 2000
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from dataclasses import replace

import numpy as np

from problems import CertificateStatus, Trajectory
from problems.certify import ClearanceProof, prove_clearance
from problems.certify.core_clearance import prove_clearance_in_core
from problems.limits import Clearance, CoverClearance, CoverSelfClearance, Limit, SelfClearance
from problems.robots import SpatialArm
from problems.scene import Ball, Box, Cylinder, Obstacle
from problems.timing import rest_to_rest
from tpbso_casadi.facade.robots import robot

AROUND = 1.0  # m: obstacles are no farther from the base in any coordinate
ROUNDING = 1e-9  # m


def scene(rng: np.random.Generator) -> tuple[Obstacle, ...]:
    """A few small things around the robot."""
    found: list[Obstacle] = []
    for _ in range(int(rng.integers(1, 6))):
        x, y, z = rng.uniform(-AROUND, AROUND, 3).tolist()
        a, b, c = rng.uniform(0.02, 0.2, 3).tolist()
        quaternion = rng.normal(size=4)
        turned = tuple((quaternion / np.linalg.norm(quaternion)).tolist())
        kind = int(rng.integers(3))
        if kind == 0:
            found.append(Ball(center=(x, y, z), radius=a))
        elif kind == 1:
            found.append(Box(center=(x, y, z), size=(a, b, c), quaternion=turned))
        else:
            found.append(Cylinder(center=(x, y, z), radius=a, length=b, quaternion=turned))
    return tuple(found)


def motion(arm: SpatialArm, rng: np.random.Generator) -> Trajectory:
    """Between random postures, mostly a short way."""
    low, high = np.clip(np.array(arm.limits.position or [(-np.pi, np.pi)] * arm.dof).T, -np.pi, np.pi)
    start = rng.uniform(low, high)
    goal = np.clip(start + rng.normal(0.0, rng.choice([0.1, 0.5]), arm.dof), low, high)
    return rest_to_rest(start, goal, arm.limits)


def limits_among(arm: SpatialArm, obstacles: tuple[Obstacle, ...]) -> list[Limit]:
    """Of obstacles and of its own links."""
    if arm.cover is not None:
        made = [CoverClearance.for_robot(arm, obstacles), CoverSelfClearance.for_robot(arm, ())]
        return [limit for limit in made if limit is not None]
    own, among = SelfClearance.for_robot(arm, ()), Clearance.for_robot(arm, obstacles)
    completed = [None if among is None else among.complete(obstacles), None if own is None else own.complete(())]
    return [limit for limit in completed if limit is not None]


def by_pairs(limit: Limit, trajectory: Trajectory) -> ClearanceProof | None:
    """The other proof; None of covers."""
    return prove_clearance(limit, trajectory) if isinstance(limit, Clearance | SelfClearance) else None


def sampled(limit: Limit, trajectory: Trajectory, count: int) -> float:
    """The least room at so many times, m."""
    if not count:
        return np.inf
    times = np.linspace(0.0, trajectory.duration, count)
    if isinstance(limit, CoverClearance | CoverSelfClearance):
        return float(limit.clearances(trajectory.at(times), times).min()) - limit.margin
    assert isinstance(limit, Clearance | SelfClearance)
    samples = trajectory.samples(times, limit.robot)
    return float(np.array(limit.clearances(samples)).min()) - limit.robot.margin


def main() -> None:
    """Compare, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000, help="motions")
    parser.add_argument("--samples", type=int, default=0, help="of each motion that the core calls clear")
    parser.add_argument("--robot", default="panda", help="a built-in robot, or a URDF")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    model = robot(options.robot).model
    assert isinstance(model, SpatialArm)
    arm, rng = replace(model, self_collision=True), np.random.default_rng(options.seed)
    told: Counter[tuple[str, str]] = Counter()
    seconds, wrong = np.zeros(2), 0
    for _ in range(options.count):
        trajectory = motion(arm, rng)
        for limit in limits_among(arm, scene(rng)):
            began = time.perf_counter()
            ours = prove_clearance_in_core(limit, trajectory)
            middle = time.perf_counter()
            other = by_pairs(limit, trajectory)
            seconds += middle - began, time.perf_counter() - middle
            if ours is None:
                continue
            told[ours.status.value, "none" if other is None else other.status.value] += 1
            clear = ours.status is CertificateStatus.CERTIFIED
            if clear and sampled(limit, trajectory, options.samples) < -ROUNDING:
                wrong += 1
    for (one, two), number in sorted(told.items()):
        print(f"core {one:10} pairs {two:10} {number}")
    proofs = max(1, sum(told.values()))
    ours, others = 1e3 * seconds / proofs
    print(f"{wrong} false; core {ours:.2f} ms a proof, its world included, pairs {others:.1f}")


if __name__ == "__main__":
    main()
