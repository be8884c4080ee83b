"""Maps of what arms reach, and how many starts find how many postures.

A map is of a cube of 1.5 m in steps of 0.05 m, 27,000 points above and around the base, with the tool turned in 50
ways; a table is below. Postures from few starts are compared with those from 1,024, at poses of random postures.

    python -m benchmarks.reach
"""

from __future__ import annotations

import time

import numpy as np

import tpbso_casadi as tp
from problems.core import steps_of
from problems.robots import JointTurns, Poses, SpatialArm, built_in, spread_shares
from tpbso_casadi.reaching import evenly_turned

ROBOTS = ("ur5e", "panda")
TABLE = {"shape": "box", "center": [0.0, 0.0, -0.06], "size": [2.0, 2.0, 0.1]}
ORIENTATIONS, STEPS = 50, 30
POSES, STARTS = 1_000, (8, 16, 32, 64, 1024)


def cube() -> np.ndarray:
    """Points (27,000, 3) of a cube around the base, m."""
    axis = 0.05 * (np.arange(STEPS) - 0.5 * (STEPS - 1))
    return np.stack(np.meshgrid(axis, axis, axis + 0.5), axis=-1).reshape(-1, 3)


def print_starts(name: str) -> None:
    """A row for each number of starts: microseconds a pose, poses solved, those of which all postures are found."""
    arm = built_in(name).arm()
    assert isinstance(arm, SpatialArm)
    turns, rng = JointTurns.of(arm), np.random.default_rng(0)
    poses = Poses(*arm.tool.at(turns.within(rng.random((POSES, arm.dof)))))
    rows = []
    for count in STARTS:
        starts = turns.within(spread_shares(count, arm.dof))
        began = time.process_time()
        found = steps_of(arm).inverse(poses, starts, turns, turns.middle)
        rows.append((count, 1e6 * (time.process_time() - began) / POSES, found.counts))
    for count, took, counts in rows:
        complete = (counts >= rows[-1][2]).mean()
        print(f"| {name} | {count} | {took:.0f} | {(counts > 0).mean():.1%} | {counts.mean():.2f} | {complete:.1%} |")


def main() -> None:
    """Make the maps, and print the tables."""
    print("| robot | starts | us a pose | solved | postures: mean | as many as of 1,024 |\n|---|---|---|---|---|---|")
    for name in ROBOTS:
        print_starts(name)
    print("\n| robot | poses | s | poses a second | reached | reached and clear |\n|---|---|---|---|---|---|")
    for name in ROBOTS:
        began = time.perf_counter()
        found = tp.reach(name, cube(), evenly_turned(ORIENTATIONS), [TABLE])
        took, poses = time.perf_counter() - began, found.reached.size
        rate = poses / took
        print(f"| {name} | {poses} | {took:.1f} | {rate:.0f} | {found.reached.mean():.1%} | {found.clear.mean():.1%} |")


if __name__ == "__main__":
    main()
