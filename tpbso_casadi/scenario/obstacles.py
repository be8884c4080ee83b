"""Obstacles as tables: every shape by the fields of its class, and how it moves."""

from __future__ import annotations

from collections import ChainMap
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from inspect import isabstract
from typing import Annotated, Any, ClassVar, Literal, Self, TypeGuard

import numpy as np
from pydantic import (
    Field,
    PlainValidator,
    SerializeAsAny,
    SerializerFunctionWrapHandler,
    create_model,
    model_serializer,
)

from problems import OBSTACLES, ConstantVelocity, InvalidProblem, MovingObstacle, Obstacle, Tabulated
from problems.scene import SOLIDS, ObstacleMotion
from tpbso_casadi.scenario.catalogues import Catalogue, PluginError, failure
from tpbso_casadi.scenario.input_files import (
    MOST_MOTION_ROWS,
    InputFolder,
    in_radians,
    motion_through,
    read_motion_rows,
)
from tpbso_casadi.scenario.validation import (
    NestedError,
    NotNegative,
    Number,
    ScenarioError,
    Section,
    Word,
    hint,
    in_tuples,
    in_words,
    keys_of,
    path_of,
    plain,
    read_section,
    shown,
    stated_values,
)

DEFAULT_SHAPE = "ellipse"
MOST_NUMBERS = 8  # of a row
MOST_ROWS = 600  # of all tables of motion together
MOST_JOINT_CORNERS = 10_000  # joints times corners, those of all convex parts of a polygon
MotionRow = Annotated[list[Number], Field(max_length=MOST_NUMBERS)]


