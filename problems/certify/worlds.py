"""Clearance proven by the compiled core, where that knows robot and obstacles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from problems.certify.clearance import RELATIVE_PROOF_GAP, ClearanceProof
from problems.core import Kept, Proof, World
from problems.limits import Clearance, CoverClearance, CoverLimit, Limit, SelfClearance
from problems.motions import Trajectory
from problems.robots import Robot, SpatialArm
from problems.scene import Obstacle

ZOOMS, LOOKS = 4, 33


@dataclass(frozen=True)
class _Question:
    """What a limit asks of the core: what has to keep a distance, how much, and how sharp the answer has to be."""

    world: World
    which: Kept
    margin: float
    gap: float


def prove_in_core(limit: Limit, trajectory: Trajectory) -> ClearanceProof | None:
    """Bound the clearance of a motion for all t; None where the core does not know what the limit speaks of."""
    question = _question(limit)
    if question is None:
        return None
    found = question.world.prove(trajectory, question.which, question.gap)
    if found.status is False:
        found = _followed(question, trajectory, found)
    smallest = question.margin + found.smallest
    where = "" if found.where is None else question.world.described(found.where)
    if found.status:
        return ClearanceProof(question.margin + found.proven, smallest, found.time, where, broken=False)
    broken = found.where is not None and found.smallest + question.world.overhang(found.where) < 0.0
    return ClearanceProof(-np.inf, smallest, found.time, where, broken)


def _followed(question: _Question, trajectory: Trajectory, found: Proof) -> Proof:
    """What was found to be too near, at the time around it at which it is nearest."""
    step = trajectory.duration / LOOKS
    for _ in range(ZOOMS):
        times = np.clip(found.time + step * np.linspace(-1.0, 1.0, LOOKS), 0.0, trajectory.duration)
        rooms = question.world.rooms(trajectory.at(times), which=question.which)
        worst = int(np.argmin(rooms))
        if rooms[worst] < found.smallest:
            found = replace(found, smallest=float(rooms[worst]), time=float(times[worst]))
        step *= 2.0 / (LOOKS - 1)
    return found


def _question(limit: Limit) -> _Question | None:
    if isinstance(limit, CoverLimit):
        among = limit.obstacles if isinstance(limit, CoverClearance) else ()
        return _of(limit.robot, among, bool(among), limit.proof_gap)
    if type(limit) is Clearance and not limit.robot.is_covered:
        obstacles = {pair.number: pair.obstacle for pair in limit.pairs}
        if sorted(obstacles) == list(range(1, len(obstacles) + 1)):
            return _of(limit.robot, tuple(obstacles[number] for number in sorted(obstacles)), True, RELATIVE_PROOF_GAP)
    if type(limit) is SelfClearance and not limit.robot.is_covered:
        return _of(limit.robot, (), False, RELATIVE_PROOF_GAP)
    return None


def _of(
    robot: Robot | SpatialArm, obstacles: tuple[Obstacle, ...], from_obstacles: bool, gap: float
) -> _Question | None:
    world = World.of(robot, obstacles)
    if world is None:
        return None
    which = Kept.FROM_OBSTACLES if from_obstacles else Kept.FROM_EACH_OTHER
    return _Question(world, which, world.margins[0 if from_obstacles else 1], gap)
