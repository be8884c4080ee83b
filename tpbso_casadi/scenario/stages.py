"""The stages of a sequence as tables: what moves, what is taken up and put down, what waits and what is told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Annotated, Any, ClassVar, Literal, Protocol, Self, TypeAlias, TypeVar

import casadi as ca
import numpy as np

from problems import InvalidProblem, Joints, Place, Robot, Trajectory
from problems.base import Count, FloatArray, InvalidTable, Range, ReadBy, as_array, did_you_mean, flat, in_words
from problems.limits import FreeAxis
from problems.robots import SpatialArm
from problems.tasks import Arc, Corners, Pose, Position, SteadySpeed, StraightLine, ToolCurve, ToolPath
from tpbso_casadi.scenario.carried import BODY, MOST_CONTACTS, Contacts
from tpbso_casadi.scenario.constraints import OwnConstraints
from tpbso_casadi.scenario.expressions import ConstraintSection
from tpbso_casadi.scenario.input_files import InputFolder, PathPoints, read_points
from tpbso_casadi.scenario.obstacles import AnyObstacle
from tpbso_casadi.scenario.places import (
    AnyGoals,
    AnyPlace,
    AnyPlaces,
    Coordinates,
    FreeAxisKeys,
)
from tpbso_casadi.scenario.spatial_robots import PayloadTable, PerJoint
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    LONGEST_WORD,
    NotNegative,
    Positive,
    ScenarioError,
    Section,
    SpacePoint,
    Word,
)

ACCURACY, ANGULAR_ACCURACY = 1e-3, 0.01  # of lines, m and rad
LARGEST_TOLERANCE = 0.5  # share of a steady speed
ROUNDING = 0.7  # of the accuracy: what corners use up
LONGEST_WAIT = 3_600.0  # s
OF_THE_ROBOT = ("max_speed", "max_acceleration", "max_jerk", "payload")  # keys that a stage may state anew

Name: TypeAlias = Annotated[Word, Count(1, LONGEST_WORD)]


class Changing(Protocol):
    """A state of a sequence, as far as stages change it."""

    def attached(self, stage: AttachStage, posture: FloatArray) -> Self:
        """The state with a body in the hand: an obstacle by its name, or one in the tool's frame."""

    def detached(self, name: str, posture: FloatArray) -> Self:
        """The state with a body that was carried standing where it is."""


C = TypeVar("C", bound=Changing)


class StageSection(Section):
    """A table of [[task.stages]]: the interface of every kind.

    Attributes:
        moves: whether the arm moves, which is then planned.
    """

    moves: ClassVar[bool] = False

    kind: Word

    @property
    def pause(self) -> float:
        """How long the arm stands, s."""
        return 0.0

    def changed(self, cell: C, posture: FloatArray) -> C:
        """The state after the stage, if the arm is then in a posture (dof,)."""
        return cell

    def table(self) -> dict[str, Any]:
        return {key: value for key, value in super().table().items() if value not in (None, [], "")}

    def with_files(self, folder: InputFolder) -> Self:
        """The stage with the content of the files that it names."""
        return self

    @property
    def in_stated_turns(self) -> Self:
        """The stage whose joints have the stated values, not those of the nearest turns."""
        return self


class MovingStage(StageSection):
    """A stage in which the arm moves; what it states of contacts, margin, limits and payload holds in it alone."""

    moves: ClassVar[bool] = True

    may_touch: Contacts = field(default_factory=list)
    margin: NotNegative | None = None
    constraints: OwnConstraints = field(default_factory=list)
    max_speed: Annotated[PerJoint | None, ANGULAR] = None
    max_acceleration: Annotated[PerJoint | None, ANGULAR] = None
    max_jerk: Annotated[PerJoint | None, ANGULAR] = None
    payload: PayloadTable | None = None

    @property
    def of_the_robot(self) -> dict[str, Any]:
        """Keys of the robot's table that it states anew."""
        stated = {key: getattr(self, key) for key in OF_THE_ROBOT}
        return {key: value for key, value in stated.items() if value is not None}

    @property
    def manner(self) -> dict[str, Any]:
        """The keys on which its motion depends between two postures that are known."""
        return self.table()

    @property
    def vias(self) -> list[Place] | None:
        """Places that are passed; none by default."""
        return None

    @property
    def note(self) -> str:
        """A line on what the stage keeps, for whoever reads the plan; empty by default."""
        return ""

    def goals_from(self, robot: Robot, posture: FloatArray) -> Place | list[Place]:
        """The goals of the stage, if it begins in a posture (dof,)."""
        raise NotImplementedError

    def tool_path(self, robot: Robot, posture: FloatArray) -> ToolPath | None:
        """The way of the tool from a posture (dof,) on; None where that is free."""
        return None

    def further_constraints(self, robot: Robot, posture: FloatArray) -> list[ConstraintSection]:
        """Further constraints of the stage besides the stated ones; none by default."""
        return []


