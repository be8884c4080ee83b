"""[[carried]]: bodies that the tool holds, with the shapes of obstacles; and which contacts are allowed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import lru_cache
from typing import Annotated, Any, Self, TypeAlias

import numpy as np

from problems import Ball, Box, Capsule, Cylinder, Ellipsoid, InvalidProblem, Obstacle, Polytope, Robot
from problems.base import CACHE_SIZE, Count, FloatArray, did_you_mean, flat
from problems.geometry import ball_corners
from problems.robots import (
    BoxShape,
    CapsuleShape,
    Carried,
    CylinderShape,
    FixedFrame,
    HullShape,
    Shape,
    SphereShape,
    as_point,
)
from problems.scene import Solid
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.obstacles import AnyObstacle
from tpbso_casadi.scenario.validation import Positive, ScenarioError, Section, Word

MOST_CARRIED = 20
MOST_CONTACTS = 1_000
Contacts: TypeAlias = Annotated[list[tuple[Word, Word]], Count(0, MOST_CONTACTS)]  # pairs of names
DEFAULT_NAME = "carried"
OWN = ("mass", "arm")  # keys that an obstacle has not
BODY = "body"


class CarriedSection(Section):
    """A table of [[carried]]: the keys of an obstacle, in the tool's frame, and its mass in kg, spread evenly.

    ``arm`` names the arm whose tool holds it, of a robot with several; the first where it is left out.
    """

    mass: Positive | None = None
    arm: Word | None = None
    body: AnyObstacle = field(repr=False)

    @classmethod
    def from_table(cls, content: Any) -> Self:
        if isinstance(content, Obstacle):
            content = {BODY: content}
        elif isinstance(content, Mapping):
            own = {key: content[key] for key in OWN if key in content}
            content = own | {BODY: {key: value for key, value in content.items() if key not in OWN}}
        with flat(BODY):
            return super().from_table(content)

    def check(self) -> None:
        self.body.check_of_tool()

    def table(self) -> dict[str, Any]:
        own = {key: getattr(self, key) for key in OWN}
        return self.body.table() | {key: value for key, value in own.items() if value is not None}

    @property
    def name(self) -> str:
        """The name of the body, or the usual one."""
        return self.body.name or DEFAULT_NAME

    def with_files(self, folder: InputFolder) -> Self:
        """The table with the content of the file that it names.

        Raises:
            ScenarioError: it cannot be read.
        """
        return self.replaced(body=self.body.with_files(folder))

    def build(self) -> Carried:
        """The body that the table states.

        Raises:
            InvalidProblem: it cannot be carried.
        """
        if self.body.moves:
            raise InvalidProblem("velocity", "what is carried moves with the tool")
        if self.body.margin_rate:
            raise InvalidProblem("margin_rate", "what is carried is where the tool is")
        shapes = tuple(_shape(part) for part in self.body.parts())
        return Carried(self.name, shapes, self.mass, self.arm or "")


def _shape(part: Obstacle) -> Shape:
    """A solid as a part of a link."""
    if not isinstance(part, Solid):
        raise InvalidProblem("shape", f"{type(part).__name__} is in the plane, or of somebody's own")
    one, two, three = map(as_point, part.axes)
    pose = FixedFrame((one, two, three), as_point(part.center))
    match part:
        case Box():
            return BoxShape(pose, sizes=part.size)
        case Ball():
            return SphereShape(pose, radius=part.radius)
        case Cylinder():
            return CylinderShape(pose, radius=part.radius, length=part.length)
        case Capsule():
            return CapsuleShape(pose, radius=part.radius, length=part.length)
        case Polytope():
            return HullShape(pose, points=part.points)
        case Ellipsoid():
            return HullShape(pose, points=_points(ball_corners() * np.array(part.semi_axes)))
    raise InvalidProblem("shape", f"{type(part).__name__} cannot be carried")


def _points(places: FloatArray) -> tuple[tuple[float, float, float], ...]:
    return tuple(as_point(place) for place in places)


def carried_bodies(tables: Sequence[CarriedSection]) -> tuple[Carried, ...]:
    """The bodies that tables of [[carried]] state.

    Raises:
        ScenarioError: one cannot be carried, or two have the same name.
    """
    bodies: list[Carried] = []
    for number, table in enumerate(tables):
        try:
            bodies.append(table.build())
        except InvalidProblem as error:
            raise ScenarioError(f"carried.{number}.{error.field}: {error.reason}") from error
        if bodies[-1].name in [body.name for body in bodies[:-1]]:
            raise ScenarioError(f"carried.{number}.name: {bodies[-1].name!r} is there twice; state names")
    return tuple(bodies)


def own_contacts(pairs: Sequence[tuple[str, str]], obstacles: Sequence[Obstacle]) -> list[tuple[str, str]]:
    """Pairs of names that may touch in which no obstacle is named: of links of the robot."""
    names = {obstacle.unmoved.name for obstacle in obstacles}
    return [pair for pair in pairs if names.isdisjoint(pair)]


def with_contacts(robot: Robot, pairs: Sequence[tuple[str, str]], obstacles: Sequence[Obstacle]) -> Robot:
    """The robot, of whose bodies some may touch some obstacles.

    Raises:
        ScenarioError: a pair names nothing, two obstacles, or what is both an obstacle and a body.
    """
    names = {obstacle.unmoved.name for obstacle in obstacles} - {""}
    found = []
    for number, pair in enumerate(pairs):
        for name in pair:
            if name not in names and name not in robot.bodies.names:
                known = [*robot.bodies.names, *sorted(names)]
                raise ScenarioError(
                    f"may_touch.{number}: nothing is called {name!r}{did_you_mean(name, known)}; "
                    f"there are {', '.join(known)}"
                )
            if name in names and name in robot.bodies.names:
                raise ScenarioError(f"may_touch.{number}: an obstacle and a body are called {name!r}: rename one")
        one, two = pair
        if one == two:
            raise ScenarioError(f"may_touch.{number}: {one!r} twice; a pair is of two")
        if one in names and two in names:
            raise ScenarioError(f"may_touch.{number}: both are obstacles, which nobody keeps apart")
        if one in names or two in names:
            found.append((two, one) if one in names else (one, two))
    return _touching(robot, tuple(found))


@lru_cache(maxsize=CACHE_SIZE)
def _touching(robot: Robot, pairs: tuple[tuple[str, str], ...]) -> Robot:
    """The robot some of whose bodies may touch something, the same object for the same."""
    return replace(robot, may_touch=pairs)
