"""The graph of a sequence: postures at its stops, and the motions between them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from problems import InvalidProblem, Robot, Trajectory
from problems.base import FloatArray
from problems.motions import JointPath
from problems.robots import SpatialArm
from problems.tasks import Following, FreeTurns, Joints, Move, Place, ShortTurns, Surroundings, ToolPath
from problems.timing import least_along, least_durations
from tpbso_casadi.scenario import LedStage, MovingStage

MOST_POSTURES = 12  # of a stop
TURN = 2.0 * np.pi  # rad
DRAWN = 64  # postures of a place that states none, of which the nearest are kept
MOST_WAYS = 3  # of the tool that is free to turn, from each posture
FRAME_TURNS = (0.0, -0.4, 0.4, -1.2, 1.2)  # rad or m, by which a frame that moves is led on; 0 for the shortest way
MOST_ENDS = 6  # of a way of the tool, toward which the joints are led
FREEDOMS = {2: 2, 3: 6}  # of joints, by the robot's dimensions, with which a way of the tool leaves no choice


@dataclass(eq=False)
class SequenceStop:
    """Postures in which the arm may stand before the first stage, or after one.

    Attributes:
        postures: (n, dof), rad.
        parents: the posture of the stop before from which alone each is reached, (n,); -1 where from any.
        paths: of the joints that lead there, where they are known; else None.
        costs: of the goals that they reach, s, (n,) or one for all.
    """

    postures: FloatArray
    parents: list[int]
    paths: list[JointPath | None]
    costs: FloatArray | float = 0.0

    @classmethod
    def free(cls, postures: FloatArray, costs: FloatArray | float = 0.0) -> SequenceStop:
        """Postures that may be reached from anywhere."""
        return cls(postures, [-1] * len(postures), [None] * len(postures), costs)

    def limited(self) -> SequenceStop:
        """The stop with the first posture from each parent, then the second ones, up to so many."""
        ranks = [self.parents[:number].count(parent) for number, parent in enumerate(self.parents)]
        kept = sorted(np.argsort(ranks, kind="stable")[:MOST_POSTURES].tolist())
        costs = np.broadcast_to(self.costs, len(self.postures))[kept]
        return SequenceStop(self.postures[kept], [self.parents[n] for n in kept], [self.paths[n] for n in kept], costs)


@dataclass(eq=False)
class Edges:
    """The motions of one stage between the postures before it and those after.

    Attributes:
        bounds: what each takes at least in free space, (before, after), s; infinite where there is none.
        durations: of those that are planned; of others at least, along their path too; infinite where none was found.
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


def bounds_between(robot: Robot, before: FloatArray, after: FloatArray) -> FloatArray:
    """Least durations of the slowest joint from each posture (n, dof) to each of others (m, dof): (n, m), s."""
    ways = (after[None] - before[:, None]).reshape(-1, robot.dof)
    return np.asarray(least_durations(ways, robot.limits).max(axis=1).reshape(len(before), len(after)))


def postures_at(goal: Place, robot: Robot, obstacles: Sequence[Any], key: str) -> FloatArray:
    """Clear postures at a place, (n, dof).

    Raises:
        InvalidProblem: there is none.
    """
    if isinstance(goal, Joints):
        return np.array([goal.values])
    branches = [place.branch_angles for place in goal.branches(robot, obstacles, None, key)]
    if all(branches):
        return np.array(branches)
    choices = goal.choices(robot)
    low, high = (np.array([getattr(choice, end) for choice in choices]) for end in ("lower", "upper"))
    drawn = np.random.default_rng(1).uniform(low, high, (DRAWN, len(choices)))
    postures, there = goal.postures(robot, drawn)
    return np.asarray(postures[there])


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


def in_short_turns(move: Move, reached: dict[int, FloatArray], before: FloatArray) -> SequenceStop:
    """The stop at the goals of a move: endless joints are in the turns that are nearest to postures before, (n, dof).

    Stated joints are reached in the turns nearest to the posture before alone, other places in any turn.

    Args:
        move: that leads there from any of the postures before.
        reached: postures at its goals, by their numbers, each (m, dof).
        before: the postures, of which there is a limited number.
    """
    found = [_in_turns_from(move, reached, posture) for posture in before]
    stated = [[place.values for place in goals if isinstance(place, Joints)] for goals, _ in found]
    costs = np.concatenate([np.full(len(postures), move.goals[number].cost) for number, postures in reached.items()])
    if any(each != stated[0] for each in stated):
        each_from = zip(found, before, strict=True)
        stops = [_soonest(move, postures, costs, theta[None]) for (_, postures), theta in each_from]
        parents = [number for number, stop in enumerate(stops) for _ in stop.postures]
        postures, added = (np.concatenate(parts) for parts in zip(*((s.postures, s.costs) for s in stops), strict=True))
        return SequenceStop(postures, parents, [None] * len(parents), added).limited()
    rows = {row.tobytes(): (row, cost) for _, postures in found for row, cost in zip(postures, costs, strict=True)}
    postures, added = map(np.array, zip(*rows.values(), strict=True))
    return _soonest(move, postures, added, before)


