"""Paths of the tool in space before and after their polish: how much faster, how near the tool stays, seconds.

For each arm as many ways as in :mod:`benchmarks.lines`, in turn straight between two poses, along
an arc of 33 poses, and past a corner between two lines; the arm may begin in any posture. The duration is compared
with that of the same plan without the polish: its path, which follows the way exactly, in the least time that is found
for it. Nearness is measured at 2,000 times by kinematics and interpolation of its own in NumPy and SciPy.

    python -m benchmarks.paths --count 20 --evaluations 4000
"""

from __future__ import annotations

import argparse
import time
from collections import Counter, defaultdict
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

import tpbso_casadi as tp
from benchmarks.lines import MOST_DRAWN, TIMES, drawn, tool, within_reach
from problems.base import FloatArray
from problems.robots import SpatialArm
from problems.tasks import Arc, ToolPath
from problems.timing import retime

ARMS = ("panda", "ur5e")
ACCURACY, ANGULAR_ACCURACY = 1e-3, 0.01  # m, rad
KINDS, ON_ARC = ("line", "arc", "corner"), 33
ASIDE = 0.25  # of the distance between the ends: how far the corner is from their line


def poses(robot: SpatialArm, seed: int) -> FloatArray:
    """Poses of a way that the tool is to follow, (n, 7)."""
    rng, kind = np.random.default_rng(seed), KINDS[seed % len(KINDS)]
    _, _, passed, turned = next(one for _ in range(MOST_DRAWN) if within_reach(robot, *(one := drawn(robot, rng))))
    rotations = Rotation.from_matrix(turned)
    if kind == "line":
        return np.column_stack([passed[[0, 2]], rotations.as_quat()])
    aside = np.cross(passed[2] - passed[0], rng.normal(size=3))
    reach = ASIDE * np.linalg.norm(passed[2] - passed[0])
    passed[1] = (passed[0] + passed[2]) / 2.0 + reach * aside / np.linalg.norm(aside)
    if kind == "corner":
        turns = Slerp([0.0, 1.0], rotations)([0.0, 0.5, 1.0])
        return np.column_stack([passed, turns.as_quat()])
    found = ToolPath(Arc(*passed), (turned[0], turned[1])).places(np.linspace(0.0, 1.0, ON_ARC))
    return np.array([[*place.position(robot), *place.quaternion] for place in found])  # type: ignore[attr-defined]


def nearness(way: FloatArray, positions: FloatArray, rotations: FloatArray) -> tuple[float, float]:
    """The largest distance from the lines between poses (n, 7), m, and the largest angle from their turn there, rad."""
    away, angles = [], []
    for start, end in pairwise(way):
        leg = end[:3] - start[:3]
        share = np.clip((positions - start[:3]) @ leg / (leg @ leg), 0.0, 1.0)
        away.append(np.linalg.norm(positions - start[:3] - share[:, None] * leg, axis=1))
        turn = Slerp([0.0, 1.0], Rotation.from_quat([start[3:], end[3:]]))(share)
        angles.append((turn.inv() * Rotation.from_matrix(rotations)).magnitude())
    nearest = np.argmin(away, axis=0), np.arange(len(positions))
    return float(np.array(away)[nearest].max()), float(np.array(angles)[nearest].max())


def measured(name: str, seed: int, evaluations: int, found: dict[str, list[float]], outcomes: Counter[str]) -> None:
    """One way."""
    stated = tp.robot(name)
    way, robot = poses(stated.model, seed), stated.model
    began = time.process_time()
    try:
        plan = tp.plan(stated, path=way, accuracy=ACCURACY, angular_accuracy=ANGULAR_ACCURACY, evaluations=evaluations)
    except tp.ScenarioError as error:
        outcomes[str(error)[:60]] += 1
        return
    outcomes["certified" if plan.certified else "not certified"] += 1
    if not plan.certified:
        return
    found["seconds"].append(time.process_time() - began)
    problem, search = plan.planned.problem, plan.search
    assert problem is not None and search is not None
    exact = retime(problem.path(search.x), robot.limits, chain=robot.rigid_chain)  # type: ignore[attr-defined]
    found["gained"].append(plan.duration / exact.duration)
    found[KINDS[seed % len(KINDS)]].append(found["gained"][-1])
    away, angle = nearness(way, *tool(robot, plan.trajectory.at(np.linspace(0.0, plan.duration, TIMES))))
    found["away"].append(away)
    found["turned"].append(angle)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=20, help="for each arm")
    parser.add_argument("--evaluations", type=int, default=30_000, help="of a search")
    options = parser.parse_args()
    print("| arm | certified | others | um | mrad | CPU s | over exactly | line | arc | corner |\n" + "|---" * 10 + "|")
    for name in ARMS:
        found, outcomes = defaultdict[str, list[float]](list), Counter[str]()
        for seed in range(options.count):
            measured(name, seed, options.evaluations, found, outcomes)
        others = ", ".join(f"{n} {reason}" for reason, n in outcomes.most_common() if reason != "certified")
        seconds = " / ".join(f"{value:.1f}" for value in np.quantile(found["seconds"], [0.5, 1.0]))
        gained, *each = (
            " / ".join(f"{value:.3f}" for value in np.quantile(found[kind], [0.0, 0.5, 1.0]))
            for kind in ("gained", *KINDS)
        )
        near = f"{1e6 * max(found['away']):.0f} | {1e3 * max(found['turned']):.2f}"
        figures = f"{others} | {near} | {seconds} | {gained} | {' | '.join(each)}"
        print(f"| {name} | {outcomes['certified']} | {figures} |", flush=True)


if __name__ == "__main__":
    main()
