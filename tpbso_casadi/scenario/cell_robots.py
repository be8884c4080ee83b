"""Robots of a cell as tables: each with its base, planned together as one arm."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Self

from problems import InvalidProblem
from problems.base import CACHE_SIZE, InvalidTable, at, shown_value
from problems.robots import BETWEEN, Carried, SpatialArm, cell_of
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

    def build(
        self, carried: Sequence[tuple[str, Carried]] = (), disabled: Sequence[tuple[str, str]] = ()
    ) -> SpatialArm:
        """The robots as one arm, the same object for the same statement.

        Args:
            carried: bodies on the tools of robots, behind the robots' names.
            disabled: names of links that may touch.

        Raises:
            InvalidProblem: it cannot be; with a key of this table.
        """
        return _built(Statement(json.dumps(self.table()), self), tuple(carried), tuple(map(tuple, disabled)))

    def _made(self, carried: Sequence[tuple[str, Carried]], disabled: Sequence[tuple[str, str]]) -> SpatialArm:
        arms = {}
        for name, robot in self.robots.items():
            bodies = [part for holder, part in carried if holder == name]
            own = [
                (one.partition(BETWEEN)[2], two.partition(BETWEEN)[2])
                for one, two in disabled
                if _of(one) == name == _of(two)
            ]
            with _within(name):
                arms[name] = robot.alone.build(bodies, own)
        still = {name: robot.stays_at for name, robot in self.robots.items() if robot.stays_at is not None}
        arm = cell_of(arms, still, [(one, two) for one, two in disabled if _of(one) != _of(two)])
        if arm.dof > MOST_JOINTS:
            raise InvalidProblem(next(iter(arms)), f"{arm.dof} joints of all robots; at most {MOST_JOINTS} are planned")
        return replace(arm, statement=self)


def _of(link: str) -> str:
    """The name of the robot that has a link."""
    return link.partition(BETWEEN)[0]


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
def _built(
    statement: Statement, carried: tuple[tuple[str, Carried], ...], disabled: tuple[tuple[str, str], ...]
) -> SpatialArm:
    table: CellSection = statement.table
    return table._made(carried, disabled)
