"""The nodes and edges of the graph of a sequence: postures at its stops, and the motions between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from problems import InvalidProblem, Robot, Trajectory
from problems.base import FloatArray
from problems.robots import JointTurns, SpatialArm
from problems.tasks import Joints, Move, Place, ShortTurns
from problems.timing import least_durations
from tpbso_casadi.planning.ways import TURN, ToolWay, postures_at, winding_joints

MOST_POSTURES = 64  # of a stop, in all their turns


@dataclass(eq=False)
class SequenceStop:
    """Postures in which the arm may stand before the first stage, or after one.

    Attributes:
        postures: (n, dof), rad.
        parents: the posture of the stop before from which alone each is reached, (n,); -1 where from any.
        ways: of the tool along which each is reached, where it is led; else None.
        costs: of the goals that they reach, s, (n,) or one for all.
        any_turn: whether joints may arrive in any turn: no goal states their values.
    """

    postures: FloatArray
    parents: list[int]
    ways: list[ToolWay | None]
    costs: FloatArray | float = 0.0
    any_turn: bool = False

    @classmethod
    def free(cls, postures: FloatArray, costs: FloatArray | float = 0.0) -> SequenceStop:
        """Postures that may be reached from anywhere."""
        return cls(postures, [-1] * len(postures), [None] * len(postures), costs)

    def limited(self) -> SequenceStop:
        """The stop with the first posture from each parent, then the second ones, up to so many."""
        ranks = [self.parents[:number].count(parent) for number, parent in enumerate(self.parents)]
        kept = sorted(np.argsort(ranks, kind="stable")[:MOST_POSTURES].tolist())
        costs = np.broadcast_to(self.costs, len(self.postures))[kept]
        return SequenceStop(self.postures[kept], [self.parents[n] for n in kept], [self.ways[n] for n in kept], costs)


@dataclass(eq=False)
class Edges:
    """The motions of one stage between the postures before it and those after.

    Attributes:
        bounds: what each takes at least in free space, (before, after), s; infinite where there is none.
        durations: of those that are planned; of others at least, or about as long along a way of the tool; infinite
            where none was found.
        motions: those that are planned.
        kept: pairs of postures whose motion is that of an earlier plan.
    """

    bounds: FloatArray
    durations: FloatArray
    motions: dict[tuple[int, int], Trajectory | None] = field(default_factory=dict)
    kept: set[tuple[int, int]] = field(default_factory=set)

    def known(self, unknown: float) -> FloatArray:
        """The durations, with what is not planned yet taken to need so many times as long; (before, after), s."""
        found = self.durations * unknown
        for pair in self.motions:
            found[pair] = self.durations[pair]
        return found


def bounds_between(robot: Robot, before: FloatArray, after: FloatArray, any_turn: bool = False) -> FloatArray:
    """Least durations of the slowest joint from each posture (n, dof) to each of others (m, dof): (n, m), s.

    Args:
        robot: with its limits.
        before: (n, dof).
        after: (m, dof).
        any_turn: whether joints may arrive in any turn, whatever their ranges.
    """
    ways = (after[None] - before[:, None]).reshape(-1, robot.dof)
    if any_turn:
        ways = ways - TURN * np.rint(ways / TURN) * winding_joints(robot)
    return np.asarray(least_durations(ways, robot.limits).max(axis=1).reshape(len(before), len(after)))


def in_one_turn(robot: Robot, postures: FloatArray) -> FloatArray:
    """The first of postures (n, dof) that are alike up to whole turns."""
    return JointTurns.of(robot).distinct(postures) if isinstance(robot, SpatialArm) else postures


def reached_at(goals: Sequence[Place], robot: Robot, obstacles: Sequence[Any], key: str) -> dict[int, FloatArray]:
    """Clear postures at goals, by the numbers of those that have any, each (n, dof).

    Raises:
        InvalidProblem: there is none.
    """
    found: dict[int, FloatArray] = {}
    failures: list[InvalidProblem] = []
    for number, goal in enumerate(goals):
        try:
            found[number] = postures_at(goal, robot, obstacles, key)
        except InvalidProblem as error:
            failures.append(error)
    if not found:
        raise failures[0]
    return found


def soonest_at(robot: Robot, stops: Sequence[SequenceStop]) -> FloatArray:
    """The least time from the first stop to each posture of the last, in free space, (n,), s."""
    since = np.zeros(len(stops[0].postures))
    for before, after in pairwise(stops):
        times = since[:, None] + bounds_between(robot, before.postures, after.postures)
        parents = np.array(after.parents)
        since = np.where(parents < 0, times.min(axis=0), times[parents, np.arange(len(parents))])
    return since


def in_short_turns(move: Move, reached: dict[int, FloatArray], before: FloatArray, since: FloatArray) -> SequenceStop:
    """The stop at the goals of a move: joints are in the turns that are nearest to postures before, (n, dof).

    Stated joints are reached in the turns nearest to the posture before alone, other places in any turn.

    Args:
        move: that leads there from any of the postures before.
        reached: postures at its goals, by their numbers, each (m, dof).
        before: the postures, of which there is a limited number.
        since: the least time from the beginning to each of them, (n,), s.
    """
    found = [_in_turns_from(move, reached, posture) for posture in before]
    stated = [[place.values for place in goals if isinstance(place, Joints)] for goals, _ in found]
    costs = np.concatenate([np.full(len(postures), move.goals[number].cost) for number, postures in reached.items()])
    if any(each != stated[0] for each in stated):
        each_from = zip(found, before, strict=True)
        stops = [_soonest(move, postures, costs, theta[None], np.zeros(1)) for (_, postures), theta in each_from]
        parents = [number for number, stop in enumerate(stops) for _ in stop.postures]
        postures, added = (np.concatenate(parts) for parts in zip(*((s.postures, s.costs) for s in stops), strict=True))
        return SequenceStop(postures, parents, [None] * len(parents), added).limited()
    rows = {row.tobytes(): (row, cost) for _, postures in found for row, cost in zip(postures, costs, strict=True)}
    postures, added = map(np.array, zip(*rows.values(), strict=True))
    stop = _soonest(move, postures, added, before, since)
    return replace(stop, any_turn=not any(isinstance(goal, Joints) for goal in move.goals))


def _in_turns_from(
    move: Move, reached: dict[int, FloatArray], posture: FloatArray
) -> tuple[tuple[Place, ...], FloatArray]:
    """The goals of a move, and postures at them, (n, dof), in the turns nearest to a posture (dof,)."""
    turns = ShortTurns(move.robot, Joints(tuple(posture.tolist())))
    turns.passed(move.vias)
    goals, found = turns.reached(move.goals), []
    for number, postures in reached.items():
        goal = goals[number]
        found.append(np.array([goal.values]) if isinstance(goal, Joints) else nearest(move.robot, postures, posture))
    return goals, np.concatenate(found)


def nearest(robot: Robot, postures: FloatArray, posture: FloatArray) -> FloatArray:
    """Postures (n, dof) with each joint in the turn within its range that is nearest to a posture (dof,)."""
    if isinstance(robot, SpatialArm):
        return JointTurns.of(robot).nearest(postures, posture)
    return postures + TURN * np.where(robot.endless, np.rint((posture - postures) / TURN), 0.0)


def _soonest(
    move: Move, postures: FloatArray, costs: FloatArray, before: FloatArray, since: FloatArray
) -> SequenceStop:
    """The stop at those of postures (m, dof), with costs (m,), that are soonest reached past others, (n, dof).

    Args:
        move: that leads there.
        postures: (m, dof).
        costs: of their goals, (m,), s.
        before: the others, (n, dof).
        since: the least time from the beginning to each of these, (n,), s.
    """
    first = (since[:, None] + bounds_between(move.robot, before, postures)).min(axis=0) + costs
    kept = np.argsort(first, kind="stable")[:MOST_POSTURES]
    return SequenceStop.free(postures[kept], costs[kept])
