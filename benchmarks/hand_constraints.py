"""Moves that keep the tool upright: how many are certified, in how many seconds, at which cost in duration.

A Panda between two boxes, over a table. Start and goal are postures with the tool downward within the tolerance, drawn
at random; counted are moves whose free plan tips the tool over more than that. Every plan is looked at again at 20,000
times by rotations of NumPy and SciPy alone, from the URDF's numbers.

    python -m benchmarks.hand_constraints --moves 100 --seed 1 --tolerance 0.1
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from problems.base import FloatArray
from problems.core import CompiledWorld
from problems.robots import SpatialArm
from problems.tasks import Pose
from tpbso_casadi.facade.plan import Plan

LOOKS = 20_000
OBSTACLES = (
    tp.Box(center=(0.5, 0.0, -0.02), size=(1.2, 2.0, 0.04)),
    tp.Box(center=(0.55, 0.0, 0.14), size=(0.25, 0.08, 0.28)),
    tp.Box(center=(0.3, 0.55, 0.2), size=(0.1, 0.1, 0.4)),
)
RADII, ANGLES, HEIGHTS = (0.35, 0.65), (-1.4, 1.4), (0.12, 0.55)  # m, rad, m, of the tool around the base


@dataclass(frozen=True)
class Outcome:
    """One move.

    Attributes:
        certified: whether all limits are proven.
        seconds: of the call.
        searched: whether a search was needed.
        ratio: of the durations with and without the constraint.
        tilt: largest angle of the tool at 20,000 times, rad.
        free_tilt: the same of the plan without the constraint.
    """

    certified: bool
    seconds: float
    searched: bool
    ratio: float
    tilt: float
    free_tilt: float


@cache
def panda() -> tp.StatedRobot:
    """The robot as it is built in."""
    return tp.robot("panda")


def tilts(trajectory: tp.Trajectory) -> FloatArray:
    """Angles between the tool's axis and straight down at 20,000 times, (n,), rad."""
    arm = panda().model
    assert isinstance(arm, SpatialArm)
    theta = trajectory.at(np.linspace(0.0, trajectory.duration, LOOKS))
    turned = Rotation.from_matrix(np.tile(np.array(arm.base_frame.rotation), (LOOKS, 1, 1)))
    for joint, angle in zip(arm.chain.joints, theta.T, strict=True):
        turned = turned * Rotation.from_matrix(np.array(joint.pose.rotation))
        turned = turned * Rotation.from_rotvec(angle[:, None] * np.array(joint.axis))
    axis = (turned * Rotation.from_matrix(np.array(arm.tool_in_tip.rotation))).as_matrix()[:, :, 2]
    return np.asarray(np.arctan2(np.linalg.norm(axis[:, :2], axis=1), -axis[:, 2]))


def postures(rng: np.random.Generator, tolerance: float) -> Iterator[FloatArray]:
    """Clear postures (dof,) with the tool downward within half of the tolerance."""
    arm = panda().model
    world = CompiledWorld.of(arm, OBSTACLES)
    assert world is not None
    while True:
        radius, angle, height = (rng.uniform(*bounds) for bounds in (RADII, ANGLES, HEIGHTS))
        tilt = rng.uniform(0.0, tolerance / 2.0) * Rotation.from_rotvec([0, 0, rng.uniform(0, 6.3)]).apply([1, 0, 0])
        turned = Rotation.from_rotvec(tilt) * Rotation.from_euler("ZX", [rng.uniform(-3.1, 3.1), np.pi])
        place = Pose((radius * np.cos(angle), radius * np.sin(angle), height), tuple(turned.as_quat().tolist()))
        low, high = np.array(arm.limits.position).T
        theta, reached = place.near(arm, rng.uniform(low, high))
        within = reached and bool(((theta > low) & (theta < high)).all())
        if within and world.clear(theta[None], 0.01)[0]:
            yield theta


def planned(start: FloatArray, goal: FloatArray, constraints: list[tp.Upright]) -> tuple[Plan, float]:
    """A plan, and the seconds that it took."""
    began = time.perf_counter()
    plan = tp.plan(
        panda(), start=tp.Joints(tuple(start)), goal=tp.Joints(tuple(goal)), obstacles=list(OBSTACLES),
        constraints=constraints,
    )  # fmt: skip
    return plan, time.perf_counter() - began


def outcome(start: FloatArray, goal: FloatArray, tolerance: float) -> Outcome | None:
    """Of one move; None where its free plan is upright, or not certified."""
    free, _ = planned(start, goal, [])
    free_tilt = float(tilts(free.trajectory).max())
    if not free.certified or free_tilt <= tolerance:
        return None
    plan, seconds = planned(start, goal, [tp.Upright(tolerance=tolerance)])
    tilt = float(tilts(plan.trajectory).max())
    return Outcome(plan.certified, seconds, plan.result.evaluations > 0, plan.duration / free.duration, tilt, free_tilt)


def outcomes(moves: int, seed: int, tolerance: float) -> Iterator[Outcome]:
    """Of so many moves that the free plan does not keep upright."""
    drawn, found = postures(np.random.default_rng(seed), tolerance), 0
    while found < moves:
        one = outcome(next(drawn), next(drawn), tolerance)
        if one is not None:
            found += 1
            yield one


def report(found: list[Outcome], tolerance: float) -> str:
    """Shares and ratios of all moves, as a table."""
    certified = [one for one in found if one.certified]
    worst = max(one.tilt for one in certified) / tolerance
    seconds, ratios = np.array([one.seconds for one in found]), np.array([one.ratio for one in certified])
    rows = {
        "certified": f"{len(certified)} of {len(found)}",
        "without a search": f"{sum(not one.searched for one in certified)}",
        "seconds: median / 90 % / worst": " / ".join(f"{value:.2f}" for value in np.percentile(seconds, (50, 90, 100))),
        "duration over the free plan's: median / 90 % / worst": " / ".join(
            f"{value:.2f}" for value in np.percentile(ratios, (50, 90, 100))
        ),
        "largest tilt of certified plans, of the tolerance": f"{worst:.6f}",
        "duration over the free plan's: share above 1.01": f"{np.mean(ratios > 1.01):.0%}",
        "free plans, tilt in the median, rad": f"{np.median([one.free_tilt for one in found]):.2f}",
    }
    return "\n".join(["| | |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows.items())])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moves", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--tolerance", type=float, default=0.1, help="rad")
    options = parser.parse_args()
    found = []
    for number, one in enumerate(outcomes(options.moves, options.seed, options.tolerance), start=1):
        found.append(one)
        print(number, one, flush=True)
    print(report(found, options.tolerance))


if __name__ == "__main__":
    main()