class MoveStage(MovingStage):
    """A move to a place in the least time, among obstacles; a blended one goes on to the next without a stop.

    Attributes:
        blend: how far from its goal the motion may pass, m of the tool or rad of all joints together.
    """

    kind: Literal["move"]
    goal: AnyGoals
    via: AnyPlaces | None = None
    blend: Positive | None = None

    @property
    def in_stated_turns(self) -> Self:
        goal = [_as_stated(place) for place in self.goal] if isinstance(self.goal, list) else _as_stated(self.goal)
        return self.replaced(goal=goal, via=None if self.via is None else [_as_stated(place) for place in self.via])

    def unlike(self, behind: Sequence[StageSection]) -> str | None:
        """Why it cannot be blended with the first of the stages behind it; None where it can."""
        if not behind:
            return "the last stage ends at rest"
        following = behind[0]
        if not isinstance(following, MoveStage):
            return f"the stage behind it is to be kind = 'move', not {following.kind!r}"
        if isinstance(self.goal, list):
            return "a stage with several goals ends at rest"
        keys = [key for key in MovingStage.schema() if getattr(self, key) != getattr(following, key) and key != "kind"]
        return f"{in_words(keys)} would have to be the same in both stages" if keys else None

    def blended(self, following: MoveStage) -> MoveStage:
        """Two moves as one: past the goal of the first to that of the second."""
        assert not isinstance(self.goal, list)  # of several goals none is blended
        corner: Any = self.goal
        corner = replace(corner, within=self.blend)
        return following.replaced(via=[*(self.via or ()), corner, *(following.via or ())])

    @property
    def manner(self) -> dict[str, Any]:
        return {key: value for key, value in self.table().items() if key != "goal"}

    @property
    def vias(self) -> list[Place] | None:
        return self.via

    def goals_from(self, robot: Robot, posture: FloatArray) -> Place | list[Place]:
        return self.goal


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


class LedStage(FreeAxisKeys, MovingStage):
    """A stage whose tool is led along a way; accuracies in m and rad, speeds in m/s.

    The turn about a free axis, and the range that is stated, are against the even rotation from start to end.

    Attributes:
        max_tool_speed: that the tool does not exceed, m/s.
        tool_speed: that the tool keeps, but next to ends and corners, m/s; or a table.
    """

    accuracy: Positive = ACCURACY
    angular_accuracy: Annotated[Positive, ANGULAR] = ANGULAR_ACCURACY
    max_tool_speed: Positive | None = None
    tool_speed: AnyToolSpeed | None = None

    def check(self) -> None:
        super().check()
        if self.turn is not None and not self.turn[0] <= 0.0 <= self.turn[1]:
            raise InvalidTable("does not hold 0, which is how the tool is turned at first", "turn")
        if self.max_tool_speed is not None and self.tool_speed is not None:
            raise InvalidTable("tool_speed says how fast the tool is; leave max_tool_speed out", "max_tool_speed")

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

    def goals_from(self, robot: Robot, posture: FloatArray) -> Place | list[Place]:
        end = self.end(robot, posture)
        free = self.free_axis
        if free is None:
            return end
        if not isinstance(end, Pose):
            raise InvalidProblem("free", "in the plane no axis of the tool is free; leave it out")
        free.check()
        return replace(end, free=self.free, turn=self.turn, tilt=self.tilt)

    def tool_path(self, robot: Robot, posture: FloatArray) -> ToolPath | None:
        (start, turned), end = _tool(robot, posture), self.end(robot, posture)
        way = self.way(robot, start, end.position(robot))
        if turned is None or not isinstance(end, Pose):
            return ToolPath(way)
        assert end.rotation is not None
        free, last = self.free_axis, end.rotation
        if free is not None:
            free.check()
        if free is not None and free.turn is None:  # then the turn at the end does not matter
            last = FreeAxis(free.axis).nearest_of(last, turned[None])[0]
        return ToolPath(way, (turned, last), free)

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
        if self.goal is not None and not isinstance(self.goal, Pose | Position):
            raise InvalidTable("a line ends at a position or pose; joints are reached by kind = 'move'", "goal")
        if isinstance(self.goal, Pose) and self.goal.free is not None:
            raise InvalidTable("free, turn and tilt are of the whole line: state them beside its goal", "goal", "free")

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


