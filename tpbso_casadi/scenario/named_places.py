"""Places by name: postures that a robot's files name, and the places of several arms, until the robot is known."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self, TypeVar

from problems import Joints, Place, Robot
from problems.base import Angle, FloatArray, InvalidTable, at, did_you_mean, shown_value
from problems.tasks import AtTips
from tpbso_casadi.scenario.frames import FramedSection, KnownFrames, PoseInFrame
from tpbso_casadi.scenario.validation import Section

S = TypeVar("S", bound=Section)
F = TypeVar("F", bound=FramedSection)
STAY = "stay"  # in the place of a goal: an arm stands still at its start
FORMS = "[x, y], { joints = [...] } or { position = [...] }"
ARM = "arm"  # the key of a stage that one arm of several does
START, GOAL, VIA = "start", "goal", "via"  # keys of places


@dataclass(frozen=True)
class NamedPosture(Joints):
    """A posture by its name in an SRDF, in whose place the joints stand once the robot's files are read."""

    values: tuple[Angle, ...] = ()
    name: str = field(kw_only=True)

    def table(self) -> Any:
        return self.name


@dataclass(frozen=True)
class PlacesByName(Joints):
    """Places of several arms by their names, in whose place one of the robot stands once its arms are known."""

    values: tuple[Angle, ...] = ()
    parts: tuple[tuple[str, Place], ...] = field(kw_only=True)

    def table(self) -> Any:
        return {name: place.table() for name, place in self.parts}

    @property
    def staying(self) -> frozenset[str]:
        """Names of the arms that are to stand still."""
        return frozenset(n for n, place in self.parts if isinstance(place, NamedPosture) and place.name == STAY)

    def without(self, names: frozenset[str]) -> PlacesByName:
        """The places of the other arms."""
        return replace(self, parts=tuple((name, place) for name, place in self.parts if name not in names))


@dataclass(frozen=True)
class ArmOfRobot:
    """An arm of a robot that has several, by whose name places are stated.

    Attributes:
        joints: numbers of its joints, from 0.
        postures: values of these, rad or m, by their names.
    """

    joints: tuple[int, ...]
    postures: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True)
class KnownNames:
    """The names that a robot gives to postures and to its arms.

    Attributes:
        postures: values of all joints by their names, rad or m.
        arms: of a robot that has several, by their names; none of others.
        dof: how many joints there are.
        start: where the robot is before, if that is known; arms that a place does not name stay there.
        known_later: whether that becomes known later, as of a stage of a sequence, and places by name stand until then.
        frames: in which places, and ways of the tool, may be stated.
    """

    postures: Mapping[str, tuple[float, ...]]
    arms: Mapping[str, ArmOfRobot]
    dof: int
    start: Place | None = None
    known_later: bool = False
    frames: KnownFrames = field(default_factory=KnownFrames)

    @classmethod
    def at_posture(cls, robot: Robot, posture: FloatArray) -> Self:
        """The names of a robot's arms, where it is in a posture (dof,)."""
        arms = {name: ArmOfRobot(tuple(own), {}) for name, own in robot.arms.items()}
        return cls({}, arms, robot.dof, Joints(tuple(posture.tolist())))

    def resolved(self, value: Any) -> Any:
        """A value of a table with places in place of named ones.

        Args:
            value: a table, a place, a list of them, or anything else, which is returned as it is.

        Raises:
            InvalidTable: there is no posture, arm or frame of a name, or an arm's place is not stated.
        """
        if isinstance(value, PoseInFrame):
            return self.frames.pose(value)
        if isinstance(value, NamedPosture):
            return Joints(_posture(self.postures, value.name))
        if isinstance(value, PlacesByName):
            return self._joined(value)
        if isinstance(value, list):
            places, later = [], replace(self, known_later=True)
            for index, place in enumerate(value):
                with at(index):
                    places.append((later if isinstance(place, Section) else self).resolved(place))
            return places
        return self._with_places(value) if isinstance(value, Section) else value

    def of_arm(self, name: str | None) -> KnownNames:
        """The names of one arm of several; all where None.

        Raises:
            InvalidTable: no arm has this name.
        """
        if name is None:
            return self
        if name not in self.arms:
            raise self._unknown(name, ARM)
        return KnownNames(self.arms[name].postures, {}, len(self.arms[name].joints), frames=self.frames)

    def _unknown(self, name: str, *where: str) -> InvalidTable:
        if not self.arms:
            return InvalidTable("there is one arm alone, which has no name; leave it out", *where)
        known = ", ".join(self.arms)
        return InvalidTable(f"no arm is called {name!r}{did_you_mean(name, self.arms)}; there are {known}", *where)

    def _with_places(self, table: S) -> S:
        names, found = self.of_arm(getattr(table, ARM, None)), {}
        for key, before in table.values().items():
            with at(key):
                found[key] = names.resolved(before)
            if key == START and isinstance(found[key], Place):
                names = replace(self, start=found[key])
        changed = table.replaced(**{key: after for key, after in found.items() if after != getattr(table, key)})
        return self._in_world(changed) if isinstance(changed, FramedSection) else changed

    def _in_world(self, table: F) -> F:
        """A table of a way of the tool in the world, unless an arm's name says that its frame moves."""
        if table.may_move and self.arms and (table.frame in self.arms or not self.frames.standing):
            table.check_moving()
            return table
        return self.frames.in_world(table, *(self.arms if table.may_move else ()))

    def _joined(self, stated: PlacesByName) -> Place:
        """The place of the robot at which each arm is at its own."""
        parts = dict(stated.parts)
        for name in parts:
            if not self.arms:
                raise InvalidTable(f"{FORMS} is needed, not {shown_value(stated.table())}")
            if name not in self.arms:
                raise self._unknown(name)
        if self.known_later:
            moved = {name: place for name, place in parts.items() if name not in stated.staying}
            return replace(stated, parts=tuple((name, self._part(name, place)) for name, place in moved.items()))
        places = {name: self._part(name, parts.get(name)) for name in self.arms}
        values = self._before() or {}
        for name, place in places.items():
            arm = self.arms[name]
            if isinstance(place, Joints):
                values |= zip(arm.joints, place.values, strict=True)
        if all(isinstance(place, Joints) for place in places.values()):
            loose = sorted(set(range(self.dof)) - values.keys())
            if loose:
                raise InvalidTable(f"joint {loose[0] + 1} moves several arms: state the joints of all, or lock it")
            return Joints(tuple(values[joint] for joint in range(self.dof)), cost=stated.cost)
        return AtTips(tuple(places), tuple(places.values())) if len(places) > 1 else next(iter(places.values()))

    def _part(self, name: str, place: Place | None) -> Place:
        """The place of an arm: its own, or where it is before."""
        with at(name):
            if isinstance(place, NamedPosture) and place.name != STAY:
                return Joints(_posture(self.arms[name].postures, place.name))
            if place is not None and not isinstance(place, NamedPosture):
                place = self.frames.pose(place) if isinstance(place, PoseInFrame) else place
                if place.within or place.cost:
                    raise InvalidTable("within and cost are of all arms together: leave them out")
                count = len(self.arms[name].joints)
                if isinstance(place, Joints) and len(place.values) != count:
                    raise InvalidTable(f"{len(place.values)} joints for an arm of {count}")
                return place
            before = self._before()
            if before is None:
                raise InvalidTable(
                    "missing: say where this arm is" if place is None else "its start is not stated by joints"
                )
            return Joints(tuple(before[joint] for joint in self.arms[name].joints))

    def _before(self) -> dict[int, float] | None:
        """The joints before, by their numbers, where they are known."""
        return dict(enumerate(self.start.values)) if isinstance(self.start, Joints) else None


