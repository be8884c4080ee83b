"""Tables checked key by key: what is wrong is said in one line that names file, key and reason.

What is within these limits is built in less than a minute and computed without overflow.
"""

from __future__ import annotations

import inspect
import json
import re
import signal
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, InitVar, fields
from math import radians
from pathlib import Path
from threading import current_thread, main_thread
from types import FrameType, UnionType
from typing import Annotated, Any, Literal, Self, TypeAlias, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails, PydanticKnownError

from problems.base import Count, Quantity, quantities_in, written
from tpbso_casadi.plain import nearest
from tpbso_casadi.scenario.catalogues import failure

Location: TypeAlias = Sequence[int | str]
DATE = "a date"  # the only key of a table that stands for one
LONGEST_HINT = 100  # characters of a word for which a similar one is looked up
NEEDED = {  # by what pydantic calls an error
    "int_type": "a whole number is needed",
    "int_from_float": "a whole number is needed",
    "float_type": "a number is needed",
    "finite_number": "a finite number is needed",
    "string_type": "a word is needed",
    "bool_type": "true or false is needed",
    "list_type": "a list is needed",
    "tuple_type": "a list is needed",
    "dict_type": "a table is needed",
    "model_type": "a table is needed",
    "string_too_long": "a shorter word is needed",
    "json_invalid": "nested too deeply, or not text in UTF-8",
}

DEFERRED = signal.SIGINT, signal.SIGTERM


class StrictModel(BaseModel):
    """A table of a file: unknown keys and NaN or infinite numbers are errors, types are not guessed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    def model_dump(self, **options: Any) -> dict[str, Any]:
        """As pydantic's; Ctrl-C waits for its end."""
        with _signals_deferred():
            return super().model_dump(**options)

    def model_dump_json(self, **options: Any) -> str:
        """As pydantic's; Ctrl-C waits for its end."""
        with _signals_deferred():
            return super().model_dump_json(**options)


@contextmanager
def _signals_deferred() -> Iterator[None]:
    """Pydantic takes what is raised in a serializer for an error, or for a reason to try another one: Ctrl-C too."""
    if current_thread() is not main_thread():  # in which no handler runs
        yield
        return
    received: list[tuple[int, FrameType | None]] = []
    handlers: dict[int, Callable[[int, FrameType | None], object]] = {
        number: handler for number in DEFERRED if callable(handler := signal.getsignal(number))
    }
    for number in handlers:
        signal.signal(number, lambda *arguments: received.append(arguments))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number, frame in received:
            handlers[number](number, frame)


class NestedError(ValueError):
    """An error in a table that is validated on its own; the message starts with a key of that table."""


def choice_of(known: Collection[str], find: Callable[[str], object] | None = None) -> AfterValidator:
    """A validator of text that must be one of the names in a registry, as it is when a file is read.

    Args:
        known: the names.
        find: looks up what a plug-in offers, by ``package.module:Attribute`` or by a name; raises ValueError.
    """

    def check(name: str) -> str:
        if name in known or (find is not None and _is_found(name, find)):
            return name
        raise PydanticKnownError("literal_error", {"expected": in_words([repr(option) for option in known])})

    return AfterValidator(check)


def _is_found(name: str, find: Callable[[str], object]) -> bool:
    """Whether a plug-in offers a name; what is wrong with a path ``package.module:Attribute`` is raised."""
    try:
        find(name)
    except ValueError:
        if ":" in name:
            raise
        return False
    return True


def in_words(options: Sequence[str]) -> str:
    """``a, b or c``."""
    return " or ".join(filter(None, [", ".join(options[:-1]), options[-1]]))


def describe(error: ValidationError, model: type[BaseModel], content: Any) -> str:
    """The first error of a validation as ``key.path: reason``.

    Args:
        error: of pydantic.
        model: that was validated.
        content: the plain data that does not fit it.
    """
    first = _most_telling(error.errors(include_url=False), content)
    kind, context = first["type"], first.get("ctx", {})
    cause = _too_long(context) if kind == "too_long" else context.get("error")
    keys = _keys(first["loc"], content, kind == "missing")
    path = ".".join(map(str, keys))
    if kind == "json_invalid":
        return NEEDED[kind]
    if isinstance(cause, NestedError):
        return f"{path}.{cause}" if path else str(cause)
    if kind == "extra_forbidden":
        return f"{path}: unknown key{hint(str(keys[-1]), _known_keys(model, keys[:-1]))}"
    if kind == "missing":
        return f"{path}: missing key"
    reason = str(cause) if cause is not None else NEEDED.get(kind, first["msg"][0].lower() + first["msg"][1:])
    if cause is not None or kind == "unknown_task":
        return f"{path}: {reason}" if path else reason
    given = first["input"]
    near = hint(given, re.findall(r"'([^']*)'", reason)) if kind == "literal_error" else ""
    return f"{path}: {reason}, not {shown(given)}{near}" if path else f"{reason}, not {shown(given)}"


def _too_long(context: dict[str, Any]) -> str:
    return f"at most {context['max_length']} items, not {context['actual_length']}"


def _most_telling(errors: Sequence[ErrorDetails], content: Any) -> ErrorDetails:
    """The first error; of a list where one number would do as well, that of its first wrong entry."""
    first = errors[0]
    if first["type"] != "float_type" or not isinstance(first["input"], list):
        return first
    keys = _keys(first["loc"], content, missing=False)
    of_entries = [error for error in errors if _keys(error["loc"], content, missing=False)[:-1] == keys]
    return of_entries[0] if of_entries else first


