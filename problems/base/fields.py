"""Fields of frozen dataclasses: what their types say of them, checked in one place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from functools import cache
from numbers import Integral, Real
from operator import is_
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias, Union, get_args, get_origin, get_type_hints

import casadi as ca
import numpy as np

from problems.base.errors import ANGLES, COORDINATES, LENGTHS, InvalidProblem, check_within, shown

SYMBOLS = (ca.SX, ca.MX, ca.DM)
BELIEVED = (float, int, object, Any)  # what is no check of a class


class Quantity(NamedTuple):
    """Bounds and unit of the numbers of a field, in its type: ``Annotated[float, Quantity(LENGTHS, "m")]``.

    Attributes:
        bounds: the least and the largest that such a number may be.
        unit: of it.
    """

    bounds: tuple[float, float]
    unit: str

    def __repr__(self) -> str:
        return repr(self.unit)


class Count(NamedTuple):
    """How many entries a field of any length may have, as its type says.

    Attributes:
        least: of them.
        most: of them.
        what: they are, for messages.
    """

    least: int
    most: int
    what: str = "entries"

    def __repr__(self) -> str:
        return repr(f"{self.least} to {self.most}")


Length: TypeAlias = Annotated[float, Quantity(LENGTHS, "m")]
Coordinate: TypeAlias = Annotated[float, Quantity(COORDINATES, "m")]
Angle: TypeAlias = Annotated[float, Quantity(ANGLES, "rad")]


def check_fields(statement: Any) -> None:
    """Bring the fields of a frozen dataclass into the form that their types state, and check them.

    Lists and arrays become tuples, numbers floats; symbols stay as they are, and so does what has any other type.

    Raises:
        InvalidProblem: a value is of another kind or length, or out of the bounds of its quantity; the first of them.
    """
    kind: Any = type(statement)
    for name, (hint, usual) in _types(kind).items():
        if getattr(statement, name) is usual:
            continue
        object.__setattr__(statement, name, conformed(name, getattr(statement, name), hint))


@cache
def _types(kind: type) -> dict[str, tuple[Any, Any]]:
    """The types of the fields with which an object of a dataclass is made, and their defaults."""
    hints = types_of(kind)
    known = [field for field in fields(kind) if field.init and field.name in hints]
    return {field.name: (hints[field.name], field.default) for field in known}


def types_of(kind: type) -> dict[str, Any]:
    """The types of a class's fields; none where one of them has a name that only its function or a checker knows."""
    try:
        return get_type_hints(kind, include_extras=True)
    except NameError:
        return {}


def conformed(field: str, value: Any, hint: Any) -> Any:
    """A value in the form that a type states.

    Raises:
        InvalidProblem: it is of another kind or length, or out of the bounds of its quantity.
    """
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _marked(field, conformed(field, value, parts[0]), parts[1:])
    if origin in (Union, UnionType):
        return None if value is None and NoneType in parts else _of_one(field, value, hint)
    if origin is tuple and not isinstance(value, SYMBOLS):
        return value if _is_known(value, hint) else _remembered(_in_tuple(field, value, hint), hint)
    if hint in (float, int) and not isinstance(value, SYMBOLS):
        return _number(field, value, hint)
    if origin is Literal and value not in parts:
        raise InvalidProblem(field, f"{shown(value)} is not one of {', '.join(map(str, parts))}")
    if isinstance(hint, type) and hint not in BELIEVED and origin is None and not isinstance(value, hint):
        raise _wrong(field, value, hint)
    return value


LONG, MOST_KNOWN = 16, 256  # entries of a tuple that is worth to be remembered; tuples
_KNOWN: dict[int, tuple[tuple[Any, ...], Any]] = {}  # tuples that fit, and what they fit, by the tuple's identity


def _is_known(value: Any, hint: Any) -> bool:
    """Whether this very object was found to fit before, as copies with other fields share long tuples."""
    known = _KNOWN.get(id(value))
    return known is not None and known[0] is value and known[1] == hint


def _remembered(value: tuple[Any, ...], hint: Any) -> tuple[Any, ...]:
    if len(value) >= LONG:
        _KNOWN[id(value)] = value, hint
        for oldest in [*_KNOWN][:-MOST_KNOWN]:
            _KNOWN.pop(oldest, None)
    return value


def _number(field: str, value: Any, kind: type[float]) -> float:
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral if kind is int else Real):
        raise _wrong(field, value, kind)
    try:
        return kind(value)
    except (OverflowError, ValueError) as error:  # not a number, to a whole one
        raise _wrong(field, value, kind) from error


def _marked(field: str, value: Any, marks: Sequence[Any]) -> Any:
    """A value that satisfies what is written beside its type; else an error is raised."""
    for mark in marks:
        if isinstance(mark, Quantity):
            numbers = [number for number in _entries(value) if not isinstance(number, SYMBOLS)]
            check_within(field, numbers, mark.bounds, mark.unit)
        elif isinstance(mark, Count) and isinstance(value, tuple) and not mark.least <= len(value) <= mark.most:
            raise InvalidProblem(field, f"{len(value)} {mark.what} are not within {mark.least} and {mark.most}")
    return value


def _of_one(field: str, value: Any, hint: Any) -> Any:
    """The value in the form of the first type of a union that it fits."""
    refusals = []
    for part in get_args(hint):
        if part is not NoneType:
            try:
                return conformed(field, value, part)
            except InvalidProblem as error:
                refusals.append(error)
    raise refusals[-1]


def _in_tuple(field: str, value: Any, hint: Any) -> tuple[Any, ...]:
    values = value.tolist() if isinstance(value, np.ndarray) else value
    if not isinstance(values, tuple | list):
        raise _wrong(field, value, hint)
    kinds = get_args(hint)
    if kinds and kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(values)
    if len(values) != len(kinds):
        raise _wrong(field, value, hint)
    found = tuple(conformed(field, entry, kind) for entry, kind in zip(values, kinds, strict=True))
    return values if isinstance(values, tuple) and all(map(is_, found, values)) else found


def _entries(value: Any) -> list[Any]:
    """A number, or those in tuples of any depth; none where there is no value."""
    if isinstance(value, tuple):
        return [number for entry in value for number in _entries(entry)]
    return [] if value is None else [value]


def _wrong(field: str, value: Any, hint: Any) -> InvalidProblem:
    words = needed(hint)
    return InvalidProblem(field, f"{words} {'is' if words.startswith('a') else 'are'} needed, not {shown(value)}")


SEVERAL = {"a number": "numbers", "a whole number": "numbers", "a word": "words"}


def needed(hint: Any) -> str:
    """The words for what a type asks for: ``a number``, ``2 numbers``, ``rows of 2 numbers``, ``an Obstacle``."""
    parts = get_args(hint)
    if get_origin(hint) is Annotated:
        return needed(parts[0])
    if get_origin(hint) is tuple:
        count = "" if parts and parts[-1] is Ellipsis else f"{len(parts)} "
        inner = needed(parts[0]) if parts else "nothing"
        return f"{count}{SEVERAL.get(inner, f'rows of {inner}')}"
    if get_origin(hint) in (Union, UnionType):
        return " or ".join(needed(part) for part in parts if part is not NoneType)
    if get_origin(hint) is Literal:
        return f"any of {', '.join(map(repr, parts))}"
    name = {float: "number", int: "whole number", str: "word", bool: "truth value"}.get(hint, hint.__name__)
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def quantities_in(hint: Any) -> list[Quantity]:
    """All quantities in the type of a field."""
    if isinstance(hint, Quantity):
        return [hint]
    return [quantity for part in get_args(hint) for quantity in quantities_in(part)]
