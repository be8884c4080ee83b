"""Places and poses as tables."""

from __future__ import annotations

from typing import Annotated, Any

from problems import InvalidProblem, Joints, Place, Position
from problems.base import Count, InvalidTable, Range, ReadBy, at, reader, shown_value
from problems.limits import AxisName, FreeAxis
from problems.tasks import AtTips, Pose, SeenFrom, Turns
from tpbso_casadi.scenario.frames import FRAME, IN_SPACE, PoseInFrame
from tpbso_casadi.scenario.named_places import FORMS, NamedPosture, PlacesByName
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    MOST_EVALUATIONS,
    MOST_LINKS,
    Interval,
    NotNegative,
    Number,
    PlanarPoint,
    Positive,
    Quaternion,
    Section,
    SpacePoint,
    Word,
)

MOST_PLACES = 100  # goals, or vias


class JointsTable(Section):
    """A posture: one angle a joint, rad."""

    joints: Annotated[list[Number], Count(1, MOST_LINKS)]
    within: NotNegative = 0.0
    turns: Turns | None = None
    cost: NotNegative = 0.0

    def built(self) -> Joints:
        """The posture that the table states."""
        return Joints(tuple(self.joints), self.within, self.turns, self.cost)


class PositionTable(Section):
    """The tool at a point in the plane, m."""

    position: PlanarPoint
    within: NotNegative = 0.0
    cost: NotNegative = 0.0

    def built(self) -> Position:
        """The position that the table states."""
        return Position(self.position, self.within, self.cost)


class FreeAxisKeys(Section):
    """Keys of an axis of the tool, about which it may turn, or which may lean; rad."""

    free: AxisName | None = None
    turn: Annotated[Interval | None, ANGULAR] = None
    tilt: Annotated[NotNegative, ANGULAR] = 0.0

    def check(self) -> None:
        super().check()
        try:
            self.free_axis  # noqa: B018  # which refuses what is no axis
        except InvalidProblem as error:
            raise InvalidTable(error.reason, error.field) from error

    @property
    def free_axis(self) -> FreeAxis | None:
        """The axis that the keys state; None where nothing is free."""
        return FreeAxis.stated(self.free, self.turn, self.tilt)


class PoseTable(FreeAxisKeys):
    """The tool at a point in space, m, and, if it matters, turned by a quaternion (x, y, z, w); maybe in a frame."""

    frame: Word | None = None
    position: SpacePoint
    quaternion: Quaternion | None = None
    within: NotNegative = 0.0
    cost: NotNegative = 0.0

    def built(self) -> Pose | PoseInFrame:
        """The pose that the table states."""
        pose = Pose(self.position, self.quaternion, (), self.within, self.free, self.turn, self.tilt, self.cost)
        return pose if self.frame is None else PoseInFrame(frame=self.frame, pose=pose)


def read_place(value: Any) -> Place:
    """The place that a point, a name, a table with one key that says what it is, or Python states.

    Raises:
        ValueError: it is neither.
    """
    if isinstance(value, AtTips | SeenFrom | PlacesByName):  # whose table speaks of arms that only a robot has
        return value
    if isinstance(value, Place):
        try:
            value = value.table()
        except InvalidProblem as error:
            raise ValueError(error.reason) from error
    if isinstance(value, str):
        return NamedPosture(name=value)
    kinds = [key for key in ("joints", "position") if isinstance(value, dict) and key in value]
    if isinstance(value, dict) and value and not kinds and all(isinstance(each, PARTS) for each in value.values()):
        return _places_by_name(value)
    if not isinstance(value, list | tuple) and len(kinds) != 1:
        raise ValueError(f"{FORMS} is needed, not {shown_value(value)}")
    if not kinds:
        return Position(_point(value))
    in_plane = JointsTable if kinds == ["joints"] else PositionTable
    if kinds == ["joints"] and FRAME in value:
        raise InvalidTable("joints are the same in every frame; leave it out", FRAME)
    if kinds == ["position"] and not _in_space(value):
        _refuse_in_plane(value)
    return (PoseTable if kinds == ["position"] and _in_space(value) else in_plane).from_table(value).built()


PARTS = (dict, str, Place)  # what may stand for the place of one arm of several


