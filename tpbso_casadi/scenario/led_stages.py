"""Stages whose tool is led along a way: lines, arcs, paths through points."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, Self

import casadi as ca
import numpy as np

from problems import InvalidProblem, Place, Robot, Trajectory
from problems.base import FloatArray, InvalidTable, Range, ReadBy, as_array, at
from problems.limits import FreeAxis
from problems.robots import SpatialArm
from problems.tasks import Arc, Corners, Pose, Position, SeenFrom, SteadySpeed, StraightLine, ToolCurve, ToolPath
from tpbso_casadi.scenario.expressions import ConstraintSection
from tpbso_casadi.scenario.frames import FramedPoints, FramedSection, PoseInFrame, StandingFrame
from tpbso_casadi.scenario.input_files import InputFolder, read_points
from tpbso_casadi.scenario.places import AnyPlace, Coordinates, FreeAxisKeys
from tpbso_casadi.scenario.stage_section import MovingStage
from tpbso_casadi.scenario.validation import ANGULAR, Positive, ScenarioError, Section, SpacePoint

ACCURACY, ANGULAR_ACCURACY = 1e-3, 0.01  # of lines, m and rad
LARGEST_TOLERANCE = 0.5  # share of a steady speed
ROUNDING = 0.7  # of the accuracy: what corners use up


class SteadySpeedTable(Section):
    """The speed of the tool that is kept along a way, m/s.

    Attributes:
        speed: of the tool, m/s.
        tolerance: share of it by which the tool may be slower or faster.
        at_ends: distance from start and goal within which it may be slower, m; as far as limits need by default.
        at_corners: the same of corners.
    """

    speed: Positive
    tolerance: Annotated[Positive, Range(most=LARGEST_TOLERANCE)] = 0.05
    at_ends: Positive | None = None
    at_corners: Positive | None = None

    @property
    def steady(self) -> SteadySpeed:
        """The steady speed that the table states."""
        return SteadySpeed(self.speed, self.tolerance, self.at_ends, self.at_corners)


def read_tool_speed(table: Any) -> SteadySpeedTable:
    """The table of a steady speed of the tool, or a number alone, m/s."""
    if isinstance(table, SteadySpeedTable):
        return table
    return SteadySpeedTable.from_table(table if isinstance(table, Mapping) else {"speed": table})


AnyToolSpeed = Annotated[SteadySpeedTable, ReadBy(read_tool_speed)]


class LedStage(FramedSection, FreeAxisKeys, MovingStage):
    """A stage whose tool is led along a way; accuracies in m and rad, speeds in m/s.

    The turn about a free axis, and the range that is stated, are against the even rotation from start to end.

    Attributes:
        frame: in which the way is stated: one of the [[frames]], or that of the tool of the arm of this name, which may
            move; the world where None.
        max_tool_speed: that the tool does not exceed, m/s.
        tool_speed: that the tool keeps, but next to ends and corners, m/s; or a table.
    """

    may_move: ClassVar[bool] = True

    accuracy: Positive = ACCURACY
    angular_accuracy: Annotated[Positive, ANGULAR] = ANGULAR_ACCURACY
    max_tool_speed: Positive | None = None
    tool_speed: AnyToolSpeed | None = None

    def check(self) -> None:
        super().check()
        if self.frame is not None and self.frame == self.arm:
            raise InvalidTable("the tool itself does not move in its own frame: name another arm", "frame")
        if self.turn is not None and not self.turn[0] <= 0.0 <= self.turn[1]:
            raise InvalidTable("does not hold 0, which is how the tool is turned at first", "turn")
        if self.max_tool_speed is not None and self.tool_speed is not None:
            raise InvalidTable("tool_speed says how fast the tool is; leave max_tool_speed out", "max_tool_speed")

    def check_moving(self) -> None:
        for key in ("max_tool_speed", "tool_speed", "free"):
            if self.frame is not None and getattr(self, key) is not None:
                raise InvalidTable("of ways that are stated in the world alone", key)

    @property
    def manner(self) -> dict[str, Any]:
        steady = self.tool_speed  # of which a plan says where it is kept
        return super().manner | ({} if steady is None else {"tool_speed": [steady.speed, steady.tolerance]})

    @property
    def note(self) -> str:
        return "" if self.tool_speed is None else self.tool_speed.steady.note

    @property
    def fastest_tool(self) -> float | None:
        """The speed to which the tool comes at most, m/s; None where nothing is said of it."""
        return self.max_tool_speed if self.tool_speed is None else self.tool_speed.speed

    def with_speed_of(self, motion: Trajectory, robot: Robot, posture: FloatArray) -> tuple[Self, str | None]:
        """The stage, which says where a motion keeps the tool's speed; and where and why it does not, if so."""
        path = self.tool_path(robot, posture)
        assert path is not None and self.tool_speed is not None
        kept, broken = self.tool_speed.steady.where_kept(path, robot, motion)
        distances = {"at_ends": kept.at_ends or None, "at_corners": kept.at_corners or None}
        return self.replaced(tool_speed=self.tool_speed.replaced(**distances)), broken

    def end(self, robot: Robot, posture: FloatArray) -> Pose | Position:
        """The end of the path that begins in a posture (dof,)."""
        raise NotImplementedError

    def way(self, robot: Robot, start: FloatArray, end: FloatArray) -> ToolCurve:
        """The way from a point (dim,), m, to another."""
        raise NotImplementedError

    def seen(self, robot: Robot) -> Robot:
        """The robot in the frame in which the way is stated.

        Raises:
            InvalidProblem: it has no such frame.
        """
        if self.frame is None:
            return robot
        if not isinstance(robot, SpatialArm):
            raise InvalidProblem("frame", "there is one arm alone; leave it out")
        return robot.seen_from(self.frame)

    def goals_from(self, robot: Robot, posture: FloatArray) -> Place | list[Place]:
        end = self.end(self.seen(robot), posture)
        if self.frame is not None:
            assert isinstance(end, Pose)
            return SeenFrom(self.frame, end)
        free = self.free_axis
        if free is None:
            return end
        self._check_free(end)
        assert isinstance(end, Pose)
        return replace(end, free=self.free, turn=self.turn, tilt=self.tilt)

    def _check_free(self, end: Place) -> None:
        """An axis that is free is one of a tool in space, within its ranges.

        Raises:
            InvalidProblem: it is not.
        """
        free = self.free_axis
        if free is not None and not isinstance(end, Pose):
            raise InvalidProblem("free", "in the plane no axis of the tool is free; leave it out")
        if free is not None:
            free.check()

    def tool_path(self, robot: Robot, posture: FloatArray) -> ToolPath | None:
        view = self.seen(robot)
        (start, turned), end = _tool(view, posture), self.end(view, posture)
        way = self.way(view, start, end.position(view))
        self._check_free(end)
        if turned is None or not isinstance(end, Pose):
            return ToolPath(way)
        assert end.rotation is not None
        free, last = self.free_axis, end.rotation
        if free is not None and free.turn is None:  # then the turn at the end does not matter
            last = FreeAxis(free.axis).nearest_of(last, turned[None])[0]
        frame = None
        if self.frame is not None and isinstance(robot, SpatialArm):
            frame = robot.tip_places(robot.tool_tip), robot.tip_places(self.frame)
        return ToolPath(way, (turned, last), free, frame=frame)

    def further_constraints(self, robot: Robot, posture: FloatArray) -> list[ConstraintSection]:
        path = self.tool_path(robot, posture)
        assert path is not None
        kinds = path.constraints(robot, self.accuracy, self.angular_accuracy)
        kinds += [] if self.max_tool_speed is None else [path.speed_limit(robot, self.max_tool_speed)]
        kinds += [] if self.tool_speed is None else self.tool_speed.steady.limits(path, robot)
        return [ConstraintSection.of(kind) for kind in kinds]


