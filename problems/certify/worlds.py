"""Clearance proven by the core, where that knows robot and obstacles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from problems.base import FloatArray
from problems.certify.clearance import RELATIVE_PROOF_GAP, ClearanceProof
from problems.certify.verdict import peak_near
from problems.core import MOST_ITEMS, Kept, Proof, Where, World
from problems.limits import Clearance, CoverClearance, CoverSelfClearance, Limit, SelfClearance
from problems.motions import Trajectory
from problems.robots import Robot
from problems.scene import Obstacle

LOOKS = 33  # in a motion: the least of all is looked for within a step of one of them


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
    where = "" if found.where is None else question.world.described(found.where)
    return _of_clearance(question.world, question.margin, found, trajectory, where)


def rooms_in_core(limit: Limit, trajectory: Trajectory, times: FloatArray) -> FloatArray | None:
    """How much more than it must a motion keeps at times (n,) in s, (n,), m; None as of :func:`prove_in_core`."""
    question = _question(limit)
    return None if question is None else question.world.rooms(trajectory.at(times), which=question.which)


def prove_among(
    robot: Robot,
    obstacles: Mapping[int, Obstacle],
    trajectory: Trajectory,
    which: Kept,
    gap: float,
    most_items: int = MOST_ITEMS,
) -> ClearanceProof | None:
    """Bound the clearance of a motion for all t from obstacles that stand still or move at constant velocities.

    Args:
        robot: of which the distance of links from each other is bounded too where that is asked for.
        obstacles: by their numbers, for messages.
        trajectory: of the robot; its clock is that of the obstacles.
        which: what has to keep a distance.
        gap: by which share of the smallest clearance seen beyond the margin the proven one may be smaller.
        most_items: that are looked at; it is undecided where that is not enough.

    Returns:
        None where the core does not know the robot, a shape or a motion. What is too near is not followed further.
    """
    world = World.of(robot, tuple(obstacles.values()))
    if world is None:
        return None
    found = world.prove(trajectory, which, gap, most_items)
    if found.where is None:
        return _of_clearance(world, world.margins[Kept.FROM_OBSTACLES], found, trajectory, "")
    margin = world.margins[_side(found.where)]
    return _of_clearance(world, margin, found, trajectory, world.described(found.where, list(obstacles)))


def _side(where: Where) -> Kept:
    return Kept.FROM_EACH_OTHER if where.obstacle is None else Kept.FROM_OBSTACLES


def _of_clearance(world: World, margin: float, found: Proof, trajectory: Trajectory, where: str) -> ClearanceProof:
    """The same as clearance, m: room and what has to be kept. Broken is what the planned motion itself breaks."""
    smallest = margin + found.smallest
    if found.status:
        return ClearanceProof(margin + found.proven, smallest, found.time, where, broken=False)
    planned = found.smallest
    if found.where is not None and not world.is_exact:
        times = np.array([found.time])
        theta = trajectory.at(times)
        planned = world.rooms(theta, which=_side(found.where), times=times, errors=np.zeros_like(theta))[0]
    broken = found.where is not None and planned + world.overhang(found.where) < 0.0
    return ClearanceProof(-np.inf, smallest, found.time, where, broken, found.cell)


def _followed(question: _Question, trajectory: Trajectory, found: Proof) -> Proof:
    """What was found to be too near, at the time around it at which it is nearest."""
    begin, end = trajectory.breakpoints[[0, -1]].tolist()

    def nearness(since: FloatArray) -> FloatArray:
        times = begin + since
        errors = question.world.errors(trajectory.at(times, 1), trajectory.at(times, 2))
        return -question.world.rooms(trajectory.at(times), which=question.which, times=times, errors=errors)

    nearest, since = peak_near(nearness, found.time - begin, (end - begin) / LOOKS, end - begin)
    time = begin + since
    return replace(found, smallest=-nearest, time=time) if -nearest < found.smallest else found


def _question(limit: Limit) -> _Question | None:
    """None for a class of its own, whose statement may be another, and where there is no world."""
    if type(limit) is CoverClearance:
        return _asked(limit.robot, limit.obstacles, Kept.FROM_OBSTACLES, limit.proof_gap)
    if type(limit) is CoverSelfClearance:
        return _asked(limit.robot, (), Kept.FROM_EACH_OTHER, limit.proof_gap)
    if type(limit) is Clearance and not limit.robot.is_covered:
        obstacles = {pair.number: pair.obstacle for pair in limit.pairs}
        if sorted(obstacles) == list(range(1, len(obstacles) + 1)):
            among = tuple(obstacles[number] for number in sorted(obstacles))
            return _asked(limit.robot, among, Kept.FROM_OBSTACLES, RELATIVE_PROOF_GAP)
    if type(limit) is SelfClearance and not limit.robot.is_covered:
        return _asked(limit.robot, (), Kept.FROM_EACH_OTHER, RELATIVE_PROOF_GAP)
    return None


def _asked(robot: Robot, obstacles: tuple[Obstacle, ...], which: Kept, gap: float) -> _Question | None:
    world = World.of(robot, obstacles)
    return None if world is None else _Question(world, which, world.margins[which], gap)
