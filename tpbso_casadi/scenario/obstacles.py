"""Obstacles as tables: every shape by the fields of its class, and how it moves."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields, replace
from functools import cached_property
from inspect import isabstract
from typing import Annotated, Any, Protocol, Self, TypeGuard, TypeVar

import numpy as np

from problems import OBSTACLES, ConstantVelocity, InvalidProblem, MovingObstacle, Obstacle, Tabulated
from problems.base import (
    InvalidTable,
    Key,
    ReadBy,
    check_keys,
    keys_of_fields,
    not_among,
    plain_value,
    shown_value,
)
from problems.robots import Point3
from problems.scene import SOLIDS, ObstacleMotion, Solid
from tpbso_casadi.scenario.bodies import MeshSection, PointsSection
from tpbso_casadi.scenario.catalogues import Catalogue, PluginError
from tpbso_casadi.scenario.input_files import InputFolder, motion_through
from tpbso_casadi.scenario.obstacle_section import ObstacleSection
from tpbso_casadi.scenario.plugin_failures import plug_in_failures
from tpbso_casadi.scenario.validation import (
    Arguments,
    Quaternion,
    ScenarioError,
    Word,
    path_of,
    plain,
)

DEFAULT_SHAPE = "ellipse"
MOST_ROWS = 600  # of all tables of motion together
MOST_JOINT_CORNERS = 10_000  # joints times corners, those of all convex parts of a polygon


class ShapeSection(ObstacleSection):
    """A table of [[obstacles]] whose keys are the fields of the obstacle's class.

    Attributes:
        of_class: the class.
        arguments: with which the obstacle is made, as far as they are stated.
    """

    of_class: type[Obstacle]
    arguments: Arguments

    @classmethod
    def read(cls, kind: type[Obstacle], table: Mapping[str, Any]) -> Self:
        """The section of a table.

        Args:
            kind: of the obstacle.
            table: its keys, flat.

        Raises:
            InvalidTable: naming the first wrong key.
        """
        own = keys_of_shape(kind)
        check_keys(table, ObstacleSection.schema() | {"shape": Key(Word, "", MISSING)} | own)
        beside = {key: value for key, value in table.items() if key not in own}
        return cls(**beside, of_class=kind, arguments=Arguments.read(kind, own, table))

    @classmethod
    def of(cls, obstacle: Obstacle) -> Self:
        """The section that states an obstacle.

        Raises:
            ScenarioError: none does.
        """
        if isinstance(obstacle, MovingObstacle):
            moving: dict[str, Any] = _motion_keys(obstacle.motion)
            moving |= {"margin_rate": obstacle.margin_rate} if obstacle.margin_rate else {}
            return cls.of(_still_at_start(obstacle)).replaced(**moving)
        kind = type(obstacle)
        if not states_a_shape(kind):
            raise ScenarioError(f"obstacles: {kind.__name__} is not {SHAPE_CATALOGUE.requirement}")
        arguments = Arguments.of(obstacle, keys_of_shape(kind))
        made = cls(shape=name_of(kind), name=obstacle.name, of_class=kind, arguments=arguments)
        vars(made)["still"] = obstacle
        return made

    @property
    def corners(self) -> int:
        return self.build().complexity

    @cached_property
    def still(self) -> Obstacle:
        """The obstacle itself, standing still.

        Raises:
            InvalidProblem: it cannot be.
        """
        return self.of_class(**self.arguments.values, name=self.name)

    def build(self) -> Obstacle:
        return self.still

    def table(self) -> dict[str, Any]:
        beside = {key: value for key, value in super().table().items() if key not in ("of_class", "arguments")}
        return {**beside, **plain_value(self.arguments.values)}

    def in_radians(self) -> Self:
        return super().in_radians().replaced(arguments=self.arguments.in_radians(self.of_class))

    @property
    def pose(self) -> tuple[Sequence[float], Sequence[float] | None]:
        still = self.build()
        return (still.center, still.quaternion) if isinstance(still, Solid) else super().pose

    def posed(self, center: Point3, quaternion: Quaternion | None) -> Self:
        pose = {"center": center, "quaternion": quaternion, "normal": None}  # which a quaternion replaces
        values = self.arguments.values | {key: value for key, value in pose.items() if key in self.arguments.values}
        return self.replaced(arguments=replace(self.arguments, values=values))


def keys_of_shape(kind: type[Obstacle]) -> dict[str, Key]:
    """The keys of a table that are fields of an obstacle's class."""
    return {key: each for key, each in keys_of_fields(kind).items() if key not in (*kind.not_stated, *TAKEN)}


