"""Lines, arcs and paths of the tool with the turn about one of its axes left free, against the tool turned as stated.

For each arm as many lines, arcs and paths of two legs as are asked for, drawn as in ``benchmarks.lines``: at a few
points of each there is a posture with the tool turned as stated, whichever. Each is planned with the tool turned as
stated, and with the turn about x and about z of the tool free. The direction of the free axis and the distance from
the way are measured at 2,000 times by kinematics of its own in NumPy.

    python -m benchmarks.free_turns --count 10
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np

import tpbso_casadi as tp
from benchmarks.lines import ARMS, MOST_DRAWN, TIMES, drawn, nearness, tool, within_reach
from problems.base import FloatArray
from problems.robots import SpatialArm

FREE = (None, "x", "z")
LEGS = (0.1, 0.3)  # m, of a path
Way: TypeAlias = tuple[FloatArray, tp.Line | tp.Along, FloatArray, FloatArray]


@dataclass
class Found:
    """What came out for one arm and one axis."""

    planned: dict[int, float] = field(default_factory=dict)  # durations by the number of the way, s
    seconds: list[float] = field(default_factory=list)
    away: list[float] = field(default_factory=list)
    turned: list[float] = field(default_factory=list)


def drawn_path(robot: SpatialArm, rng: np.random.Generator) -> Way:
    """A path of two legs from a start of ``drawn``, along which the tool stays turned as it is."""
    start, _, passed, turned = drawn(robot, rng)
    legs = rng.normal(size=(2, 3))
    legs *= rng.uniform(*LEGS, size=(2, 1)) / np.linalg.norm(legs, axis=1, keepdims=True)
    points = passed[0] + np.cumsum(legs, axis=0)
    return start, tp.Along(points.tolist(), accuracy=1e-3), np.vstack([passed[:1], points]), np.array([turned[0]] * 2)


def is_reached(robot: SpatialArm, way: Way) -> bool:
    """Whether there is a posture at a few points of a way, whichever."""
    start, stage, passed, turned = way
    if isinstance(stage, tp.Line):
        return within_reach(robot, start, stage, passed, turned)
    legs = pairwise(passed)
    return all(
        within_reach(robot, start, tp.Line(), np.array([one, (one + two) / 2.0, two]), turned) for one, two in legs
    )


def is_kind(kind: str) -> Callable[[Way], bool]:
    """The test whether a way is a line, an arc or a path."""
    through = {"line": False, "arc": True}
    return lambda way: isinstance(way[1], tp.Along) or (way[1].through is not None) == through[kind]


def ways(robot: SpatialArm, count: int) -> list[Way]:
    """As many lines, arcs and paths as are asked for."""
    found = []
    for kind, make in (("line", drawn), ("arc", drawn), ("path", drawn_path)):
        for seed in range(count):
            rng = np.random.default_rng(seed)
            tried = (make(robot, rng) for _ in range(MOST_DRAWN))
            found.append(next(way for way in tried if is_kind(kind)(way) and is_reached(robot, way)))
    return found


def measured(stated: tp.StatedRobot, number: int, way: Way, free: str | None, found: Found) -> None:
    """Plan one way, and measure what comes out."""
    start, stage, passed, turned = way
    began = time.process_time()
    try:
        plan = tp.sequence(stated, start={"joints": start.tolist()}, stages=[replace(stage, free=free)])
    except tp.ScenarioError:
        return
    if not plan.certified:
        return
    found.seconds.append(time.process_time() - began)
    found.planned[number] = plan.duration
    positions, rotations = tool(stated.model, plan.trajectory.at(np.linspace(0.0, plan.duration, TIMES)))
    if isinstance(stage, tp.Along):
        since = positions[:, None] - passed[:-1]
        legs = np.diff(passed, axis=0)
        shares = np.clip((since * legs).sum(axis=2) / (legs**2).sum(axis=1), 0.0, 1.0)
        found.away.append(float(np.linalg.norm(since - shares[:, :, None] * legs, axis=2).min(axis=1).max()))
    else:
        found.away.append(nearness(passed, turned, positions, rotations)[0])
    if free is not None:
        found.turned.append(axis_error(passed, turned, positions, rotations[:, :, "xyz".index(free)], free))


def axis_error(passed: FloatArray, turned: FloatArray, positions: FloatArray, axes: FloatArray, free: str) -> float:
    """The largest angle of an axis from the even swing between its directions at start and goal, densely, rad."""
    first, last = turned[:, :, "xyz".index(free)]
    angle = 2.0 * np.arcsin(np.linalg.norm(last - first) / 2.0)
    if angle < 1e-9:
        return float((2.0 * np.arcsin(np.linalg.norm(axes - first, axis=1) / 2.0)).max())
    across = last - first * (first @ last)
    angles = np.arange(0.0, 1.0001, 1e-3)[:, None] * angle
    swing = np.cos(angles) * first + np.sin(angles) * across / np.linalg.norm(across)
    return float((2.0 * np.arcsin(np.linalg.norm(axes[:, None] - swing, axis=2).min(axis=1) / 2.0)).max())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=10, help="of lines, of arcs and of paths, for each arm")
    parser.add_argument("--arms", nargs="+", choices=ARMS, default=ARMS)
    options = parser.parse_args()
    print(
        "| arm | free | planned | over the duration as stated: least / median / most | "
        "farthest um | axis off mrad | CPU seconds: median / worst |\n" + "|---" * 7 + "|"
    )
    for name in options.arms:
        stated = tp.robot(name)
        drawn_ways = ways(stated.model, options.count)
        results = {free: Found() for free in FREE}
        for number, way in enumerate(drawn_ways):
            for free, found in results.items():
                measured(stated, number, way, free, found)
        as_stated = results[None].planned
        for free, found in results.items():
            both = found.planned.keys() & as_stated.keys()
            ratios = [found.planned[number] / as_stated[number] for number in sorted(both)]
            spread = " / ".join(f"{value:.3f}" for value in np.quantile(ratios, [0.0, 0.5, 1.0]))
            seconds = " / ".join(f"{value:.2f}" for value in np.quantile(found.seconds, [0.5, 1.0]))
            off = f"{1e3 * max(found.turned):.2f}" if found.turned else ""
            planned = f"{len(found.planned)} of {len(drawn_ways)}"
            print(
                f"| {name} | {free or ''} | {planned} | {spread} | {1e6 * max(found.away):.0f} | {off} | {seconds} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
