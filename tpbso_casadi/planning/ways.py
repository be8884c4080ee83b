"""Ways of the tool from postures: the joints at a few points of each, and their whole path when it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from problems import InvalidProblem, Robot
from problems.base import FloatArray
from problems.motions import JointPath
from problems.robots import JointTurns, SpatialArm
from problems.tasks import Following, FreeTurns, Joints, Place, Surroundings, ToolPath, too_near
from problems.timing import least_along, least_along_points, least_below
from tpbso_casadi.scenario import LedStage, tool_frames

TURN = 2.0 * np.pi  # rad
SAME_TURN = 1e-9  # rad, of postures that differ by whole turns
SAME_FRAME = 1e-9  # m, and of entries of a rotation, of frames of the tool from which one way leads
DRAWN = 64  # postures of a place that states none, of which the nearest are kept
MOST_WAYS = 3  # of the tool that is free to turn, from each posture
FRAME_TURNS = (0.0, -0.4, 0.4, -1.2, 1.2)  # rad or m, by which a frame that moves is led on; 0 for the shortest way
MOST_ENDS = 6  # of a way of the tool, toward which the joints are led
FREEDOMS = {2: 2, 3: 6}  # of joints, by the robot's dimensions, with which a way of the tool leaves no choice


@dataclass(eq=False)
class ToolWay:
    """The joints along a way of the tool from one posture.

    Attributes:
        points: postures at equal steps of the way, (n, dof), rad or m.
        length: of the way, m; unknown where its path has been found.
        find: the path of the joints.
        origin: the way from which this one differs by whole turns; None where it was found itself.
        exact: the path, once it is known.
    """

    points: FloatArray
    length: float
    find: Callable[[], JointPath]
    origin: ToolWay | None = None
    exact: JointPath | None = None

    @classmethod
    def along(cls, path: JointPath) -> ToolWay:
        """The way whose path is known."""
        return cls(path.at(path.breakpoints), np.nan, lambda: path, exact=path)

    @classmethod
    def followed(cls, following: Following, points: FloatArray, stage: LedStage) -> ToolWay:
        """The way that leads through points, (n, dof), to the accuracy of its stage."""
        find = partial(following.refined, points, stage.accuracy, stage.angular_accuracy)
        return cls(points, following.path.way.length, find)

    @property
    def path(self) -> JointPath:
        """The path of the joints, which is found when it is asked for.

        Raises:
            InvalidProblem: the tool cannot be led along so accurately.
        """
        if self.exact is None:
            self.exact = self.find()
        return self.exact

    @property
    def end(self) -> FloatArray:
        """The posture at its end, (dof,), rad or m."""
        return np.asarray(self.points[-1])

    @property
    def source(self) -> ToolWay:
        """The way that takes as long, and was found itself."""
        return self.origin or self

    @property
    def is_exact(self) -> bool:
        """Whether its path is known."""
        return self.source.exact is not None

    def moved_by(self, offsets: FloatArray) -> ToolWay:
        """The way with each joint off by a constant, (dof,)."""
        source = self.source
        moved = offsets + (self.points[0] - source.points[0])
        return ToolWay(self.points + offsets, self.length, lambda: source.path.moved_by(moved), source)

    def is_within(self, robot: Robot) -> bool:
        """Whether its points are in the ranges of the joints."""
        limits = robot.limits.position
        if limits is None:
            return True
        low, high = np.array(limits).T
        return bool((self.points >= low).all() and (self.points <= high).all())

    def least_time(self, robot: Robot, fastest_tool: float | None) -> float:
        """The least time along its path, s.

        Raises:
            InvalidProblem: there is none so accurate.
        """
        path = self.source.path
        return least_along(path, robot.limits) if fastest_tool is None else least_below(path, robot, fastest_tool)


class NotClear(InvalidProblem):
    """Ways of the tool that are not clear.

    Args:
        way: one of them.
    """

    def __init__(self, way: ToolWay) -> None:
        super().__init__("goal", "the tool cannot be led there clear of everything")
        self.way = way

    def reason_among(self, around: Surroundings) -> str:
        """The bodies that are too near to each other, in words."""
        reasons = (too_near(around.robot, around.obstacles, point) for point in self.way.points)
        return next(filter(None, reasons), self.reason)


FoundWays: TypeAlias = "list[ToolWay] | InvalidProblem"  # from one posture, or why there are none


def least_times(ways: Sequence[ToolWay], robot: Robot, fastest_tool: float | None) -> FloatArray:
    """The least time along each of some ways, (n,), s: exactly where the path is known, else through its points.

    Args:
        ways: of one stage.
        robot: that moves.
        fastest_tool: the largest speed of the tool, m/s; None for any.
    """
    sources = list({id(way.source): way.source for way in ways}.values())
    times = {id(way): way.least_time(robot, fastest_tool) for way in sources if way.is_exact}
    for length in {way.length for way in sources if not way.is_exact}:
        alike = [way for way in sources if way.length == length and not way.is_exact]
        points = np.array([way.points for way in alike])
        found = least_along_points(points, robot.limits, length, fastest_tool)
        times |= {id(way): time for way, time in zip(alike, found.tolist(), strict=True)}
    return np.array([times[id(way.source)] for way in ways])


def ways_from(stage: LedStage, robot: Robot, postures: FloatArray, around: Surroundings) -> list[FoundWays]:
    """Ways of the tool of a stage from each of some postures; those alike up to whole turns are found once.

    Args:
        stage: whose tool is led.
        robot: that moves.
        postures: (n, dof).
        around: what postures keep clear of.
    """
    find = partial(_found_from, stage, robot, around=around)
    firsts, offsets = _alike(robot, postures)
    chosen = np.unique(firsts)
    found = dict(zip(chosen.tolist(), find(postures[chosen]), strict=True))
    result: list[FoundWays] = []
    for number, (first, offset) in enumerate(zip(firsts.tolist(), offsets, strict=True)):
        ways = found[first]
        if number != first and not isinstance(ways, InvalidProblem):
            moved = [way.moved_by(offset) for way in ways]
            ways = [way for way in moved if way.is_within(robot)] or find(postures[number][None])[0]
        result.append(ways)
    return result


def clear_ways(found: Sequence[FoundWays], around: Surroundings) -> list[FoundWays]:
    """The ways whose points are clear, from each of some postures; where none is, the reason.

    Args:
        found: ways from each posture.
        around: what they keep clear of.
    """
    listed = [way for ways in found if not isinstance(ways, InvalidProblem) for way in ways]
    if not listed:
        return list(found)
    points = np.concatenate([way.points for way in listed])
    clear = np.split(around.clear(points, np.zeros(len(points))), np.cumsum([len(way.points) for way in listed])[:-1])
    kept = {id(way) for way, each in zip(listed, clear, strict=True) if each.all()}
    return [
        ways if isinstance(ways, InvalidProblem) else [way for way in ways if id(way) in kept] or NotClear(ways[0])
        for ways in found
    ]


def _alike(robot: Robot, postures: FloatArray) -> tuple[NDArray[np.intp], FloatArray]:
    """The first of postures (n, dof) that is like each up to whole turns, (n,), and how much each is off, (n, dof)."""
    winding, firsts = winding_joints(robot), np.arange(len(postures))
    for number, posture in enumerate(postures):
        away = posture - postures[:number]
        same = np.abs(away - TURN * np.rint(away / TURN) * winding).max(axis=1, initial=0.0) <= SAME_TURN
        firsts[number] = np.argmax(same) if same.any() else number
    return firsts, postures - postures[firsts]


def winding_joints(robot: Robot) -> NDArray[np.bool_]:
    """The joints whose range has a turn or more, (dof,)."""
    return JointTurns.of(robot).winding if isinstance(robot, SpatialArm) else np.array(robot.endless)


def _found_from(stage: LedStage, robot: Robot, postures: FloatArray, around: Surroundings) -> list[FoundWays]:
    """Ways of the tool of a stage from each of some postures (n, dof)."""
    if stage.frame is None and stage.free_axis is None:
        return _led_ways(stage, robot, postures)
    found: list[FoundWays] = []
    for posture in postures:
        try:
            way = stage.tool_path(robot, posture)
            assert way is not None
            found.append([ToolWay.along(path) for path in _free_ways(way, robot, posture, stage, around)])
        except InvalidProblem as error:
            found.append(error)
    return found


def _led_ways(stage: LedStage, robot: Robot, postures: FloatArray) -> list[FoundWays]:
    """The way of the tool of a stage from each of some postures (n, dof), all of which are followed at once."""
    found: list[FoundWays] = [[] for _ in postures]
    for own in _of_one_frame(robot, postures):
        try:
            way = stage.tool_path(robot, postures[own[0]])
        except InvalidProblem as error:
            found = [error if number in own else ways for number, ways in enumerate(found)]
            continue
        assert way is not None
        following = Following(way, robot)
        followed = following.followed(postures[own])
        for place, number in enumerate(own.tolist()):
            if followed.complete[place]:
                found[number] = [ToolWay.followed(following, followed.postures[place], stage)]
            else:
                toward = _led_toward(way, robot, postures[number], stage)
                found[number] = toward or following.why_not(followed, place)
    return found


def _of_one_frame(robot: Robot, postures: FloatArray) -> list[NDArray[np.intp]]:
    """Numbers of postures (n, dof) whose tools are in one frame, for each of such frames; one each in the plane."""
    if not isinstance(robot, SpatialArm):
        return [np.array([number]) for number in range(len(postures))]
    frames = tool_frames(robot, postures).reshape(len(postures), -1)
    left, found = np.arange(len(postures)), []
    while left.size:
        same = np.abs(frames[left] - frames[left[0]]).max(axis=1) <= SAME_FRAME
        found.append(left[same])
        left = left[~same]
    return found


def _led_toward(way: ToolPath, robot: Robot, posture: FloatArray, stage: LedStage) -> list[ToolWay]:
    """The way of the tool from a posture (dof,) toward the nearest end that it leads to; none without a choice."""
    ends = _ends_of(way, robot, posture)
    if not len(ends):
        return []
    following = Following(way, robot, ends)
    followed = following.followed(np.tile(posture, (len(ends), 1)))
    return [ToolWay.followed(following, points, stage) for points in followed.postures[followed.complete][:1]]


def _free_ways(
    way: ToolPath, robot: Robot, posture: FloatArray, stage: LedStage, around: Surroundings
) -> list[JointPath]:
    """Paths of the joints along a way in a frame that moves, or of a tool that an axis leaves free to turn.

    Args:
        way: of the tool.
        robot: that moves.
        posture: in which it begins, (dof,).
        stage: with its accuracies.
        around: what postures keep clear of.

    Raises:
        InvalidProblem: the tool cannot be led along.
    """
    if stage.frame is not None:
        return turned_along(way, stage.seen(robot), posture, stage)
    assert isinstance(robot, SpatialArm)
    turns, accuracies = FreeTurns(way, robot, around), (stage.accuracy, stage.angular_accuracy)

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