class LineStage(LedStage):
    """The tool goes straight, or along an arc ``through`` a point.

    Where ``goal`` states no orientation, or ``by`` and ``along`` say how far to go along the axes of the world and of
    the tool, it stays turned as it is.
    """

    kind: Literal["line"]
    goal: AnyPlace | None = None
    by: Coordinates | None = None
    along: SpacePoint | None = None
    through: Coordinates | None = None

    def check(self) -> None:
        super().check()
        if [self.goal, self.by, self.along].count(None) != 2:
            raise InvalidTable("one of goal, by and along is needed", "goal")
        goal = self.goal.pose if isinstance(self.goal, PoseInFrame) else self.goal
        if goal is not None and not isinstance(goal, Pose | Position):
            raise InvalidTable("a line ends at a position or pose; joints are reached by kind = 'move'", "goal")
        if isinstance(goal, Pose) and goal.free is not None:
            raise InvalidTable("free, turn and tilt are of the whole line: state them beside its goal", "goal", "free")
        if goal is not self.goal and self.frame is not None:
            raise InvalidTable("the whole line is stated in a frame; leave this one out", "goal", "frame")

    def in_world(self, frame: StandingFrame) -> Self:
        moves: dict[str, Callable[[Any], Any]] = {"goal": frame.pose, "by": frame.vector, "through": frame.point}
        found = {}
        for key, move in moves.items():
            if getattr(self, key) is not None:
                with at(key):
                    found[key] = move(getattr(self, key))
        return self.replaced(**{key: [*new] if isinstance(new, tuple) else new for key, new in found.items()})

    def end(self, robot: Robot, posture: FloatArray) -> Pose | Position:
        start, turned = _tool(robot, posture)
        if self.by is not None:
            return _standing(start + _numbers(robot, self.by, "by"), turned)
        if self.along is not None:
            if turned is None:
                raise InvalidProblem("along", "in the plane a line goes by = [x, y], or to a goal")
            return _standing(start + turned @ np.array(self.along), turned)
        goal = self.goal
        assert goal is not None
        if isinstance(goal, Pose) and goal.quaternion is not None:
            return goal
        return _standing(_numbers(robot, goal.position(robot), "goal"), turned)

    def way(self, robot: Robot, start: FloatArray, end: FloatArray) -> ToolCurve:
        if self.through is None:
            return StraightLine(start, end)
        return Arc(start, _numbers(robot, self.through, "through"), end)