def as_text(content: object) -> str:
    """Plain data as JSON; a date, which JSON lacks, as a table that fits no key.

    Raises:
        ValueError: a whole number of thousands of digits.
        RecursionError: nested too deeply.
    """
    return json.dumps(content, default=lambda value: {DATE: str(value)})


def plain(value: Any) -> Any:
    """The same with lists in place of arrays and tuples, and text in place of paths and classes."""
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


def shown(value: object) -> str:
    """A wrong value for a message: as Python writes it, shortened."""
    if isinstance(value, dict) and list(value) == [DATE]:
        return str(value[DATE])
    try:
        return written(value)
    except ValueError:
        return "a number of thousands of digits"


def hint(word: object, known: Iterable[str]) -> str:
    """The end of a message that names the nearest known word; empty where none is near."""
    near = nearest(str(word)[:LONGEST_HINT], known)
    return f"; did you mean {near}?" if near else ""


def _keys(location: Location, content: Any, missing: bool) -> list[int | str]:
    """The parts of pydantic's location that are keys or indices; the others name members of unions."""
    keys: list[int | str] = []
    for part in location:
        is_key = isinstance(content, dict) and part in content
        is_index = isinstance(content, (list, tuple)) and isinstance(part, int) and part < len(content)
        if is_key or is_index:
            content = content[part]
        elif not (missing and part == location[-1]):
            continue
        keys.append(part)
    return keys


def _known_keys(model: type[BaseModel], path: Location) -> list[str]:
    """The keys that a model knows at a path."""
    table: type[BaseModel] | None = model
    for key in path:
        if table is not None and isinstance(key, str):
            field = table.model_fields.get(key)
            table = None if field is None else _model_in(field.annotation)
    return [] if table is None else list(table.model_fields)


def _model_in(annotation: Any) -> type[BaseModel] | None:
    """The model in a type such as ``list[Model]`` or ``Model | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next(filter(None, map(_model_in, get_args(annotation))), None)


S = TypeVar("S", bound=StrictModel)

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


class Section(StrictModel):
    """A table of a scenario file."""

    def in_radians(self) -> Self:
        """The same table, read as one in degrees: what is stated of its ``ANGULAR`` fields, and of tables within."""
        stated = {name: getattr(self, name) for name in self.model_fields_set if name in type(self).model_fields}
        return self.model_copy(
            update={
                name: in_radians(value, angular=_is_angular(type(self).model_fields[name]))
                for name, value in stated.items()
            }
        )


def _is_angular(field: FieldInfo) -> bool:
    """Whether the numbers of a field are angles, wherever in its type that is said."""

    def says_so(hint: Any) -> bool:
        return ANGULAR in getattr(hint, "__metadata__", ()) or any(map(says_so, get_args(hint)))

    return ANGULAR in field.metadata or says_so(field.annotation)


def keys_of(kind: type[Any]) -> dict[str, tuple[Any, Any]]:
    """The keys of a table that states an object of a dataclass, as pydantic defines them: type and default.

    They are the arguments of its constructor; their types say which of them are angles, and which have to be positive.
    """
    hints = get_type_hints(kind, include_extras=True)
    made = {each.name: each.default_factory for each in fields(kind) if each.default_factory is not MISSING}
    defaults = {
        name: Field(default_factory=made[name]) if name in made else ... if each.default is each.empty else each.default
        for name, each in inspect.signature(kind).parameters.items()
    }
    return {name: (_key_type(hints[name]), default) for name, default in defaults.items()}


def _key_type(hint: Any) -> Any:
    """The type of a key for a field of that type."""
    hint = hint.type if isinstance(hint, InitVar) else hint
    return (
        Annotated[_in_a_file(hint), ANGULAR]
        if any(quantity.unit.startswith("rad") for quantity in quantities_in(hint))
        else _in_a_file(hint)
    )


def _in_a_file(hint: Any) -> Any:
    """A type with the limits that hold for what stands in a file, and a list in place of a tuple of any length."""
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _limited(_in_a_file(parts[0]), parts[1:])
    if origin is tuple:
        return list[_in_a_file(parts[0])] if parts[-1] is Ellipsis else tuple[tuple(map(_in_a_file, parts))]  # type: ignore[misc]
    if origin in (Union, UnionType):
        return Union[tuple(map(_in_a_file, parts))]  # noqa: UP007 (of parts that are known when it runs)
    return {float: Number, str: Word}.get(hint, hint)


def _limited(key: Any, marks: Sequence[Any]) -> Any:
    for mark in marks:
        if isinstance(mark, Quantity):
            least = mark.bounds[0]
            key = Positive if least > 0.0 else NotNegative if least == 0.0 else Number
        elif isinstance(mark, Count):
            key = Annotated[key, Field(min_length=mark.least, max_length=mark.most)]
    return key


def stated_values(thing: Any) -> dict[str, Any]:
    """The keys of the table that states an object of a dataclass, those without a value left out; plain data."""
    values = {field.name: getattr(thing, field.name) for field in fields(thing) if field.init}
    return {key: plain(value) for key, value in values.items() if value is not None}


def in_tuples(value: Any) -> Any:
    """A value of a table as a field of a frozen dataclass holds it."""
    return tuple(map(in_tuples, value)) if isinstance(value, (list, tuple)) else value


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