class PathStage(LedStage):
    """The tool goes straight from where it is to points, one after the other, turned as it is; corners are rounded."""

    kind: Literal["path"]
    points: PathPoints | str
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


class AttachStage(StageSection):
    """The hand takes up an obstacle by its name, as it lies; or a body with a shape, posed in the tool's frame.

    Attributes:
        touch: names of links, obstacles and what else is carried, whose contact with it is allowed while it is held.
    """

    kind: Literal["attach"]
    name: Name
    mass: Positive | None = None
    touch: Annotated[list[Name], Count(0, MOST_CONTACTS)] = field(default_factory=list)
    body: AnyObstacle | None = field(default=None, repr=False)

    @classmethod
    def from_table(cls, content: Any) -> Self:
        if isinstance(content, Mapping) and "shape" in content:
            own = {key: content[key] for key in ("kind", "name", "mass", "touch") if key in content}
            content = own | {
                BODY: {key: value for key, value in content.items() if key not in ("kind", "mass", "touch")}
            }
        with flat(BODY):
            return super().from_table(content)

    def table(self) -> dict[str, Any]:
        own = {key: value for key, value in super().table().items() if key != BODY}
        return own if self.body is None else own | self.body.table()

    def with_files(self, folder: InputFolder) -> Self:
        return self if self.body is None else self.replaced(body=self.body.with_files(folder))

    def changed(self, cell: C, posture: FloatArray) -> C:
        return cell.attached(self, posture)


class DetachStage(StageSection):
    """The hand leaves what it carries where it is: an obstacle from then on."""

    kind: Literal["detach"]
    name: Name

    def changed(self, cell: C, posture: FloatArray) -> C:
        return cell.detached(self.name, posture)


class WaitStage(StageSection):
    """The arm stands for so many s."""

    kind: Literal["wait"]
    seconds: Annotated[Positive, Range(most=LONGEST_WAIT)]

    @property
    def pause(self) -> float:
        return self.seconds


class OutputStage(StageSection):
    """A signal, such as that of a gripper, that is told to whoever runs the motion."""

    kind: Literal["output"]
    signal: Name
    value: bool | int | float | Word = True


STAGES: dict[str, type[StageSection]] = {
    "move": MoveStage,
    "line": LineStage,
    "path": PathStage,
    "attach": AttachStage,
    "detach": DetachStage,
    "wait": WaitStage,
    "output": OutputStage,
}


def read_stage(table: Any) -> StageSection:
    """The section of one of [[task.stages]], whose kind says which of ``STAGES`` it is."""
    if isinstance(table, StageSection):
        return table
    kind = table.get("kind") if isinstance(table, dict) else None
    if not isinstance(kind, str) or kind not in STAGES:
        options = in_words([f"kind = {name!r}" for name in STAGES])
        raise InvalidTable(f"needs {options}{did_you_mean(kind, STAGES)}")
    return STAGES[kind].from_table(table)


AnyStage = Annotated[StageSection, ReadBy(read_stage)]


def _as_stated(place: Place) -> Place:
    return replace(place, turns="exact") if isinstance(place, Joints) else place


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
