"""The graph of a sequence: postures at its stops, and the motions between them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from problems import InvalidProblem, Robot, Trajectory
from problems.base import FloatArray, bernstein
from problems.motions import JointPath
from problems.robots import JointTurns, SpatialArm
from problems.tasks import Following, FreeTurns, Joints, Move, Place, ShortTurns, Surroundings, ToolPath
from problems.timing import least_along, least_durations
from tpbso_casadi.scenario import LedStage, MovingStage

MOST_POSTURES = 64  # of a stop, in all their turns
SAME_TURN = 1e-9  # rad, of postures that differ by whole turns
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
        any_turn: whether joints may arrive in any turn: no goal states their values.
    """

    postures: FloatArray
    parents: list[int]
    paths: list[JointPath | None]
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


def winding_joints(robot: Robot) -> NDArray[np.bool_]:
    """The joints whose range has a turn or more, (dof,)."""
    return JointTurns.of(robot).winding if isinstance(robot, SpatialArm) else np.array(robot.endless)


def in_one_turn(robot: Robot, postures: FloatArray) -> FloatArray:
    """The first of postures (n, dof) that are alike up to whole turns."""
    return JointTurns.of(robot).distinct(postures) if isinstance(robot, SpatialArm) else postures


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


class WaysInTurns:
    """Ways of the tool from postures that are alike up to whole turns: found from one of them, moved to the others.

    Args:
        robot: that moves.
        found: the paths of the joints from a posture (dof,).
    """

    def __init__(self, robot: Robot, found: Callable[[FloatArray], list[JointPath]]) -> None:
        self._robot, self._found = robot, found
        self._known: list[tuple[FloatArray, list[JointPath]]] = []

    def __call__(self, posture: FloatArray) -> list[JointPath]:
        """The paths of the joints from a posture (dof,).

        Raises:
            InvalidProblem: the tool cannot be led along.
        """
        for other, paths in self._known:
            turns = TURN * np.rint((posture - other) / TURN) * winding_joints(self._robot)
            if np.abs(posture - other - turns).max() <= SAME_TURN:
                moved = [path.moved_by(posture - other) for path in paths]
                kept = [path for path in moved if self._is_within(path)]
                if kept:
                    return kept
        paths = self._found(posture)
        self._known.append((posture, paths))
        return paths

    def _is_within(self, path: JointPath) -> bool:
        limits = self._robot.limits.position
        if limits is None:
            return True
        low, high = np.array(limits).T
        corners = bernstein(path.coefficients, np.diff(path.breakpoints)).reshape(-1, low.size)  # they hold the path
        return bool((corners >= low).all() and (corners <= high).all())


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
