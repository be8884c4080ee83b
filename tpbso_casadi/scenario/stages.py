"""The stages of a sequence as tables: what moves, what is taken up and put down, what waits and what is told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Annotated, Any, Literal, Self

from problems import InvalidProblem, Joints, Place, Robot
from problems.base import Count, FloatArray, InvalidTable, Range, ReadBy, did_you_mean, flat, in_words
from problems.tasks import AtTips
from tpbso_casadi.scenario.carried import BODY, MOST_CONTACTS
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.led_stages import LineStage, PathStage
from tpbso_casadi.scenario.named_places import KnownNames, PlacesByName
from tpbso_casadi.scenario.obstacles import AnyObstacle
from tpbso_casadi.scenario.places import AnyGoals, AnyPlaces
from tpbso_casadi.scenario.stage_section import C, MovingStage, StageSection
from tpbso_casadi.scenario.validation import Name, Positive, Word

LONGEST_WAIT = 3_600.0  # s


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

    def vias_from(self, robot: Robot, posture: FloatArray) -> list[Place] | None:
        return None if self.via is None else [self._of_all(place, robot, posture) for place in self.via]

    def goals_from(self, robot: Robot, posture: FloatArray) -> Place | list[Place]:
        if isinstance(self.goal, list):
            return [self._of_all(place, robot, posture) for place in self.goal]
        return self._of_all(self.goal, robot, posture)

    def _of_all(self, place: Place, robot: Robot, posture: FloatArray) -> Place:
        """A place of one arm or some as one of all arms, of which the others are as in a posture (dof,)."""
        if isinstance(place, PlacesByName):
            whole: Place = KnownNames.at_posture(robot, posture).resolved(place)
            return whole
        if self.arm is None:
            return place
        own = robot.arms[self.arm]
        if isinstance(place, Joints):
            if len(place.values) != len(own):
                raise InvalidProblem("goal", f"{len(place.values)} joints for an arm of {len(own)}")
            values = posture.copy()
            values[list(own)] = place.values
            return replace(place, values=tuple(values.tolist()))
        if place.within:
            raise InvalidProblem("goal", "within is of all arms together: leave it out")
        others = {name: Joints(tuple(posture[list(joints)].tolist())) for name, joints in robot.arms.items()}
        return AtTips(tuple(others), tuple((others | {self.arm: place}).values()), place.cost)


class AttachStage(StageSection):
    """The hand takes up an obstacle by its name, as it lies; or a body with a shape, posed in the tool's frame.

    Attributes:
        touch: names of links, obstacles and what else is carried, whose contact with it is allowed while it is held.
        arm: whose hand takes it up, of a robot with several.
    """

    kind: Literal["attach"]
    name: Name
    mass: Positive | None = None
    touch: Annotated[list[Name], Count(0, MOST_CONTACTS)] = field(default_factory=list)
    arm: Name | None = None
    body: AnyObstacle | None = field(default=None, repr=False)

    @classmethod
    def from_table(cls, content: Any) -> Self:
        if isinstance(content, Mapping) and "shape" in content:
            own = {key: content[key] for key in ("kind", "name", "mass", "touch", "arm") if key in content}
            content = own | {
                BODY: {key: value for key, value in content.items() if key not in ("kind", "mass", "touch", "arm")}
            }
        with flat(BODY):
            return super().from_table(content)

    def check(self) -> None:
        if self.body is not None:
            self.body.check_of_tool()

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
    if isinstance(place, Joints) and not isinstance(place, PlacesByName):
        return replace(place, turns="exact")
    return place