def _in_turns_from(
    move: Move, reached: dict[int, FloatArray], posture: FloatArray
) -> tuple[tuple[Place, ...], FloatArray]:
    """The goals of a move, and postures at them, (n, dof), in the turns nearest to a posture (dof,)."""
    turns, endless = ShortTurns(move.robot, Joints(tuple(posture.tolist()))), np.array(move.robot.endless)
    turns.passed(move.vias)
    goals, found = turns.reached(move.goals), []
    for number, postures in reached.items():
        goal = goals[number]
        nearest = postures + TURN * np.where(endless, np.rint((posture - postures) / TURN), 0.0)
        found.append(np.array([goal.values]) if isinstance(goal, Joints) else nearest)
    return goals, np.concatenate(found)


def _soonest(move: Move, postures: FloatArray, costs: FloatArray, before: FloatArray) -> SequenceStop:
    """The stop at those of postures (m, dof), with costs (m,), that are soonest reached from others, (n, dof)."""
    first = bounds_between(move.robot, before, postures).min(axis=0) + costs
    kept = np.argsort(first, kind="stable")[:MOST_POSTURES]
    return SequenceStop.free(postures[kept], costs[kept])


def ways_along(
    way: ToolPath, robot: Robot, posture: FloatArray, stage: MovingStage, around: Callable[[], Surroundings]
) -> list[JointPath]:
    """Paths of the joints along a way of the tool; several where an axis leaves the tool free to turn.

    Args:
        way: of the tool.
        robot: that moves.
        posture: in which it begins, (dof,).
        stage: with its accuracies.
        around: tells what postures keep clear of, where that is asked.

    Raises:
        InvalidProblem: the tool cannot be led along.
    """
    assert isinstance(stage, LedStage)
    if stage.frame is not None:
        return turned_along(way, stage.seen(robot), posture, stage)
    if way.free is None:
        return [led_along(way, robot, posture, stage)]
    assert isinstance(robot, SpatialArm)
    turns, accuracies = FreeTurns(way, robot, around()), (stage.accuracy, stage.angular_accuracy)

    def followed(laws: Iterable[ToolPath]) -> Iterator[JointPath]:
        for law in laws:
            with suppress(InvalidProblem):
                yield Following(law, robot).joints(posture, *accuracies)

    stated = list(followed([way]))
    found = [*stated, *followed(turns.even(posture))] or [*followed(turns.searched(posture))]
    if not found:
        return [led_along(way, robot, posture, stage)]
    order = sorted(range(len(found)), key=lambda number: least_along(found[number], robot.limits))
    kept = [number for rank, number in enumerate(order) if rank < MOST_WAYS or number < len(stated)]
    return [found[number] for number in kept]


def turned_along(way: ToolPath, robot: Robot, posture: FloatArray, stage: LedStage) -> list[JointPath]:
    """Paths of the joints along a way in a frame that one first joint moves: the shortest, and others as it turns more.

    Raises:
        InvalidProblem: the tool cannot be led along.
    """
    found, failure = list[JointPath](), None
    for turn in FRAME_TURNS:
        toward = None if turn == 0.0 else posture + turn * np.eye(robot.dof)[0]
        try:
            found.append(Following(way, robot, toward).joints(posture, stage.accuracy, stage.angular_accuracy))
        except InvalidProblem as error:
            failure = failure or error
    if not found:
        assert failure is not None
        raise failure
    return found


def led_along(way: ToolPath, robot: Robot, posture: FloatArray, stage: LedStage) -> JointPath:
    """The joints along a way of the tool, the shortest way; where that ends, toward postures at the way's end.

    Raises:
        InvalidProblem: the tool cannot be led along.
    """
    accuracies = stage.accuracy, stage.angular_accuracy
    try:
        return Following(way, robot).joints(posture, *accuracies)
    except InvalidProblem as error:
        for toward in _ends_of(way, robot, posture):
            with suppress(InvalidProblem):
                return Following(way, robot, toward).joints(posture, *accuracies)
        raise error


def _ends_of(way: ToolPath, robot: Robot, posture: FloatArray) -> FloatArray:
    """Postures with the tool at the end of a way, the nearest first, (n, dof); where that leaves a choice at all."""
    (end,) = way.places(np.ones(1))
    if robot.dof <= FREEDOMS[robot.dim]:
        return np.empty((0, robot.dof))
    try:
        found = postures_at(end, robot, (), "goal")
    except InvalidProblem:
        return np.empty((0, robot.dof))
    nearest = np.argsort(np.abs(found - posture).max(axis=1), kind="stable")
    return np.asarray(found[nearest[:MOST_ENDS]])