def _posture(known: Mapping[str, tuple[float, ...]], name: str) -> tuple[float, ...]:
    if name not in known:
        sources = "an srdf, a moveit_config or an MJCF names postures"
        listed = ", ".join(known)
        raise InvalidTable(f"no posture {name!r}{f'; there are {listed}' if known else f': {sources}'}")
    return known[name]


@dataclass(frozen=True)
class StandingArms:
    """Arms that are to stand still in a task, and where.

    Attributes:
        postures: of their own joints, rad or m, by their names.
        task: the same task of the other arms.
    """

    postures: Mapping[str, tuple[float, ...]]
    task: Section

    @classmethod
    def of(cls, task: Section, names: KnownNames) -> StandingArms | None:
        """The arms that every goal of a task lets stand still; None where there are none.

        Raises:
            InvalidTable: the joints of such an arm at the start are not stated, or goals differ in which arms stand.
        """
        goals = list(_listed(getattr(task, GOAL, None)))
        staying = [goal.staying for goal in goals if isinstance(goal, PlacesByName)]
        if not any(staying):
            return None
        if len(set(staying)) > 1 or len(staying) < len(goals):
            raise InvalidTable("all goals have to let the same arms stay", GOAL)
        if staying[0] - names.arms.keys():
            with at(GOAL):
                names.resolved(goals[0])  # which refuses such a name
        postures = {}
        with at(START):
            for name in sorted(staying[0]):
                postures[name] = _own_joints(getattr(task, START), name, names)
        return cls(postures, task.replaced(**dict(_left(task, staying[0], names))))


def _own_joints(start: Place, name: str, names: KnownNames) -> tuple[float, ...]:
    arm = names.arms[name]
    if isinstance(start, PlacesByName):
        place = dict(start.parts).get(name)
        if isinstance(place, NamedPosture):
            return _posture(arm.postures, place.name)
        if type(place) is Joints:
            return place.values
    whole = names.resolved(start) if isinstance(start, NamedPosture) else start
    if type(whole) is Joints and len(whole.values) == names.dof:
        return tuple(whole.values[joint] for joint in arm.joints)
    raise InvalidTable(f"{name} is to stay: state its joints")


def _left(task: Section, gone: frozenset[str], names: KnownNames) -> Iterator[tuple[str, Any]]:
    """The places of a task without those of some arms, by the keys."""
    kept = [joint for name, arm in names.arms.items() if name not in gone for joint in arm.joints]

    def other(place: Place) -> Place:
        if isinstance(place, PlacesByName):
            return place.without(gone)
        whole = names.resolved(place)
        if type(whole) is Joints and len(whole.values) == names.dof:
            return replace(whole, values=tuple(whole.values[joint] for joint in sorted(kept)))
        return place

    def changed(value: Any) -> Any:
        return [*map(other, value)] if isinstance(value, Sequence) else other(value)

    for key in (START, GOAL, VIA):
        if getattr(task, key, None):
            yield key, changed(getattr(task, key))


def _listed(value: Any) -> Iterator[Any]:
    yield from value if isinstance(value, list) else [value]
