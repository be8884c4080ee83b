"""Clearance proven by the core, where that knows robot and obstacles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from problems.base import FloatArray
from problems.certify.clearance import ClearanceProof, ClosestApproach
from problems.certify.settings import DEFAULT_APPROACH, ApproachSettings
from problems.certify.verdict import peak_near
from problems.core import MOST_ITEMS, ClosestPair, CompiledWorld, Proof, Separation
from problems.limits import CoverClearance, Limit
from problems.motions import Trajectory
from problems.robots import Robot
from problems.scene import Obstacle

EXAMINED_TIMES = 33  # of a motion: a minimum is followed within a step of one of them


@dataclass(frozen=True)
class _Question:
    """A limit as a question to the core.

    Attributes:
        world: the robot and the obstacles.
        which: bodies that have to keep a distance.
        margin: that distance, m.
        gap: share of the smallest clearance seen beyond the margin by which the proven one may be smaller.
    """

    world: CompiledWorld
    which: Separation
    margin: float
    gap: float

    @classmethod
    def of(cls, limit: Limit) -> _Question | None:
        """The question of a limit; None where it is not one about a world, or the core does not know that."""
        stated = limit.world_question
        world = None if stated is None else CompiledWorld.of(stated.robot, stated.obstacles)
        if stated is None or world is None:
            return None
        which = Separation.FROM_EACH_OTHER if stated.of_own_links else Separation.FROM_OBSTACLES
        return cls(world, which, world.margins[which], stated.proof_gap)


def prove_clearance_in_core(limit: Limit, trajectory: Trajectory) -> ClearanceProof | None:
    """Bound the clearance of a motion for all t; None where the core does not know what the limit is about."""
    question = _Question.of(limit)
    if question is None:
        return None
    proof = question.world.prove(trajectory, question.which, question.gap)
    if proof.status is False:
        proof = _followed(question, trajectory, proof)
    where = "" if proof.where is None else question.world.described(proof.where)
    return _of_clearance(question.world, question.margin, proof, trajectory, where)


def clearances_in_core(limit: Limit, trajectory: Trajectory, times: FloatArray) -> FloatArray | None:
    """Clearances beyond the margin at times (n,) in s, (n,), m; None as of :func:`prove_clearance_in_core`."""
    question = _Question.of(limit)
    return None if question is None else question.world.clearance_margins(trajectory.at(times), which=question.which)


def closest_cover(
    limit: CoverClearance, trajectory: Trajectory, settings: ApproachSettings = DEFAULT_APPROACH
) -> ClosestApproach:
    """The closest approach of covers, found at many times and followed from there; no proof."""
    limit, times = limit.without_growth(), trajectory.times(settings.times)
    step = trajectory.duration / settings.times
    for _ in range(settings.zooms):
        _, time, _ = limit.nearest(trajectory, times)
        times = np.clip(np.linspace(time - step, time + step, settings.zoom_points), 0.0, trajectory.duration)
        step = 2.0 * step / (settings.zoom_points - 1)
    return ClosestApproach(*limit.nearest(trajectory, times))


def prove_among(
    robot: Robot,
    obstacles: Mapping[int, Obstacle],
    trajectory: Trajectory,
    which: Separation,
    gap: float,
    most_items: int = MOST_ITEMS,
) -> ClearanceProof | None:
    """Bound the clearance of a motion for all t from obstacles that stand still or move at constant velocities.

    Args:
        robot: of which the distance of links from each other is bounded too where that is asked for.
        obstacles: by their numbers, for messages.
        trajectory: of the robot; its clock is that of the obstacles.
        which: bodies that have to keep a distance.
        gap: by which share of the smallest clearance seen beyond the margin the proven one may be smaller.
        most_items: that are bounded; it is undecided where that is not enough.

    Returns:
        None where the core does not know the robot, a shape or a motion. A minimum is not followed further.
    """
    world = CompiledWorld.of(robot, tuple(obstacles.values()))
    if world is None:
        return None
    proof = world.prove(trajectory, which, gap, most_items)
    if proof.where is None:
        return _of_clearance(world, world.margins[Separation.FROM_OBSTACLES], proof, trajectory, "")
    margin = world.margins[_side(proof.where)]
    return _of_clearance(world, margin, proof, trajectory, world.described(proof.where, list(obstacles)))


def _side(where: ClosestPair) -> Separation:
    return Separation.FROM_EACH_OTHER if where.obstacle is None else Separation.FROM_OBSTACLES


def _of_clearance(
    world: CompiledWorld, margin: float, proof: Proof, trajectory: Trajectory, where: str
) -> ClearanceProof:
    """The proof in terms of clearance, m: the core's distance and the margin. Only the planned motion breaks it."""
    smallest = margin + proof.smallest
    if proof.status:
        return ClearanceProof(margin + proof.proven, smallest, proof.time, where, broken=False)
    planned = proof.smallest
    if proof.where is not None and not world.is_exact:
        times = np.array([proof.time])
        theta = trajectory.at(times)
        planned = world.clearance_margins(theta, which=_side(proof.where), times=times, errors=np.zeros_like(theta))[0]
    broken = proof.where is not None and planned + world.overhang(proof.where) < 0.0
    return ClearanceProof(-np.inf, smallest, proof.time, where, broken, proof.cell)


def _followed(question: _Question, trajectory: Trajectory, proof: Proof) -> Proof:
    """A failed proof with the time, near its own, at which bodies are nearest."""
    begin, end = trajectory.breakpoints[[0, -1]].tolist()

    def nearness(since: FloatArray) -> FloatArray:
        times = begin + since
        errors = question.world.errors(trajectory.at(times, 1), trajectory.at(times, 2))
        return -question.world.clearance_margins(trajectory.at(times), which=question.which, times=times, errors=errors)

    nearest, since = peak_near(nearness, proof.time - begin, (end - begin) / EXAMINED_TIMES, end - begin)
    return replace(proof, smallest=-nearest, time=begin + since) if -nearest < proof.smallest else proof
