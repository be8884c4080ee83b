"""Places of a [task] table: a point [x, y], { joints = [...] }, { position = [...] } or a pose in space."""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import (
    Field,
    PlainValidator,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    ValidationError,
    model_serializer,
)

from problems.tasks.place import Joints, Place, Position
from problems.tasks.pose import Pose
from tpbso_casadi.scenario.section import (
    ANGULAR,
    MOST_LINKS,
    Number,
    PlanarPoint,
    Quaternion,
    Section,
    SpacePoint,
)
from tpbso_casadi.scenario.validation import NestedError, as_text, describe, shown

MOST_PLACES = 100  # goals, or vias
FORMS = "[x, y], { joints = [...] } or { position = [...] }"
POINT: TypeAdapter[PlanarPoint] = TypeAdapter(PlanarPoint)


class JointsTable(Section):
    """A posture: one angle a joint, rad."""

    joints: Annotated[list[Number], ANGULAR, Field(min_length=1, max_length=MOST_LINKS)]

    def build(self) -> Place:
        """The place itself."""
        return Joints(tuple(self.joints))


class PositionTable(Section):
    """The tool at a point in the plane, m."""

    position: PlanarPoint

    def build(self) -> Place:
        """The place itself."""
        return Position(self.position)


class PoseTable(Section):
    """The tool at a point in space, m, and, if it matters, turned by a quaternion (x, y, z, w)."""

    position: SpacePoint
    quaternion: Quaternion | None = None

    @model_serializer(mode="wrap")
    def _as_stated(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content: dict[str, Any] = serialize(self)
        return content if self.quaternion is not None else {"position": content["position"]}

    def build(self) -> Place:
        """The place itself."""
        return Pose(self.position, self.quaternion)


PlaceTable: TypeAlias = JointsTable | PositionTable | PoseTable
PLACE_TABLES: dict[str, type[PlaceTable]] = {"joints": JointsTable, "position": PositionTable}
PlaceValue: TypeAlias = PlanarPoint | PlaceTable


def read_place(value: Any) -> PlaceValue:
    """A point, or a table with the one key that says what it is.

    Raises:
        ValueError: it is neither.
    """
    if isinstance(value, (JointsTable, PositionTable, PoseTable)):
        return value
    kinds = [kind for key, kind in PLACE_TABLES.items() if isinstance(value, dict) and key in value]
    if kinds == [PositionTable] and _in_space(value):
        kinds = [PoseTable]
    if not isinstance(value, (list, tuple)) and len(kinds) != 1:
        raise ValueError(f"{FORMS} is needed, not {shown(value)}")
    try:
        return kinds[0].model_validate_json(as_text(value), strict=True) if kinds else _point(value)
    except ValidationError as error:
        reason = describe(error, kinds[0] if kinds else Section, value)
        raise (NestedError if error.errors()[0]["loc"] else ValueError)(reason) from error


def _in_space(table: dict[str, Any]) -> bool:
    position = table["position"]
    return "quaternion" in table or (isinstance(position, (list, tuple)) and len(position) > 2)


def _point(value: Any) -> PlanarPoint:
    if len(value) == 3:
        raise ValueError(f"a point in space is {{ position = [x, y, z] }}, not {shown(value)}")
    return POINT.validate_json(as_text(value), strict=True)


def read_places(value: Any) -> list[PlaceValue]:
    """A list of places.

    Raises:
        ValueError: it is none, or one of them is not a place.
    """
    if not isinstance(value, list) or not value:
        raise ValueError(f"a list of {FORMS} is needed, not {shown(value)}")
    if len(value) > MOST_PLACES:
        raise ValueError(f"{len(value)} places; at most {MOST_PLACES} are planned")
    places = []
    for index, place in enumerate(value):
        try:
            places.append(read_place(place))
        except NestedError as error:
            raise NestedError(f"{index}.{error}") from error
        except ValueError as error:
            raise NestedError(f"{index}: {error}") from error
    return places


def read_goals(value: Any) -> PlaceValue | list[PlaceValue]:
    """A place, or a list of places of which any will do: a list that begins with a table or a list is one."""
    several = isinstance(value, list) and bool(value) and not isinstance(value[0], (int, float, str, bool))
    return read_places(value) if several else read_place(value)


def built(value: PlaceValue) -> Place:
    """The place that a value of a table stands for."""
    return Position(value) if isinstance(value, tuple) else value.build()


# a PlaceValue, one or a list of them, a list of them; Any is how a tuple or a table is written back as it was
AnyPlace = Annotated[Any, PlainValidator(read_place)]
AnyGoals = Annotated[Any, PlainValidator(read_goals)]
AnyPlaces = Annotated[Any, PlainValidator(read_places)]
