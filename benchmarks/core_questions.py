"""The time that the compiled core takes for each kind of question, about a Panda among six boxes.

python -m benchmarks.core_questions
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from problems.core import CompiledWorld, Dynamics, steps_of
from problems.library import core_account
from problems.robots import built_in
from problems.scene import Box
from problems.timing import rest_to_rest

POSTURES, MOTIONS, PATHS, REPEATS = 2_000, 100, 30, 5
NEAR = 0.05  # m


def seconds(work: Callable[[], object]) -> float:
    """The shortest of several runs, s."""
    took = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work()
        took.append(time.perf_counter() - began)
    return min(took)


def main() -> None:
    """Ask, and print a row for each kind of question."""
    arm, rng = replace(built_in("panda").arm(), self_collision=True, margin=0.005), np.random.default_rng(0)
    boxes = [Box(center=(0.5, 0.3 * k - 0.6, 0.2 * k), size=(0.1, 0.1, 0.1)) for k in range(6)]
    world, low_high = CompiledWorld.of(arm, boxes), np.array(arm.position_limits).T
    assert world is not None and arm.rigid_chain is not None
    dynamics, states = Dynamics.of_chain(arm.rigid_chain), rng.normal(size=(POSTURES, 3 * arm.dof))
    assert dynamics is not None
    theta = rng.uniform(*low_high, (POSTURES, arm.dof))
    motions = [rest_to_rest(*ends, arm.limits) for ends in pairwise(theta[: MOTIONS + 1])]
    free = theta[world.clear(theta)][: PATHS + 1]
    pose, steps = [part[0] for part in arm.tool.at(theta[:1])], steps_of(arm)
    rows: list[tuple[str, Callable[[], object], int]] = [
        ("whether a posture is clear", lambda: world.clear(theta), POSTURES),
        ("its clearance margin", lambda: world.clearance_margins(theta, NEAR), POSTURES),
        ("pairs that are near, with gradients", lambda: world.nearby(theta, NEAR), POSTURES),
        ("a proof of a motion", lambda: [world.prove(motion) for motion in motions], MOTIONS),
        ("a path by RRT-Connect", lambda: [world.connect(*free[k : k + 2], low_high, k) for k in range(PATHS)], PATHS),
        ("torques of a state", lambda: dynamics.torques(states), POSTURES),
        ("how they change", lambda: dynamics.slopes(states), POSTURES),
        ("a descent to a pose", lambda: steps(theta, pose[0], pose[1], tuple(low_high), 80), POSTURES),
    ]
    print(core_account())
    for name, work, count in rows:
        print(f"{name:36} {1e6 * seconds(work) / count:8.2f} us")


if __name__ == "__main__":
    main()