def states_a_shape(candidate: object) -> TypeGuard[type[ObstacleSection | Obstacle]]:
    """Whether a class is a shape whose fields can be the keys of a table, or reads one itself."""
    if not isinstance(candidate, type) or issubclass(candidate, ObstacleSection):
        return isinstance(candidate, type)
    if not issubclass(candidate, Obstacle) or issubclass(candidate, MovingObstacle) or isabstract(candidate):
        return False
    parameters: Any = vars(candidate).get("__dataclass_params__")
    if parameters is None or not parameters.frozen:
        return False
    names = [field.name for field in fields(candidate) if field.init and field.name != "name"]
    return not any(name.startswith("_") or name in TAKEN for name in names)


TAKEN = frozenset(ObstacleSection.schema())  # keys that every shape has
IN_FILES: dict[str, type[ObstacleSection]] = {"mesh": MeshSection, "points": PointsSection}
SHAPES: ChainMap[str, type[ObstacleSection | Obstacle]] = ChainMap(IN_FILES, SOLIDS, OBSTACLES)  # type: ignore[arg-type]
SHAPE_CATALOGUE: Catalogue[type[ObstacleSection | Obstacle]] = Catalogue(
    kind="shape",
    group="tpbso_casadi.obstacles",
    registry=SHAPES,
    accepts=states_a_shape,
    requirement="a complete frozen dataclass derived from problems.Obstacle, with fields that no table has otherwise, "
    "nor a subclass of tpbso_casadi.scenario.obstacles.ObstacleSection",
)


def _kind_for(name: str, table: Mapping[str, Any]) -> type[Obstacle | ObstacleSection]:
    """The class of the obstacle, or of the section, that a table of a shape states."""
    if name in OBSTACLES and name in SOLIDS:
        return _of_either(OBSTACLES[name], SOLIDS[name], table)
    return SHAPE_CATALOGUE.find(name)


def _of_either(plane: type[Obstacle], space: type[Obstacle], table: Mapping[str, Any]) -> type[Obstacle]:
    """The solid of two shapes of one name where something has three coordinates, or a key that only solids have."""
    own, others = keys_of_shape(space).keys(), keys_of_shape(plane).keys()
    given = [table[key] for key in own & others if key in table]
    spatial = any(isinstance(value, list | tuple) and len(value) == 3 for value in given)
    return space if spatial or not (own - others).isdisjoint(table) else plane


def name_of(kind: type[Obstacle]) -> str:
    """The word for a shape in a scenario: its name, or the path of a class of a plug-in."""
    names = {known: name for registry in SHAPES.maps for name, known in registry.items()}
    return names.get(kind) or path_of(kind)


def _still_at_start(obstacle: MovingObstacle) -> Obstacle:
    """The obstacle where it begins to move, in the world's frame, as tables state it.

    Raises:
        ScenarioError: its shape moves itself, or is placed neither by a centre nor by points.
    """
    still, origin = obstacle.still, np.array(getattr(obstacle.motion, "origin", ()))
    if still.moves:
        raise ScenarioError("obstacles: no table states what moves in a frame that moves; say one motion")
    if not origin.any():
        return still
    place = next((each.name for each in fields(still) if each.name in ("center", "points")), None)
    if place is None:
        name = type(still).__name__
        raise ScenarioError(f"obstacles: no table states where a {name} begins to move; place it there, without origin")
    rows = (np.array(getattr(still, place)) + origin).tolist()
    moved: dict[str, Any] = {place: tuple(map(tuple, rows)) if place == "points" else tuple(rows)}
    return replace(still, **moved)