def _places_by_name(table: dict[str, Any]) -> PlacesByName:
    """The places of several arms, by their names."""
    places = []
    for name, stated in table.items():
        with at(name):
            place = read_place(stated)
            if isinstance(place, PlacesByName):
                raise ValueError(f"{{ joints = [...] }} or {{ position = [...] }} is needed, not {shown_value(stated)}")
            places.append((name, place))
    return PlacesByName(parts=tuple(places))


def _in_space(table: dict[str, Any]) -> bool:
    position = table["position"]
    return "quaternion" in table or (isinstance(position, list | tuple) and len(position) > 2)


def _refuse_in_plane(table: dict[str, Any]) -> None:
    """Refuse keys that places in space alone have."""
    if "free" in table:
        raise InvalidTable("in the plane no axis of the tool is free; leave it out", "free")
    if FRAME in table:
        raise InvalidTable(IN_SPACE, FRAME)


def _point(value: Any) -> PlanarPoint:
    if len(value) == 3:
        raise ValueError(f"a point in space is {{ position = [x, y, z] }}, not {shown_value(value)}")
    return reader(PlanarPoint)(value)  # type: ignore[no-any-return]


def read_places(value: Any) -> list[Place]:
    """A list of places.

    Raises:
        ValueError: it is none, or one of them is not a place.
    """
    if not isinstance(value, list) or not value:
        raise ValueError(f"a list of {FORMS} is needed, not {shown_value(value)}")
    if len(value) > MOST_PLACES:
        raise ValueError(f"{len(value)} places; at most {MOST_PLACES} are planned")
    places = []
    for index, place in enumerate(value):
        with at(index):
            places.append(read_place(place))
    return places


def read_goals(value: Any) -> Place | list[Place]:
    """A place, or a list of places of which any will do: a list that begins with a table or a list is one."""
    several = isinstance(value, list) and bool(value) and not isinstance(value[0], int | float | bool)
    return read_places(value) if several else read_place(value)


AnyPlace = Annotated[Place, ReadBy(read_place)]
AnyGoals = Annotated[Place | list[Place], ReadBy(read_goals)]
AnyPlaces = Annotated[list[Place], ReadBy(read_places)]


MOST_TICKS = 100_000
WHOLE = 1e-9  # so much short of a whole number of periods is rounding
Coordinates = Annotated[list[Number], Count(2, 3)]


class SimulationSection(Section):
    """[simulation]; other commands do not read it.

    Attributes:
        seconds: that are simulated.
        every: time between two replans, which is also how long each may take, s.
        goals: places visited one after the other, cyclically; the task's goal and start if left out.
        changes_every: mean time between two changes of the course of an obstacle that has a velocity, s; none if left
            out.
        course_rate: no two velocities of an obstacle differ by more, m/s. The planner counts on it, and on no more.
        region: lower and upper corner of a box, m, which obstacles that have a velocity do not leave: they turn around.
        evaluations: of each replan; if left out, 5000 for each second of ``every``, from 80 to 1500.
        within: its time, s.
    """

    seconds: Positive = 10.0
    every: Positive = 0.1
    goals: AnyPlaces | None = None
    changes_every: Positive | None = None
    course_rate: NotNegative = 0.0
    region: Annotated[list[Coordinates], Count(2, 2)] | None = None
    evaluations: Annotated[int, Range(above=0, most=MOST_EVALUATIONS)] | None = None
    within: Positive | None = None

    def check(self) -> None:
        if self.every > self.seconds:
            raise InvalidTable(f"{self.every:g} s is more than the {self.seconds:g} s that are simulated", "every")
        if self.seconds / self.every > MOST_TICKS:
            raise InvalidTable(f"{self.seconds / self.every:.0f} replans; at most {MOST_TICKS} are simulated", "every")
        if self.changes_every is not None and not self.course_rate:
            raise InvalidTable("missing key; changes_every needs to know how large a change may be", "course_rate")
        if self.region is not None:
            self._check_region(*self.region)

    def _check_region(self, lower: list[float], upper: list[float]) -> None:
        if len(lower) != len(upper):
            raise InvalidTable(f"corners of {len(lower)} and of {len(upper)} coordinates", "region")
        if not all(low < high for low, high in zip(lower, upper, strict=True)):
            raise InvalidTable("the first corner has to be below the second one in every coordinate", "region")

    @property
    def ticks(self) -> int:
        """How often the planner is asked, the last time at most one period before the end."""
        return int(self.seconds / self.every + WHOLE)
