"""Simulations that nobody ran, for tests of what is drawn: the arm stands, moves once, and stands again."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from helpers.quintic_planner import quintic_to

from problems import Trajectory
from problems.tasks import Joints
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.simulation import Replan, SimulationRecord
from tpbso_casadi.simulation.record import Visit

EVERY, STILL, MOVING = 0.25, 0.5, 1.0  # s
KINDS = ("new", "old", "old", "stop", "old", "new", "stop", "stop")
PLANE: dict[str, Any] = {
    "arm": {"link_lengths": [1.0, 0.8], "max_speed": 4.0, "max_acceleration": 20.0, "link_radius": 0.05},
    "task": {"kind": "point-to-point", "start": {"joints": [0.0, 0.3]}, "goal": {"joints": [1.5, 0.5]}},
    "obstacles": [
        {"center": [-0.8, -0.8], "semi_axes": [0.2, 0.1]},
        {"center": [2.4, 1.2], "semi_axes": [0.2, 0.1], "velocity": [-0.3, 0.5]},
    ],
}
SPACE: dict[str, Any] = {
    "robot": {"model": "ur5e"},
    "task": {
        "kind": "point-to-point",
        "start": {"joints": [0.0, -1.2, 1.2, 0.0, 0.0, 0.0]},
        "goal": {"joints": [1.0, -1.4, 1.3, 0.0, 0.2, 0.0]},
    },
    "obstacles": [
        {"shape": "box", "center": [0.5, 0.0, -0.4], "size": [0.4, 0.4, 0.1]},
        {"shape": "sphere", "center": [1.1, 0.6, 0.6], "radius": 0.1, "velocity": [0.0, -0.3, 0.1]},
    ],
}


@cache
def record_of(dim: int) -> SimulationRecord:
    """A simulation of 2 s in the plane or in space."""
    scenario = parse_scenario({2: PLANE, 3: SPACE}[dim] | {"simulation": {"seconds": 2.0, "every": EVERY}})
    criteria = scenario.criteria()
    content = scenario.table()["task"]
    start, goal = (np.array(content[end]["joints"]) for end in ("start", "goal"))
    rest = np.zeros_like(start)
    way = quintic_to([start, rest, rest], goal, MOVING)
    stands = [np.vstack([np.zeros((5, len(start))), posture]) for posture in (start, goal)]
    executed = Trajectory(
        np.array([0.0, STILL, STILL + MOVING, 2.0 * STILL + MOVING]), np.stack([stands[0], way, stands[1]], axis=1)
    )
    replans = tuple(
        Replan(
            tick=tick, time=tick * EVERY, goal=0, kind=kind, certified=kind == "new", fail_safe=tick < 6,
            seconds=0.01 * (tick + 1), predicted_distance=0.5, arrival=1.5, jumps=(0.0, 0.0, 0.0),
        )
        for tick, kind in enumerate(KINDS)
    )  # fmt: skip
    return SimulationRecord(
        scenario=scenario,
        robot=criteria.robot,
        executed=executed,
        following=Trajectory(np.array([0.0, 1.0]), stands[1][:, None]),
        obstacles=criteria.obstacles,
        goals=(Joints(tuple(goal.tolist())),),
        visits=(Visit(goal=0, time=1.5),),
        replans=replans,
    )
