"""Obstacles as tables."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field, PlainValidator, SerializeAsAny, SerializerFunctionWrapHandler, model_serializer

from problems import (
    Ball,
    Box,
    Capsule,
    ConstantVelocity,
    Cylinder,
    Ellipse,
    Ellipsoid,
    HalfSpace,
    InvalidProblem,
    MovingObstacle,
    Obstacle,
    Polygon,
    Rectangle,
)
from problems.scene import MAX_CORNERS, ObstacleMotion
from tpbso_casadi.scenario.catalogues import Catalogue, PluginError, subclass_of
from tpbso_casadi.scenario.input_files import (
    MOST_MOTION_ROWS,
    InputFolder,
    in_radians,
    motion_through,
    read_motion_rows,
)
from tpbso_casadi.scenario.validation import (
    Angle,
    NestedError,
    NotNegative,
    Number,
    PlanarPoint,
    Positive,
    ScenarioError,
    Section,
    Word,
    hint,
    in_words,
    read_section,
    shown,
)

MOST_NUMBERS = 8  # of a row
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


SpatialPoint: TypeAlias = tuple[Number, Number, Number]
Quaternion: TypeAlias = tuple[float, float, float, float]


class SolidSection(ObstacleSection):
    """What all solids have in common: a place, m, and a quaternion (x, y, z, w)."""

    center: SpatialPoint
    quaternion: tuple[Number, Number, Number, Number] | None = None


class SpatialBoxSection(SolidSection):
    """A box in space, m."""

    shape: Literal["box"]
    size: tuple[Positive, Positive, Positive]

    def build(self) -> Box:
        """The obstacle itself."""
        return Box(center=self.center, quaternion=self.quaternion, size=self.size)


class SphereSection(ObstacleSection):
    """A sphere, m."""

    shape: Literal["sphere"]
    center: SpatialPoint
    radius: Positive

    def build(self) -> Ball:
        """The obstacle itself."""
        return Ball(center=self.center, radius=self.radius)


class CapsuleSection(SolidSection):
    """A capsule around a line along its z axis, m."""

    shape: Literal["capsule"]
    radius: Positive
    length: Positive

    def build(self) -> Capsule:
        """The obstacle itself."""
        return Capsule(center=self.center, quaternion=self.quaternion, radius=self.radius, length=self.length)


class CylinderSection(SolidSection):
    """A cylinder along its z axis, m."""

    shape: Literal["cylinder"]
    radius: Positive
    length: Positive

    def build(self) -> Cylinder:
        """The obstacle itself."""
        return Cylinder(center=self.center, quaternion=self.quaternion, radius=self.radius, length=self.length)


class EllipsoidSection(SolidSection):
    """An ellipsoid, m."""

    shape: Literal["ellipsoid"]
    semi_axes: tuple[Positive, Positive, Positive]

    def build(self) -> Ellipsoid:
        """The obstacle itself."""
        return Ellipsoid(center=self.center, quaternion=self.quaternion, semi_axes=self.semi_axes)


class HalfSpaceSection(SolidSection):
    """All that is below a plane through its centre, across its normal; up where neither normal nor quaternion is."""

    shape: Literal["half-space"]
    normal: SpatialPoint | None = None

    def build(self) -> HalfSpace:
        """The obstacle itself."""
        if self.normal is None:
            return HalfSpace(center=self.center, quaternion=self.quaternion)
        if self.quaternion is not None:
            raise InvalidProblem("normal", "the quaternion says already how the half-space is turned")
        return HalfSpace(center=self.center, quaternion=_turned_up_to(self.normal))


def _turned_up_to(normal: SpatialPoint) -> Quaternion | None:
    """The shortest turn from the z axis to a normal of any length; None where there is nothing to turn."""
    length = float(np.linalg.norm(normal))
    if not length > 0.0:
        raise InvalidProblem("normal", "a vector of no length has no direction")
    x, y, z = (part / length for part in normal)
    if x == y == 0.0:
        return None if z > 0.0 else (1.0, 0.0, 0.0, 0.0)
    w = float(np.sqrt((1.0 + z) / 2.0)) if z > 0.0 else float(np.hypot(x, y) / np.sqrt(2.0 * (1.0 - z)))
    return -y / (2.0 * w), x / (2.0 * w), 0.0, w


DEFAULT_SHAPE = "ellipse"
MOST_ROWS = 600  # of all tables of motion together
MOST_JOINT_CORNERS = 10_000  # joints times corners, those of all convex parts of a polygon


class EllipseSection(ObstacleSection):
    """An ellipse, m and rad."""

    shape: Literal["ellipse"] = "ellipse"
    center: PlanarPoint
    semi_axes: tuple[Positive, Positive]
    angle: Angle = 0.0

    def build(self) -> Ellipse:
        """The obstacle itself."""
        return Ellipse(self.center, self.semi_axes, self.angle)


class BoxSection(ObstacleSection):
    """A rectangle, m and rad."""

    shape: Literal["box"]
    center: PlanarPoint
    size: tuple[Positive, Positive]
    angle: Angle = 0.0

    @classmethod
    def variant(cls, table: Mapping[str, Any]) -> type[ObstacleSection]:
        """A box in space where three coordinates are given of its centre or size, or a quaternion."""
        lengths = [len(given) for given in (table.get("center"), table.get("size")) if isinstance(given, (list, tuple))]
        return SpatialBoxSection if 3 in lengths or "quaternion" in table else cls

    @property
    def corners(self) -> int:
        """Four."""
        return 4

    def build(self) -> Rectangle:
        """The obstacle itself."""
        return Rectangle(self.center, self.size, self.angle)


class PolygonSection(ObstacleSection):
    """A polygon by its corners in order, convex or not, m."""

    shape: Literal["polygon"]
    points: Annotated[list[PlanarPoint], Field(min_length=3, max_length=MAX_CORNERS)]

    @property
    def corners(self) -> int:
        """Those of its convex parts."""
        return sum(map(len, self.build().parts))

    def build(self) -> Polygon:
        """The obstacle itself."""
        return Polygon(tuple(self.points))


SHAPES: dict[str, type[ObstacleSection]] = {
    "ellipse": EllipseSection,
    "box": BoxSection,
    "polygon": PolygonSection,
    "sphere": SphereSection,
    "capsule": CapsuleSection,
    "cylinder": CylinderSection,
    "half-space": HalfSpaceSection,
    "ellipsoid": EllipsoidSection,
}

SHAPE_CATALOGUE: Catalogue[type[ObstacleSection]] = Catalogue(
    kind="shape",
    group="tpbso_casadi.obstacles",
    registry=SHAPES,
    accepts=subclass_of(ObstacleSection),
    requirement="a subclass of tpbso_casadi.scenario.obstacles.ObstacleSection",
)


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
        section = SHAPE_CATALOGUE.find(name)
    except PluginError as error:
        raise NestedError(f"shape: {error}") from error
    return read_section(section.variant(table), table, "shape", name)


AnyObstacle = Annotated[SerializeAsAny[ObstacleSection], PlainValidator(read_obstacle)]