class PathStage(FramedPoints, LedStage):
    """The tool goes straight from where it is to points, one after the other, turned as it is; corners are rounded."""

    kind: Literal["path"]
    accuracy: Positive

    def with_files(self, folder: InputFolder) -> Self:
        if not isinstance(self.points, str):
            return self
        try:
            return self.replaced(points=read_points(folder, self.points))
        except ScenarioError as error:
            raise ScenarioError(f"points: {error}") from error

    def _given(self, robot: Robot) -> FloatArray:
        if isinstance(self.points, str):
            raise InvalidProblem("points", f"{self.points!r} has not been read; only a scenario file can name a CSV")
        if {len(point) for point in self.points} != {robot.dim}:
            raise InvalidProblem(
                "points", f"points of {robot.dim} coordinates are needed; the tool stays turned as it is"
            )
        return np.array(self.points, dtype=np.float64)

    def end(self, robot: Robot, posture: FloatArray) -> Pose | Position:
        return _standing(self._given(robot)[-1], _tool(robot, posture)[1])

    def way(self, robot: Robot, start: FloatArray, end: FloatArray) -> ToolCurve:
        points = self._given(robot)
        onward = points[1:] if np.linalg.norm(points[0] - start) <= self.accuracy else points
        return Corners(np.vstack([start, onward]), ROUNDING * self.accuracy)


def _tool(robot: Robot, posture: FloatArray) -> tuple[FloatArray, FloatArray | None]:
    """The position of the tool in a posture (dof,), (dim,), m, and its rotation, (3, 3); None in the plane."""
    if not isinstance(robot, SpatialArm):
        return as_array(robot.tool.position(ca.DM(posture).T))[0], None
    (frame,) = tool_frames(robot, posture[None])
    return frame[:3, 3], frame[:3, :3]


def tool_frames(robot: SpatialArm, theta: FloatArray) -> FloatArray:
    """Frames of the tool in postures (n, dof): (n, 4, 4)."""
    positions, rotations = robot.tool.pose(ca.DM(theta))
    frames = np.tile(np.eye(4), (len(theta), 1, 1))
    frames[:, :3, :3] = as_array(rotations).reshape(-1, 3, 3)
    frames[:, :3, 3] = as_array(positions)
    return frames


def _standing(point: FloatArray, turned: FloatArray | None) -> Pose | Position:
    """The tool at a point (dim,), m, turned as it is."""
    if turned is None:
        return Position(tuple(point.tolist()))
    homogeneous = np.eye(4)
    homogeneous[:3, :3], homogeneous[:3, 3] = turned, point
    return Pose.from_matrix(homogeneous)


def _numbers(robot: Robot, numbers: Sequence[float] | FloatArray, key: str) -> FloatArray:
    if len(numbers) != robot.dim:
        raise InvalidProblem(key, f"{robot.dim} coordinates are needed")
    return np.array(numbers)
