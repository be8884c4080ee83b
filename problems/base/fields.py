"""Fields of frozen dataclasses: what their types say of them, checked in one place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from functools import cache
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, TypeAlias, Union, get_args, get_origin, get_type_hints

import casadi as ca
import numpy as np

from problems.base.errors import ANGLES, COORDINATES, LENGTHS, InvalidProblem, check_within, shown

SYMBOLS = (ca.SX, ca.MX, ca.DM)


class Quantity(NamedTuple):
    """What the numbers of a field are, as its type says: ``Annotated[float, Quantity(LENGTHS, "m")]``.

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
    for name, hint in _types(kind).items():
        object.__setattr__(statement, name, conformed(name, getattr(statement, name), hint))


@cache
def _types(kind: type) -> dict[str, Any]:
    """The types of the fields with which an object of a dataclass is made."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: hints[field.name] for field in fields(kind) if field.init}


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
    if isinstance(hint, type) and hint not in (float, int, object) and origin is None:
        if not isinstance(value, hint):
            raise _wrong(field, value, hint)
        return value
    if isinstance(value, SYMBOLS):
        return value
    if origin is tuple:
        return _in_tuple(field, value, hint)
    return _number(field, value, hint) if hint in (float, int) else value


def _number(field: str, value: Any, kind: type[float]) -> float:
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral if kind is int else Real):
        raise _wrong(field, value, kind)
    try:
        return kind(value)
    except OverflowError as error:
        raise _wrong(field, value, kind) from error


def _marked(field: str, value: Any, marks: Sequence[Any]) -> Any:
    """The same value, if it keeps what is written beside its type."""
    for mark in marks:
        if isinstance(mark, Quantity):
            numbers = [number for number in _entries(value) if not isinstance(number, SYMBOLS)]
            check_within(field, numbers, mark.bounds, mark.unit)
        elif isinstance(mark, Count) and not mark.least <= len(value) <= mark.most:
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
    if kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(values)
    if len(values) != len(kinds):
        raise _wrong(field, value, hint)
    return tuple(conformed(field, entry, kind) for entry, kind in zip(values, kinds, strict=True))


def _entries(value: Any) -> list[Any]:
    """A number, or those in tuples of any depth; none where there is no value."""
    if isinstance(value, tuple):
        return [number for entry in value for number in _entries(entry)]
    return [] if value is None else [value]


def _wrong(field: str, value: Any, hint: Any) -> InvalidProblem:
    words = needed(hint)
    return InvalidProblem(field, f"{words} {'is' if words.startswith('a') else 'are'} needed, not {shown(value)}")


def needed(hint: Any) -> str:
    """What a type asks for, in words: ``a number``, ``2 numbers``, ``rows of 2 numbers``, ``an Obstacle``."""
    parts = get_args(hint)
    if get_origin(hint) is Annotated:
        return needed(parts[0])
    if get_origin(hint) is tuple:
        count, inner = ("" if parts[-1] is Ellipsis else f"{len(parts)} "), needed(parts[0])
        return f"{count}numbers" if inner in ("a number", "a whole number") else f"{count}rows of {inner}"
    name = {float: "number", int: "whole number", str: "word", bool: "truth value"}.get(hint, hint.__name__)
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def quantities_in(hint: Any) -> list[Quantity]:
    """All quantities in the type of a field."""
    if isinstance(hint, Quantity):
        return [hint]
    return [quantity for part in get_args(hint) for quantity in quantities_in(part)]