class ObstacleSection(Section):
    """One of the [[obstacles]]: the interface of every shape, and how the obstacle moves.

    ``velocity`` is in m/s. ``motion`` names a file with the header ``t,x,y[,angle]`` or ``t,x,y,z[,qx,qy,qz,qw]``: s, m
    and the unit of the file's angles; where the frame is over time in which the rest of the table is stated. Once it is
    read its rows stand in ``motion_rows``, so that a result is complete without the file.
    """

    of_motion: ClassVar[tuple[str, ...]] = ("velocity", "motion", "motion_rows", "margin_rate")

    shape: Word
    velocity: Annotated[list[Number], Field(min_length=2, max_length=3)] | None = None
    motion: Word | None = None
    motion_rows: Annotated[list[MotionRow], Field(max_length=MOST_MOTION_ROWS)] | None = None
    margin_rate: NotNegative = 0.0

    @model_serializer(mode="wrap")
    def _as_stated(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Nothing of a motion where there is none."""
        content: dict[str, Any] = serialize(self)
        return {
            key: value
            for key, value in content.items()
            if key not in self.of_motion or not (value is None or value == 0.0)
        }

    @classmethod
    def variant(cls, table: Mapping[str, Any]) -> type[ObstacleSection]:
        """The class that reads a table of this shape: itself, unless the same word means two shapes."""
        return cls

    @property
    def corners(self) -> int:
        """How much the shape adds to a model, in corners of a polygon."""
        return 1

    @property
    def rows(self) -> int:
        """Those of its table of motion."""
        return len(self.motion_rows or ())

    def build(self) -> Obstacle:
        """The obstacle itself, standing still.

        Raises:
            InvalidProblem: it cannot be.
        """
        raise NotImplementedError

    @property
    def moves(self) -> bool:
        """Whether anything is said of a motion."""
        return self.velocity is not None or self.motion is not None or self.motion_rows is not None

    def with_files(self, folder: InputFolder) -> Self:
        """The same obstacle with the rows of the file that it names.

        Raises:
            InvalidProblem: it cannot be.
            ScenarioError: the file cannot be read, may not be, or does not say how an obstacle moves.
        """
        if self.motion is None or self.motion_rows is not None:
            return self
        try:
            rows = read_motion_rows(folder, self.motion, self.build().dim)
        except ScenarioError as error:
            raise ScenarioError(f"motion: {error}") from error
        return self.model_copy(update={"motion_rows": rows})

    def in_radians(self) -> Self:
        """The same, read as a table in degrees; so is the angle of a table of motion."""
        converted = super().in_radians()
        if self.motion_rows is None or not self._is_planar:
            return converted
        return converted.model_copy(update={"motion_rows": in_radians(self.motion_rows)})

    @property
    def _is_planar(self) -> bool:
        try:
            return self.build().dim == 2
        except InvalidProblem:  # said when it is built
            return False

    def built(self) -> Obstacle:
        """The obstacle, with its motion where it has one.

        Raises:
            InvalidProblem: it cannot be, or it is said to move in two ways.
        """
        still = self.build()
        if not self.moves:
            if self.margin_rate:
                raise InvalidProblem("margin_rate", "the obstacle stands still; state a velocity, or a motion")
            return still
        return MovingObstacle(still, self._motion(still.dim), self.margin_rate)

    def _motion(self, dim: int) -> ObstacleMotion:
        if self.velocity is not None:
            if self.motion is not None or self.motion_rows is not None:
                raise InvalidProblem(
                    "velocity", "the motion says already how the obstacle moves; leave one of them out"
                )
            if len(self.velocity) != dim:
                reason = f"{len(self.velocity)} numbers of an obstacle in {dim} dimensions"
                raise InvalidProblem("velocity", reason)
            return ConstantVelocity(tuple(self.velocity))
        if self.motion_rows is None:
            raise InvalidProblem("motion", f"{self.motion!r} has not been read; only a scenario file can name a CSV")
        return motion_through(self.motion_rows, dim)


class ShapeSection(ObstacleSection):
    """A shape whose keys are the fields of its class."""

    of: ClassVar[type[Obstacle]]

    @classmethod
    def fields(cls) -> list[str]:
        """The keys that are fields of its class."""
        return [key for key in cls.model_fields if key not in ObstacleSection.model_fields]

    @property
    def corners(self) -> int:
        """What the obstacle says."""
        return self.build().complexity

    def build(self) -> Obstacle:
        """The obstacle itself."""
        return self.of(**{key: in_tuples(getattr(self, key)) for key in self.fields()})

    def __reduce__(self) -> Any:
        return _unfilled, (self.of, self.shape), self.__getstate__()


def states_a_shape(candidate: object) -> TypeGuard[type[ObstacleSection | Obstacle]]:
    """Whether a class is a shape whose fields can be the keys of a table, or reads one itself."""
    if not isinstance(candidate, type) or issubclass(candidate, ObstacleSection):
        return isinstance(candidate, type)
    if not issubclass(candidate, Obstacle) or issubclass(candidate, MovingObstacle) or isabstract(candidate):
        return False
    if not is_dataclass(candidate) or not candidate.__dataclass_params__.frozen:
        return False
    names = [field.name for field in fields(candidate) if field.init]
    return not any(name.startswith("_") or hasattr(ShapeSection, name) or name in TAKEN for name in names)


TAKEN = frozenset(ShapeSection.model_fields)  # keys that every shape has
SHAPES: ChainMap[str, type[Obstacle]] = ChainMap(SOLIDS, OBSTACLES)
SHAPE_CATALOGUE: Catalogue[type[ObstacleSection | Obstacle]] = Catalogue(
    kind="shape",
    group="tpbso_casadi.obstacles",
    registry=SHAPES,
    accepts=states_a_shape,
    requirement="a complete frozen dataclass derived from problems.Obstacle, with fields that no table has otherwise, "
    "nor a subclass of tpbso_casadi.scenario.obstacles.ObstacleSection",
)


@cache
def section_of(kind: type[Obstacle], name: str) -> type[ShapeSection]:
    """The section of a shape.

    Args:
        kind: its class, a dataclass.
        name: of the shape in a scenario.
    """
    keys: dict[str, Any] = {key: value for key, value in keys_of(kind).items() if key not in kind.not_stated}
    keys["shape"] = Literal[name], name if name == DEFAULT_SHAPE else ...
    section = create_model(f"{kind.__name__}Section", __base__=ShapeSection, **keys)
    section.of = kind
    return section


def _unfilled(kind: type[Obstacle], name: str) -> ShapeSection:
    """A section whose state is set next, where it is unpickled."""
    section = section_of(kind, name)
    return section.__new__(section)


def _section_for(name: str, table: Mapping[str, Any]) -> type[ObstacleSection]:
    """The section that reads a table of a shape."""
    kind = SHAPE_CATALOGUE.find(name)
    if issubclass(kind, ObstacleSection):
        return kind.variant(table)
    if name in OBSTACLES and name in SOLIDS:
        return _of_either(section_of(OBSTACLES[name], name), section_of(SOLIDS[name], name), table)
    return section_of(kind, name)


def _of_either(plane: type[ShapeSection], space: type[ShapeSection], table: Mapping[str, Any]) -> type[ShapeSection]:
    """Of two shapes of one name that in space where something has three coordinates, or a key is there of it alone."""
    own, others = set(space.fields()), set(plane.fields())
    given = [table[key] for key in own & others if key in table]
    spatial = any(isinstance(value, (list, tuple)) and len(value) == 3 for value in given)
    return space if spatial or not (own - others).isdisjoint(table) else plane


def name_of(kind: type[Obstacle]) -> str:
    """What a scenario calls a shape: its name, or the path of a class that is none of ours."""
    names = {known: name for registry in SHAPES.maps for name, known in registry.items()}
    return names.get(kind) or path_of(kind)


def obstacle_table(obstacle: Obstacle) -> dict[str, Any]:
    """The table that states an obstacle.

    Raises:
        ScenarioError: none does.
    """
    if isinstance(obstacle, MovingObstacle):
        table = obstacle_table(obstacle.still) | _motion_keys(obstacle.motion)
        return table | ({"margin_rate": obstacle.margin_rate} if obstacle.margin_rate else {})
    if not states_a_shape(type(obstacle)):
        raise ScenarioError(f"obstacles: {type(obstacle).__name__} is not {SHAPE_CATALOGUE.requirement}")
    return {"shape": name_of(type(obstacle)), **stated_values(obstacle)}


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
            obstacles.append(table.built())
            corners += table.corners
            if corners > most:
                raise InvalidProblem("shape", f"more than {most} corners of obstacles for {joints} joints")
            rows += table.rows
            if rows > MOST_ROWS:
                raise InvalidProblem("motion", f"more than {MOST_ROWS} rows in all tables of motion together")
        except InvalidProblem as error:
            raise ScenarioError(f"obstacles.{number}.{error.field}: {error.reason}") from error
    return tuple(obstacles)


def with_motions(tables: list[ObstacleSection], folder: InputFolder) -> list[ObstacleSection]:
    """The same tables with the rows of the files that they name.

    Raises:
        ScenarioError: naming the table, the file and what is wrong with it.
    """
    found = []
    for number, table in enumerate(tables):
        try:
            found.append(table.with_files(folder))
        except ScenarioError as error:
            raise ScenarioError(f"obstacles.{number}.{error}") from error
        except InvalidProblem as error:
            raise ScenarioError(f"obstacles.{number}.{error.field}: {error.reason}") from error
    return found


def read_obstacle(table: Any) -> ObstacleSection:
    """The section of one of the [[obstacles]], whose shape says which of ``SHAPES`` it is."""
    if isinstance(table, ObstacleSection):
        return table
    if not isinstance(table, dict):
        raise ValueError(f"a table is needed, not {shown(table)}")
    name = table.get("shape", DEFAULT_SHAPE)
    if not isinstance(name, str) or not (name in SHAPES or ":" in name or name in SHAPE_CATALOGUE.names()):
        options = in_words([repr(shape) for shape in SHAPES])
        raise NestedError(f"shape: input should be {options}, not {shown(name)}{hint(name, SHAPES)}")
    try:
        section = _section_for(name, table)
    except PluginError as error:
        raise NestedError(f"shape: {error}") from error
    except Exception as error:  # fields of a plug-in's class that are no keys
        raise NestedError(f"shape: plug-in {name} failed: {failure(error)}") from error
    return read_section(section, table, "shape", name)


AnyObstacle = Annotated[SerializeAsAny[ObstacleSection], PlainValidator(read_obstacle)]
