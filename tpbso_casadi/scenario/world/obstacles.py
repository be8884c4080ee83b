"""The [[obstacles]] tables of a scenario file, by their shape."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, SerializeAsAny

from problems import Ellipse, InvalidProblem, Obstacle, Polygon, Rectangle
from problems.scene.polygon import MAX_CORNERS
from tpbso_casadi.plugins import Catalogue, PluginError, subclass_of
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import Angle, PlanarPoint, Positive, ScenarioError, read_section
from tpbso_casadi.scenario.validation import NestedError, hint, in_words, shown
from tpbso_casadi.scenario.world.shape import ObstacleSection
from tpbso_casadi.scenario.world.solids import (
    CapsuleSection,
    CylinderSection,
    EllipsoidSection,
    HalfSpaceSection,
    SpatialBoxSection,
    SphereSection,
)

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
    requirement="a subclass of tpbso_casadi.scenario.world.shape.ObstacleSection",
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