def _motion_keys(motion: ObstacleMotion) -> dict[str, Any]:
    """The keys of a table that say how an obstacle moves."""
    state = MOTION_KEYS.get(type(motion))
    if state is None:
        raise ScenarioError(f"obstacles: no table states the motion {type(motion).__name__}")
    return state(motion)


def _rows_of(motion: Tabulated) -> dict[str, Any]:
    """The rows t, position[, turn] of a motion that runs through them on one cubic spline."""
    length = motion.breaks[-1] - motion.breaks[-2]
    columns = [[*(piece[-1] for piece in pieces), np.polyval(pieces[-1], length)] for pieces in motion.pieces]
    rows = [list(map(float, row)) for row in zip(motion.breaks, *columns, strict=True)]
    again = motion_through(rows, motion.dim)
    if not np.allclose(again.pieces, motion.pieces, rtol=1e-9, atol=1e-9):
        raise ScenarioError("obstacles: a motion along lines cannot be stored; say Tabulated.through(times, positions)")
    return {"motion_rows": rows}


MOTION_KEYS: dict[type[ObstacleMotion], Callable[[Any], dict[str, Any]]] = {
    ConstantVelocity: lambda motion: {"velocity": plain(motion.velocity)},
    Tabulated: _rows_of,
}


def build_obstacles(tables: list[ObstacleSection], joints: int) -> tuple[Obstacle, ...]:
    """The obstacles themselves, for a robot with so many joints.

    Raises:
        ScenarioError: naming the one that cannot be, or the most corners, or rows of motion, for which a model is built
            in reasonable time.
    """
    obstacles: list[Obstacle] = []
    corners, most, rows = 0, MOST_JOINT_CORNERS // joints, 0
    for number, table in enumerate(tables):
        try:
            obstacles += table.built(number + 1)
            corners += table.corners
            if corners > most:
                raise InvalidProblem("shape", f"more than {most} corners of obstacles for {joints} joints")
            rows += table.rows
            if rows > MOST_ROWS:
                raise InvalidProblem("motion", f"more than {MOST_ROWS} rows in all tables of motion together")
        except InvalidProblem as error:
            raise ScenarioError(f"obstacles.{number}.{error.field}: {error.reason}") from error
    return tuple(obstacles)


class NamesFiles(Protocol):
    """A table that may name files."""

    def with_files(self, folder: InputFolder) -> Self:
        """The table with the content of the files that it names."""


N = TypeVar("N", bound=NamesFiles)


def with_files(tables: Sequence[N], folder: InputFolder, key: str) -> list[N]:
    """The tables of a list with the content of the files that they name.

    Args:
        tables: of a list.
        folder: of the files.
        key: of the list.

    Raises:
        ScenarioError: naming the table, the file and what is wrong with it.
    """
    found = []
    for number, table in enumerate(tables):
        try:
            found.append(table.with_files(folder))
        except ScenarioError as error:
            raise ScenarioError(f"{key}.{number}.{error}") from error
        except InvalidProblem as error:
            raise ScenarioError(f"{key}.{number}.{error.field}: {error.reason}") from error
    return found


def read_obstacle(table: Any) -> ObstacleSection:
    """The section of one of the [[obstacles]], whose shape says which of ``SHAPES`` it is; or of an obstacle."""
    if isinstance(table, ObstacleSection):
        return table
    if isinstance(table, Obstacle):
        return ShapeSection.of(table)
    if not isinstance(table, Mapping):
        raise ValueError(f"a table is needed, not {shown_value(table)}")
    name = table.get("shape", DEFAULT_SHAPE)
    if not isinstance(name, str) or not (name in SHAPES or ":" in name or name in SHAPE_CATALOGUE.names()):
        raise InvalidTable(not_among(name, SHAPES).reason, "shape")
    try:
        kind = _kind_for(name, table)
    except PluginError as error:
        raise InvalidTable(str(error), "shape") from error
    with plug_in_failures("shape", name):
        if issubclass(kind, ObstacleSection):
            return kind.from_table(table)
        return ShapeSection.read(kind, {"shape": name, **table})


AnyObstacle = Annotated[ObstacleSection, ReadBy(read_obstacle)]
