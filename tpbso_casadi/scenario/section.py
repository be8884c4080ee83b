"""What every table of a scenario file has in common: kinds of values, and how large they may be.

What is within these limits is built in less than a minute and computed without overflow.
"""

from __future__ import annotations

from math import radians
from typing import Annotated, Any, Literal, Self, TypeAlias, TypeVar

from pydantic import AfterValidator, Field, ValidationError

from tpbso_casadi.plugins import failure
from tpbso_casadi.scenario.validation import NestedError, StrictModel, as_text, describe

S = TypeVar("S", bound=StrictModel)

LARGEST = 1e12  # magnitude of a number, in whatever unit
SMALLEST = 1e-12  # of a positive number
MOST_LINKS = 100
MOST_SAMPLES = 10_000  # of a segment
MOST_PIECES = 100  # of a path from one place to the next
MOST_POINTS = 1_000  # that a path is planned through
MOST_GIVEN_POINTS = 100_000  # that it is resampled from
MOST_OBSTACLES = 100
MOST_EXPRESSIONS = 100  # constraints, or objectives, of a user's own
MOST_JOINT_SAMPLES = 50_000  # joints times samples
MOST_JOINT_POINTS = 5_000  # joints times points of a path, or times redundancy values
MOST_POINT_CHECKS = 20_000  # points of a path times obstacles
MOST_MEMBERS = 10_000  # of a population
MOST_ITERATIONS = 10_000_000
MOST_EVALUATIONS = 1_000_000_000
MOST_POLISH_STARTS = 64
LARGEST_SEED = 2**63 - 1  # what a database can store
LONGEST_WORD = 200  # characters of a name


def _not_tiny(value: float) -> float:
    if value < SMALLEST:
        raise ValueError(f"{value:g} is below the smallest positive number, {SMALLEST:g}")
    return value


Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(gt=0, le=LARGEST), AfterValidator(_not_tiny)]
NotNegative = Annotated[float, Field(ge=0, le=LARGEST)]
PlanarPoint: TypeAlias = tuple[Number, Number]
SpacePoint: TypeAlias = tuple[Number, Number, Number]
Quaternion: TypeAlias = tuple[Number, Number, Number, Number]  # x, y, z, w
Interval: TypeAlias = tuple[Number, Number]
Word = Annotated[str, Field(max_length=LONGEST_WORD)]


ANGULAR = "angular"  # marks a field whose numbers are angles, or rates of angles: ``Annotated[Number, ANGULAR]``
Angle = Annotated[Number, ANGULAR]


class ScenarioError(ValueError):
    """A scenario that cannot be planned; the message is one line: file, key, reason."""


class Section(StrictModel):
    """A table of a scenario file."""

    def in_radians(self) -> Self:
        """The same table, read as one in degrees: what is stated of its ``ANGULAR`` fields, and of tables within."""
        stated = {name: getattr(self, name) for name in self.model_fields_set if name in type(self).model_fields}
        return self.model_copy(
            update={
                name: in_radians(value, angular=ANGULAR in type(self).model_fields[name].metadata)
                for name, value in stated.items()
            }
        )


class FileSection(Section):
    """A whole file, which may state its angles in degrees."""

    unit: Literal["rad", "deg"] = "rad"

    def normalised(self) -> Self:
        """The same file in rad: whoever reads one calls this first, so that nothing else knows of degrees."""
        return self.in_radians().model_copy(update={"unit": "rad"}) if self.unit == "deg" else self


def in_radians(value: Any, angular: bool) -> Any:
    """A value of a table in degrees: tables in it are converted, and its numbers where they are angles."""
    if isinstance(value, Section):
        return value.in_radians()
    if isinstance(value, (list, tuple)):
        return type(value)(in_radians(entry, angular) for entry in value)
    return radians(value) if angular and isinstance(value, (int, float)) else value


def read_section(section: type[S], table: Any, key: str, name: str) -> S:
    """The table of a section whose class a key of the table chose, of a plug-in maybe.

    Args:
        section: the class.
        table: plain data.
        key: that chose it.
        name: what the key says.

    Raises:
        NestedError: the table is not one, or the plug-in failed.
    """
    try:
        return section.model_validate_json(as_text(table), strict=True)
    except ValidationError as error:
        raise NestedError(describe(error, section, table)) from error
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise NestedError(f"{key}: plug-in {name} failed: {failure(error)}") from error


def read_table(section: type[S], name: str, content: dict[str, Any]) -> S:
    """The table of a name from plain data, checked as one of a file.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    try:
        return section.model_validate_json(as_text(content), strict=True)
    except ValidationError as error:
        raise ScenarioError(f"{name}.{describe(error, section, content)}") from error
