"""Robots of a cell as tables: each with its base, planned together as one arm."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Self

from problems import InvalidProblem, Joints, Obstacle, Robot
from problems.base import CACHE_SIZE, InvalidTable, at, shown_value
from problems.robots import BETWEEN, Carried, SpatialArm, cell_of, own_name
from problems.scene import standing
from tpbso_casadi.scenario.frames import KnownFrames
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.named_places import ArmOfRobot, KnownNames
from tpbso_casadi.scenario.spatial_robots import MOST_JOINTS, SpatialRobotSection, Statement
from tpbso_casadi.scenario.validation import ANGULAR, Number, ScenarioError, Section, Word

MOST_ROBOTS = 8


class MemberSection(SpatialRobotSection):
    """[robots.NAME]: the keys of [robot], and joints at which it stands still, rad or m, so that others move alone."""

    stays_at: Annotated[list[Number] | None, ANGULAR] = None

    def check(self) -> None:
        super().check()
        if self.tips:
            raise InvalidTable("a robot of a cell has one tool", "tips")

    @property
    def alone(self) -> SpatialRobotSection:
        """The robot by itself."""
        return SpatialRobotSection(**{key: getattr(self, key) for key in self.stated_keys - {"stays_at"}})


class CellSection(Section):
    """[robots]: robots by their names, whose joints and links are called ``NAME/JOINT`` and ``NAME/LINK``."""

    prefix: ClassVar[str] = "robots."
    avoids_itself: ClassVar[bool] = SpatialRobotSection.avoids_itself
    usual_samples: ClassVar[int] = SpatialRobotSection.usual_samples
    usual_descents: ClassVar[int] = SpatialRobotSection.usual_descents
    usual_solver: ClassVar[str] = SpatialRobotSection.usual_solver

    robots: dict[Word, MemberSection]
    lead: Word | None = None  # the robot whose tool a stage moves; no table states it

    @classmethod
    def from_table(cls, content: Any) -> Self:
        if isinstance(content, cls):
            return content
        if not isinstance(content, Mapping):
            raise InvalidTable(f"a table of robots by their names is needed, not {shown_value(content)}")
        robots = {}
        for name, table in content.items():
            with at(name):
                if BETWEEN in name or not name:
                    raise InvalidTable(f"a name without {BETWEEN!r} is needed")
                robots[name] = MemberSection.from_table(table)
        if not 1 <= len(robots) <= MOST_ROBOTS:
            raise InvalidTable(f"{len(robots)} robots; 1 to {MOST_ROBOTS} are planned together")
        return cls(robots=robots)

    def table(self) -> dict[str, Any]:
        return {name: robot.table() for name, robot in self.robots.items()}

    @property
    def title(self) -> str:
        """Names of the robots, and their models or files."""
        return " and ".join(f"{name}: {robot.title}" for name, robot in self.robots.items())

    @property
    def plugins(self) -> list[str]:
        """None: no robot of a cell names a class."""
        return []

    @property
    def moving(self) -> dict[str, MemberSection]:
        """The robots that do not stand still."""
        return {name: robot for name, robot in self.robots.items() if robot.stays_at is None}

    @property
    def still(self) -> dict[str, tuple[MemberSection, list[float]]]:
        """The robots that stand still, and their joints, rad or m."""
        return {name: (robot, robot.stays_at) for name, robot in self.robots.items() if robot.stays_at is not None}

    def names(self) -> KnownNames:
        """The names that the robots that move give to their postures, and their own.

        Raises:
            InvalidProblem: one is none.
        """
        arms, first = {}, 0
        for name, robot in self.moving.items():
            with _within(name):
                described = robot.alone.description()
            joints = tuple(range(first, first := first + len(described.chain.joints)))
            arms[name] = ArmOfRobot(joints, described.postures)
        return KnownNames({}, arms, first)

    def for_stage(self, arm: str | None, keys: Mapping[str, Any]) -> Self:
        """The cell of a stage that states some keys anew, and whose tool is that of a robot, if one is named.

        Raises:
            InvalidProblem: a payload is stated and no robot; or a list has not a value for each joint.
        """
        if "payload" in keys and arm is None:
            raise InvalidProblem("payload", "of which robot? name it by arm")
        names, robots = self.names(), dict(self.robots)
        for name, own in names.arms.items():
            mine = {}
            for key, value in keys.items():
                if isinstance(value, list) and len(value) != names.dof:
                    raise InvalidProblem(key, f"{len(value)} values for {names.dof} joints")
                mine[key] = [value[joint] for joint in own.joints] if isinstance(value, list) else value
            if name != arm:
                mine.pop("payload", None)
            robots[name] = robots[name].replaced(**mine) if mine else robots[name]
        return self.replaced(robots=robots, lead=arm)

    def based_in(self, frames: KnownFrames) -> Self:
        """The cell whose robots' bases are stated in the world.

        Raises:
            InvalidTable: there is no frame of the name that a base states.
        """
        found = {}
        for name, robot in self.robots.items():
            with at(name):
                found[name] = robot.based_in(frames)
        return self if found == self.robots else self.replaced(robots=found)

    def standing(self, postures: Mapping[str, Sequence[float]]) -> Self:
        """The cell in which some robots stand still at joints, rad or m."""
        still = {name: self.robots[name].replaced(stays_at=list(values)) for name, values in postures.items()}
        return self.replaced(robots=self.robots | still)

    def in_radians(self) -> Self:
        return self.replaced(robots={name: robot.in_radians() for name, robot in self.robots.items()})

    def with_files(self, folder: InputFolder) -> Self:
        """The cell with the texts of the files that its robots name.

        Raises:
            ScenarioError: a file cannot be read.
        """
        found = {}
        for name, robot in self.robots.items():
            with _within(name):
                found[name] = robot.with_files(folder)
        return self.replaced(robots=found)

    def check_standing(self, obstacles: Sequence[Obstacle], keep: Callable[[Robot], Robot], cell: Robot) -> None:
        """Check that robots that stand still are clear of obstacles, within their ranges and held by their motors.

        Args:
            obstacles: around them.
            keep: gives a robot its margins.
            cell: all robots, which may touch what it says.

        Raises:
            InvalidProblem: one is not.
        """
        for name, (robot, joints) in self.still.items():
            with _within(name):
                own = f"{name}{BETWEEN}"
                pairs = [(own_name(body, name), what) for body, what in cell.may_touch if body.startswith(own)]
                alone = replace(keep(robot.alone.build()), may_touch=tuple(pairs))
                posture = Joints(tuple(joints))
                posture.check(alone, standing(tuple(obstacles)), "stays_at")
                posture.check_holding(alone, "free", "stays_at")

    def build(self, carried: Sequence[Carried] = (), disabled: Sequence[tuple[str, str]] = ()) -> SpatialArm:
        """The robots as one arm, the same object for the same statement.

        Args:
            carried: bodies on the tools of robots, which they name.
            disabled: names of links that may touch.

        Raises:
            InvalidProblem: it cannot be; with a key of this table.
        """
        text = json.dumps([self.lead, self.table()])
        return _built(Statement(text, self), tuple(carried), tuple(map(tuple, disabled)))

    def _made(self, carried: Sequence[Carried], disabled: Sequence[tuple[str, str]]) -> SpatialArm:
        holders = {part.name: part.tip or next(iter(self.moving)) for part in carried}
        for number, part in enumerate(carried):
            if holders[part.name] not in self.robots:
                reason = f"no arm is called {part.tip!r}; there are {', '.join(self.robots)}"
                raise InvalidProblem(f"carried.{number}.arm", reason)

        def robot_of(link: str) -> str:
            return holders.get(link, link.partition(BETWEEN)[0])

        arms = {}
        for name, robot in self.robots.items():
            bodies = [replace(part, tip="") for part in carried if holders[part.name] == name]
            own = [
                (own_name(one, name), own_name(two, name))
                for one, two in disabled
                if robot_of(one) == name == robot_of(two)
            ]
            with _within(name):
                arms[name] = robot.alone.build(bodies, own)
        still = {name: joints for name, (_, joints) in self.still.items()}
        arm = cell_of(arms, still, [(one, two) for one, two in disabled if robot_of(one) != robot_of(two)])
        if arm.dof > MOST_JOINTS:
            raise InvalidProblem(next(iter(arms)), f"{arm.dof} joints of all robots; at most {MOST_JOINTS} are planned")
        arm = replace(arm, statement=self)
        return arm if self.lead is None else arm.with_tool_at(self.lead)


@contextmanager
def _within(name: str) -> Iterator[None]:
    """Errors of a robot's table name the robot."""
    try:
        yield
    except InvalidProblem as error:
        raise InvalidProblem(f"{name}.{error.field}", error.reason) from error
    except ScenarioError as error:
        own = str(error).removeprefix(SpatialRobotSection.prefix)
        raise ScenarioError(f"{CellSection.prefix}{name}{'.' if own != str(error) else ': '}{own}") from error


@lru_cache(maxsize=CACHE_SIZE)
def _built(statement: Statement, carried: tuple[Carried, ...], disabled: tuple[tuple[str, str], ...]) -> SpatialArm:
    table: CellSection = statement.table
    return table._made(carried, disabled)
