"""Moves past a via in space, or between moving ends, without a search and by one: how many are certified, durations.

A Panda between two boxes; start, via and goal are clear postures drawn at random. The via is the posture, or the point
where the tool is in it; or there is none, and joints move at both ends, at up to a fifth of their speeds. With
``--moving`` they do past a via too.

    python -m benchmarks.vias --problems 20 --seed 3 --via joints --solver abso
    python -m benchmarks.vias --moving --solver
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias, TypeVar

import casadi as ca
import numpy as np

import tpbso_casadi as tp
from benchmarks.hand_constraints import panda
from problems.base import FloatArray, as_array
from problems.core import CompiledWorld
from tpbso_casadi.facade.plan import Plan

OBSTACLES = (
    tp.Box(center=(0.55, 0.35, 0.4), size=(0.3, 0.1, 0.8)),
    tp.Box(center=(0.5, -0.4, 0.3), size=(0.4, 0.1, 0.6)),
)
T = TypeVar("T")
Via: TypeAlias = tp.Joints | tp.Position
FIFTH = 0.2  # of a joint's speed, at either end
INNER, ROOM = 0.1, 0.01  # rad within the joints' ranges; m that a posture keeps
SEVERAL = 3, 6  # vias, at least and at most


@dataclass(frozen=True)
class Outcome:
    """Of one solver.

    Attributes:
        certified: whether all limits are proven.
        seconds: of the processor, of the call.
        duration: of the motion, s.
        searched: whether a search was needed.
    """

    certified: bool
    seconds: float
    duration: float
    searched: bool


def postures(rng: np.random.Generator) -> Iterator[FloatArray]:
    """Those (dof,) that are clear of everything, as the ends of plans have to be."""
    arm = panda().model
    world = CompiledWorld.of(arm, OBSTACLES)
    assert world is not None
    low, high = np.array(arm.limits.position).T
    while True:
        theta = rng.uniform(low + INNER, high - INNER)
        if world.clear(theta[None], ROOM)[0]:
            yield theta


def moving_ends(start: FloatArray) -> dict[str, FloatArray]:
    """Velocities at both ends; the same for the same start."""
    rng, most = np.random.default_rng(np.abs(start * 1e6).astype(int)), np.array(panda().model.limits.speed)
    return {key: rng.uniform(-FIFTH, FIFTH, start.size) * most for key in ("start_velocity", "goal_velocity")}


def outcome(start: FloatArray, vias: list[Via], goal: FloatArray, solver: str, moving: bool = False) -> Outcome:
    """Of one move.

    Raises:
        ScenarioError: the robot touches itself at one of the postures.
    """
    keys: dict[str, Any] = moving_ends(start) if moving or not vias else {}
    keys |= {"via": vias} if vias else {}
    began = time.process_time()
    plan: Plan = tp.plan(
        panda(), start=tp.Joints(tuple(start)), goal=tp.Joints(tuple(goal)), obstacles=list(OBSTACLES),
        solver=solver, **keys,
    )  # fmt: skip
    return Outcome(plan.certified, time.process_time() - began, plan.duration, plan.result.evaluations > 0)


def measured(
    measure: Callable[[FloatArray, list[Via], FloatArray], T], problems: int, seed: int, kind: str, several: bool
) -> list[T]:
    """What so many moves give; those are passed over with a posture in which the robot touches itself."""
    rng = np.random.default_rng(seed)
    drawn, found = postures(rng), []
    while len(found) < problems:
        count = int(rng.integers(SEVERAL[0], SEVERAL[1] + 1)) if several else 1
        start, *between, goal = (next(drawn) for _ in range(count + 2))
        vias = [] if kind == "none" else [via_at(posture, kind) for posture in between]
        with suppress(tp.ScenarioError):
            found.append(measure(start, vias, goal))
    return found


def via_at(posture: FloatArray, kind: str) -> Via:
    """A posture (dof,), rad, or the tool's position in it, as a via."""
    if kind == "joints":
        return tp.Joints(tuple(posture))
    return tp.Position(tuple(as_array(panda().model.tool.position(ca.DM(posture).T)).ravel()))


def stop_over_blend(start: FloatArray, vias: list[Via], goal: FloatArray, blend: float) -> float:
    """Duration with a stop at the corner, over that without one; NaN where one is not certified.

    Raises:
        ScenarioError: the robot touches itself at one of the postures.
    """
    durations = []
    for stated in (None, blend):
        stages = [tp.MoveTo(vias[0], blend=stated), tp.MoveTo(tp.Joints(tuple(goal)))]
        plan = tp.sequence(panda(), start=tp.Joints(tuple(start)), stages=stages, obstacles=list(OBSTACLES))
        durations.append(plan.duration if plan.certified else np.nan)
    return float(durations[0] / durations[1])


def report(found: list[tuple[Outcome, ...]], solvers: tuple[str, ...]) -> str:
    """Counts, seconds and durations, as a table."""
    lines = []
    for number, solver in enumerate(solvers):
        own = [each[number] for each in found]
        seconds = "/".join(f"{value:.2f}" for value in np.percentile([one.seconds for one in own], (50, 90, 100)))
        certified = sum(one.certified for one in own)
        alone = sum(one.certified and not one.searched for one in own)
        counts = f"{solver:8} certified {certified} of {len(own)}, {alone} without a search"
        lines.append(f"{counts}; CPU s, median/90 %/worst: {seconds}")
    both = [each for each in found if all(one.certified for one in each)]
    for number, solver in enumerate(solvers[1:], start=1):
        ratios = np.percentile([each[0].duration / each[number].duration for each in both], (0, 50, 100))
        low, median, high = ratios
        lines.append(f"{solvers[0]} over {solver}, duration: median {median:.4f}, {low:.4f} to {high:.4f}")
    return "\n".join(lines)


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", type=int, default=20)
    parser.add_argument("--seed", type=int, default=3)
    parser.add_argument("--via", choices=("joints", "position", "none"), default="joints")
    parser.add_argument("--solver", nargs="*", default=["abso"], help="besides direct")
    parser.add_argument("--blend", type=float, help="compare a stop at the via with a corner missed by so much")
    parser.add_argument("--moving", action="store_true", help="joints move at both ends, past a via too")
    parser.add_argument("--several", action="store_true", help="three to six vias")
    given = parser.parse_args()
    drawn = given.problems, given.seed, given.via, given.several
    if given.blend is None:
        solvers = ("direct", *given.solver)
        found = measured(lambda *move: tuple(outcome(*move, each, given.moving) for each in solvers), *drawn)
        print(report(found, solvers))
        return
    ratios = np.array(measured(partial(stop_over_blend, blend=given.blend), *drawn))
    known = ratios[np.isfinite(ratios)]
    low, median, high = np.percentile(known, (0, 50, 100))
    print(f"certified {known.size} of {ratios.size}; stop over blend: median {median:.3f}, {low:.3f} to {high:.3f}")


if __name__ == "__main__":
    main()
