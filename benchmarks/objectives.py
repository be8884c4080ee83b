"""Moves in space for other objectives than time, without a search and by one: certified, seconds, objectives.

A Panda between two boxes; start and goal are clear postures drawn at random.

    python -m benchmarks.objectives --problems 20 --seed 3 --objective energy --solver abso
    python -m benchmarks.objectives --objective length
    python -m benchmarks.objectives --objective time=1 energy=0.002
    python -m benchmarks.objectives --goal pose

With ``--goal pose`` the tool's pose at the goal is asked for, in whatever posture, and what is gained over that posture
is said.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

import tpbso_casadi as tp
from benchmarks.hand_constraints import panda
from benchmarks.vias import OBSTACLES, postures
from problems.base import FloatArray
from tpbso_casadi.facade.plan import Plan

Objective = str | dict[str, float]


@dataclass(frozen=True)
class Outcome:
    """Of one solver.

    Attributes:
        certified: whether all limits are proven.
        seconds: of the processor, of the call.
        value: of the objective.
        duration: of the motion, s.
        searched: whether a search was needed.
    """

    certified: bool
    seconds: float
    value: float
    duration: float
    searched: bool


def pose_of(theta: FloatArray) -> FloatArray:
    """Of the tool, at joint angles (7,): a frame (4, 4)."""
    frame, robot = np.eye(4), panda().model
    place, rotation = robot.tool.at(theta[None])  # type: ignore[attr-defined]
    frame[:3, :3], frame[:3, 3] = rotation[0], place[0]
    return frame


def outcome(start: FloatArray, goal: Any, objective: Objective, solver: str) -> Outcome:
    """Of one move to a posture or a pose.

    Raises:
        ScenarioError: the robot touches itself at one of the postures.
    """
    began = time.process_time()
    plan: Plan = tp.plan(
        panda(), start=tp.Joints(tuple(start)), goal=goal, obstacles=list(OBSTACLES),
        objective=objective, solver=solver,
    )  # fmt: skip
    seconds = time.process_time() - began
    return Outcome(plan.certified, seconds, plan.result.objective.value, plan.duration, plan.result.evaluations > 0)


def measured(
    problems: int, seed: int, objective: Objective, solvers: tuple[str, ...], posed: bool
) -> Iterator[tuple[Outcome, ...]]:
    """What so many moves give; those are passed over with a posture in which the robot touches itself."""
    drawn, left = postures(np.random.default_rng(seed)), problems
    while left:
        start, goal = next(drawn), next(drawn)
        with suppress(tp.ScenarioError):
            posture = tp.Joints(tuple(goal))
            cases = [("direct", pose_of(goal)), ("direct", posture)] if posed else [(each, posture) for each in solvers]
            yield tuple(outcome(start, asked, objective, solver) for solver, asked in cases)
            left -= 1


def report(found: list[tuple[Outcome, ...]], solvers: tuple[str, ...]) -> str:
    """Counts, seconds, and objectives over those of the first solver, as lines."""
    lines = []
    for number, solver in enumerate(solvers):
        own = [each[number] for each in found]
        times = " / ".join(f"{value:.2f}" for value in np.percentile([one.seconds for one in own], (50, 90, 100)))
        certified, searched = (sum(getattr(one, name) for one in own) for name in ("certified", "searched"))
        counts = f"{solver:8} certified {certified} of {len(own)}, {searched} searched"
        lines.append(f"{counts}; CPU s, median / 90 % / worst: {times}")
    for number, solver in enumerate(solvers[1:], start=1):
        both = [(each[0], each[number]) for each in found if each[0].certified and each[number].certified]
        for name in ("value", "duration"):
            ratios = [getattr(one, name) / getattr(other, name) for one, other in both]
            low, median, high = np.percentile(ratios, (0, 50, 100))
            lines.append(f"{solvers[0]} over {solver}, {name}: median {median:.4f}, {low:.4f} to {high:.4f}")
    return "\n".join(lines)


def stated(words: list[str]) -> Objective:
    """A name, or weights by names."""
    if len(words) == 1 and "=" not in words[0]:
        return words[0]
    pairs = [word.split("=", 1) for word in words]
    return {name: float(weight) for name, weight in pairs}


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=20)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--objective", nargs="+", default=["energy"], help="a name, or NAME=WEIGHT of several")
    parser.add_argument("--solver", nargs="*", default=["abso"], help="besides direct")
    parser.add_argument("--goal", choices=("joints", "pose"), default="joints")
    given = parser.parse_args()
    posed = given.goal == "pose"
    names = ("pose", "posture") if posed else ("direct", *given.solver)
    print(report(list(measured(given.problems, given.seed, stated(given.objective), names, posed)), names))


if __name__ == "__main__":
    main()
