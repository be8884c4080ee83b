"""Five planar plans of the paper's motion: before, timed anew on the same path, TOPP-RA there, and free motions.

The plans are those of the default solver, abso with a polish, from the first seed.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from benchmarks.peers.report import Report, Size, certified, excess, in_parallel
from benchmarks.peers.waypoint_paths import by_toppra
from problems import Trajectory
from problems.motions import JointPath
from problems.robots import JointLimits
from problems.timing import retime
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import Scenario, parse_scenario
from tpbso_casadi.scenario.cases import builtin

LETTER = {  # an outline with sharp corners: the letter N
    "arm": {"link_lengths": [0.45, 0.35, 0.2], "max_speed": 3.0, "max_acceleration": 30.0},
    "task": {
        "kind": "path",
        "points": [
            [0.40, 0.10], [0.46, 0.10], [0.46, 0.38], [0.60, 0.10], [0.66, 0.10],
            [0.66, 0.50], [0.60, 0.50], [0.60, 0.22], [0.46, 0.50], [0.40, 0.50],
        ],
        "closed": True,
        "accuracy": 0.002,
        "elbow": "up",
        "objective": "time",
    },
}  # fmt: skip
LETTER_POINTS = 160  # of its outline: the paper's motion is held to its points alone
CASES = ("pentagram-time", "closed-curve-time", "letter N", "time-5", "obstacle-4")
GRID = 20_000  # points of TOPP-RA's grid
SPLINE_POINTS = 600
SOLVER = {"name": "abso", "polish_starts": 1, "seed": 1}


def scenario_of(case: str, motion: str) -> Scenario:
    """A case with either motion; with the paper's nothing is timed anew."""
    content: dict[str, Any] = dict(LETTER) if case == "letter N" else builtin(case).table()
    if case == "letter N" and motion == "paper":
        content["task"] = content["task"] | {"count": LETTER_POINTS}
    model = {"motion": motion, "retime": False} if motion == "paper" else {"motion": motion}
    if motion != "paper":
        content["task"] = {key: value for key, value in content["task"].items() if value is not None}
        content["task"].pop("segment_time", None)
    return parse_scenario({**content, "model": model, "solver": SOLVER})


def row(number: int) -> list[str]:
    case = CASES[number]
    before, free = plan(scenario_of(case, "paper")), plan(scenario_of(case, "spline"))
    path, limits = JointPath.of(before.trajectory), before.criteria.robot.limits
    anew = retime(path, limits)
    regular = evenly_run(path)
    peer = by_toppra(regular, limits, np.linspace(*regular.breakpoints[[0, -1]], GRID + 1))
    return [
        case,
        seconds(before.trajectory, before.feasible),
        seconds(anew, certified(anew, limits)),
        f"{peer.duration:.4f} ({100.0 * peer.excess:.2g} %)",
        seconds(free.trajectory, free.feasible),
        f"{100.0 * max(broken(anew, limits), broken(free.trajectory, limits)):.2g} %",
    ]


def evenly_run(path: JointPath) -> JointPath:
    """A spline through many points of a path at equal distances in joint space: TOPP-RA cannot begin where q' is 0."""
    u = np.linspace(*path.breakpoints[[0, -1]], 100 * SPLINE_POINTS)
    theta = path.at(u)
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(theta, axis=0), axis=1)))
    return JointPath.through(path.at(np.interp(np.linspace(0.0, along[-1], SPLINE_POINTS), along, u)))


def seconds(trajectory: Trajectory, proven: bool) -> str:
    return f"{trajectory.duration:.4f}{'' if proven else ' (not certified)'}"


def broken(trajectory: Trajectory, limits: JointLimits) -> float:
    return excess(partial(trajectory.at), trajectory.duration, limits)


def planar_plans(size: Size) -> Report:
    header = [
        "plan",
        "the paper's motion, s",
        "same path, ours, s",
        "same path, TOPP-RA, s (excess)",
        '`motion = "spline"`, s',
        "our excess",
    ]
    return Report("Five planar plans", header, in_parallel(row, len(CASES), size.workers))
