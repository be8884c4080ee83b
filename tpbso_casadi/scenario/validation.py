"""Tables checked key by key: what is wrong is said in one line that names file, key and reason.

What is within these limits is built in less than a minute and computed without overflow.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, is_dataclass, replace
from math import radians
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeAlias, TypeVar, get_args

import numpy as np

from problems.base import (
    Checked,
    Count,
    InvalidTable,
    Key,
    Quantity,
    Range,
    Table,
    at,
    keys_of_fields,
    not_among,
    read_arguments,
)


def choice_of(known: Collection[str], find: Callable[[str], object] | None = None) -> Checked:
    """A check of text that must be one of the names in a registry, as it is when a file is read.

    Args:
        known: the names.
        find: looks up what a plug-in offers, by ``package.module:Attribute`` or by a name; raises ValueError.
    """

    def check(name: str) -> str:
        if name in known or (find is not None and _is_found(name, find)):
            return name
        raise not_among(name, known)

    return Checked(check)


def _is_found(name: str, find: Callable[[str], object]) -> bool:
    """Whether a plug-in offers a name; what is wrong with a path ``package.module:Attribute`` is raised."""
    try:
        find(name)
    except ValueError:
        if ":" in name:
            raise
        return False
    return True


def plain(value: Any) -> Any:
    """A value as plain data: lists for arrays and tuples, text for paths and classes."""
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {plain(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, type):
        return path_of(value)
    return str(value) if isinstance(value, Path) else value


def path_of(kind: type) -> str:
    """``package.module:Class``, as a scenario names classes of anyone.

    Raises:
        ScenarioError: it is defined in a function, where nobody finds it by its name.
    """
    if "<locals>" in kind.__qualname__:
        raise ScenarioError(f"{kind.__name__}: a plan names its classes; define it in a module or a notebook's cell")
    return f"{kind.__module__}:{kind.__qualname__}"


S = TypeVar("S", bound=Table)

LARGEST = 1e12  # magnitude of a number, in whatever unit
SMALLEST = 1e-12  # of a positive number
MOST_LINKS = 100
MOST_SAMPLES = 10_000  # of a segment
MOST_PIECES = 100  # of a path from one place to the next
MOST_POINTS = 1_000  # that a path is planned through
MOST_GIVEN_POINTS = 100_000  # that it is resampled from
MOST_OBSTACLES = 1_000
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


Number: TypeAlias = Annotated[float, Range(least=-LARGEST, most=LARGEST)]
Positive: TypeAlias = Annotated[float, Range(above=0.0, most=LARGEST), Checked(_not_tiny)]
NotNegative: TypeAlias = Annotated[float, Range(least=0.0, most=LARGEST)]
PlanarPoint: TypeAlias = tuple[Number, Number]
SpacePoint: TypeAlias = tuple[Number, Number, Number]
Quaternion: TypeAlias = tuple[Number, Number, Number, Number]  # x, y, z, w
Interval: TypeAlias = tuple[Number, Number]
Word: TypeAlias = Annotated[str, Count(0, LONGEST_WORD)]
Name: TypeAlias = Annotated[str, Count(1, LONGEST_WORD)]


ANGULAR = "angular"  # marks a field whose numbers are angles, or rates of angles: ``Annotated[Number, ANGULAR]``
Angle = Annotated[Number, ANGULAR]


class ScenarioError(ValueError):
    """A scenario that cannot be planned; the message is one line: file, key, reason."""


@contextmanager
def as_scenario_errors(*keys: str) -> Iterator[None]:
    """Let errors of tables be errors of a scenario.

    Args:
        keys: with which their messages begin.

    Raises:
        ScenarioError: one.
    """
    try:
        with at(*keys):
            yield
    except InvalidTable as error:
        raise ScenarioError(str(error)) from error


@contextmanager
def named(what: object) -> Iterator[None]:
    """Let errors of a scenario begin with its name.

    Raises:
        ScenarioError: one.
    """
    try:
        yield
    except ScenarioError as error:
        raise type(error)(f"{what}: {error}") from error


class Section(Table):
    """A table of a scenario file."""

    def in_radians(self) -> Self:
        """The table read as one in degrees: stated values of angular keys, and tables within, are converted."""
        keys = self.schema()
        return self.replaced(
            **{
                name: in_radians(getattr(self, name), angular=_is_angular(keys[name].hint))
                for name in self.stated_keys & keys.keys()
            }
        )


def _is_angular(hint: Any) -> bool:
    """Whether the numbers of a key are angles, wherever in its type that is said."""
    marks = getattr(hint, "__metadata__", ())
    in_rad = any(isinstance(mark, Quantity) and mark.unit.startswith("rad") for mark in marks)
    return ANGULAR in marks or in_rad or any(map(_is_angular, get_args(hint)))


@dataclass(frozen=True)
class Arguments:
    """The arguments with which an object of a dataclass is made, where a table states them.

    Attributes:
        values: by their names, the usual ones where the table leaves them out.
        stated: names of those that it does not leave out.
    """

    values: dict[str, Any]
    stated: frozenset[str] = field(compare=False)

    @classmethod
    def read(cls, kind: type[Any], known: Mapping[str, Key], content: Mapping[str, Any]) -> Self:
        """The arguments that plain data state, whose keys are known to be right.

        Raises:
            InvalidTable: a value is of another type than its field.
        """
        stated = read_arguments(kind, {name: value for name, value in content.items() if name in known})
        return cls({name: key.usual for name, key in known.items()} | stated, frozenset(stated))

    @classmethod
    def of(cls, thing: Any, known: Mapping[str, Key]) -> Self:
        """The arguments that state an object."""
        stated = {each.name: getattr(thing, each.name) for each in fields(thing) if each.init}
        return cls({name: stated.get(name) for name in known}, frozenset(stated))

    def in_radians(self, kind: type[Any]) -> Self:
        """The arguments, read as those of a table in degrees."""
        keys = keys_of_fields(kind)
        changed = {name: in_radians(self.values[name], _is_angular(keys[name].hint)) for name in self.stated}
        return replace(self, values=self.values | changed)


def stated_values(thing: Any) -> dict[str, Any]:
    """The keys of the table that states an object of a dataclass, those without a value left out; plain data."""
    values = {each.name: getattr(thing, each.name) for each in fields(thing) if each.init}
    return {key: plain(value) for key, value in values.items() if value is not None}


def in_tuples(value: Any) -> Any:
    """A value of a table as a field of a frozen dataclass holds it."""
    return tuple(map(in_tuples, value)) if isinstance(value, (list, tuple)) else value


class FileSection(Section):
    """A whole file, which may state its angles in degrees."""

    unit: Literal["rad", "deg"] = "rad"

    def normalised(self) -> Self:
        """The file in rad, whatever its unit; readers call this first, so that nothing else knows of degrees."""
        return self.in_radians().replaced(unit="rad") if self.unit == "deg" else self


def in_radians(value: Any, angular: bool) -> Any:
    """A value of a table in degrees: tables in it are converted, and its numbers where they are angles."""
    if isinstance(value, Section):
        return value.in_radians()
    if is_dataclass(value) and not isinstance(value, type):
        hints = {name: key.hint for name, key in keys_of_fields(type(value)).items()}
        return replace(
            value, **{name: in_radians(getattr(value, name), _is_angular(hint)) for name, hint in hints.items()}
        )
    if isinstance(value, (list, tuple)):
        return type(value)(in_radians(entry, angular) for entry in value)
    return radians(value) if angular and isinstance(value, (int, float)) else value


def read_table(section: type[S], name: str, content: dict[str, Any]) -> S:
    """The table of a name from plain data, checked as one of a file.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    with as_scenario_errors(name):
        return section.from_table(content)
