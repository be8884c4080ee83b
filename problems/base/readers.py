"""Readers of plain data: what the types of a table's keys, or of a dataclass's fields, ask of what a file states.

Types are not guessed: a number is a number, a word is a word.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import MISSING, InitVar, is_dataclass
from enum import Enum
from functools import cache, partial, reduce
from math import isfinite
from operator import ge, gt, le, lt
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

from problems.base.fields import Count, Quantity
from problems.base.refusals import InvalidTable, at, did_you_mean, not_among, shown_value

Reader = Callable[[Any], Any]
NEEDED: dict[Any, str] = {
    int: "a whole number is needed",
    float: "a number is needed",
    str: "a word is needed",
    bool: "true or false is needed",
    list: "a list is needed",
    tuple: "a list is needed",
    dict: "a table is needed",
}


FROM_TABLE = "from_table"  # the class method of what is read as a table


class Range(NamedTuple):
    """Bounds of a number: ``Annotated[int, Range(least=1)]``; the number is not ``above`` or ``below`` itself."""

    least: float | None = None
    most: float | None = None
    above: float | None = None
    below: float | None = None

    def broken(self, value: float) -> str:
        """The bound that a number breaks, in words; empty where it keeps all."""
        for bound, is_wrong, words in (
            (self.most, gt, "less than or equal to"),
            (self.below, ge, "less than"),
            (self.least, lt, "greater than or equal to"),
            (self.above, le, "greater than"),
        ):
            if bound is not None and is_wrong(value, bound):
                return f"{words} {int(bound) if float(bound).is_integer() else bound}"
        return ""

    def checked(self, value: float) -> float:
        """The number, if it is within the bounds.

        Raises:
            InvalidTable: it is not.
        """
        if broken := self.broken(value):
            raise InvalidTable(f"input should be {broken}, not {shown_value(value)}")
        return value


class Checked(NamedTuple):
    """A check of a value that has its type already: a function that returns the value, maybe another one, or raises."""

    function: Reader


class ReadBy(NamedTuple):
    """A function that makes the value of plain data, in place of what the type says."""

    function: Reader


class Key(NamedTuple):
    """One key of a table.

    Attributes:
        hint: its type.
        default: its value where it is left out; ``MISSING`` where it must not be.
        factory: makes that value, where it is a list or a table.
    """

    hint: Any
    default: Any
    factory: Any

    @property
    def is_needed(self) -> bool:
        """Whether the key must not be left out."""
        return self.default is MISSING and self.factory is MISSING

    @property
    def usual(self) -> Any:
        """The value of the key where it is left out; None where it must not be."""
        if self.factory is not MISSING:
            return self.factory()
        return None if self.default is MISSING else self.default


class Kind(NamedTuple):
    """The kind of plain data that a type asks for.

    Attributes:
        fits: whether a value has its form: a number, a word, a list or a table.
        read: the value of plain data; raises :class:`InvalidTable`, or any ValueError, where it is wrong.
    """

    fits: Callable[[Any], bool]
    read: Reader


@cache
def kind_of(hint: Any) -> Kind:
    """The kind of a type: number, word, ``Literal``, table, list of such, with marks where it is ``Annotated``."""
    if isinstance(hint, type) and hasattr(hint, FROM_TABLE):
        return Kind(lambda value: isinstance(value, hint | Mapping), getattr(hint, FROM_TABLE))
    if isinstance(hint, type) and issubclass(hint, Enum):
        return Kind(lambda value: isinstance(value, hint), partial(_member, hint))
    if isinstance(hint, type) and is_dataclass(hint):
        return Kind(lambda value: isinstance(value, hint | Mapping), partial(_made, hint))
    make = KINDS.get(get_origin(hint) or hint)
    return Kind(lambda value: True, lambda value: value) if make is None else make(hint)


def reader(hint: Any) -> Reader:
    """The function that reads a value of a type from plain data."""
    return kind_of(hint).read


def _marked(hint: Any) -> Kind:
    inner, *marks = get_args(hint)
    own = next((Kind(lambda value: True, mark.function) for mark in marks if isinstance(mark, ReadBy)), None)
    kind = own or kind_of(inner)
    bounds = [each.checked for mark in marks if (each := _range_of(mark)) is not None]
    checks = [check for mark in marks if (check := _check(mark)) is not None]

    def read(value: Any) -> Any:
        found = kind.read(value)
        if isinstance(value, int | float):
            for check in bounds:
                check(value)  # which is shown as it was stated
        return reduce(lambda known, check: check(known), checks, found)

    return Kind(kind.fits, read) if bounds or checks else kind


def _range_of(mark: Any) -> Range | None:
    """The bounds that a mark sets: of a quantity its sign alone, as what is made of it checks the rest."""
    if isinstance(mark, Quantity) and mark.bounds[0] >= 0.0:
        return Range(above=0.0) if mark.bounds[0] > 0.0 else Range(least=0.0)
    return mark if isinstance(mark, Range) else None


def _check(mark: Any) -> Reader | None:
    if isinstance(mark, Count):
        return partial(_of_length, mark)
    return mark.function if isinstance(mark, Checked) else None


def _of_length(count: Count, value: Any) -> Any:
    if value is None:
        return value
    if isinstance(value, str) and not count.least <= len(value) <= count.most:
        words = "a shorter word is needed" if len(value) > count.most else "a longer word is needed"
        raise InvalidTable(f"{words}, not {shown_value(value)}")
    if len(value) > count.most:
        raise InvalidTable(f"at most {count.most} items, not {len(value)}")
    if len(value) < count.least:
        raise InvalidTable(f"a list of at least {count.least} items is needed, not of {len(value)}")
    return value


def _either(hint: Any) -> Kind:
    """The first type of a union that a value has the form of; where none is, its first one says what is needed."""
    kinds = [kind_of(part) for part in get_args(hint) if part is not NoneType]
    may_be_none = NoneType in get_args(hint)

    def read(value: Any) -> Any:
        if value is None and may_be_none:
            return None
        return next((kind for kind in kinds if kind.fits(value)), kinds[0]).read(value)

    return Kind(lambda value: (value is None and may_be_none) or any(kind.fits(value) for kind in kinds), read)


def _choice(hint: Any) -> Kind:
    options = get_args(hint)

    def fits(value: Any) -> bool:
        return any(type(value) is type(option) and value == option for option in options)

    def read(value: Any) -> Any:
        if fits(value):
            return value
        raise not_among(value, options)

    return Kind(fits, read)


def _member(kind: type[Enum], value: Any) -> Enum:
    try:
        return kind(value)
    except ValueError as error:
        raise not_among(value, [each.value for each in kind]) from error


def _single(hint: Any) -> Kind:
    wanted: Any = (int, float) if hint is float else hint

    def fits(value: Any) -> bool:
        return isinstance(value, wanted) and (hint is bool or not isinstance(value, bool))

    def read(value: Any) -> Any:
        if not fits(value):
            raise InvalidTable(f"{NEEDED[hint]}, not {shown_value(value)}")
        return _FINISHED[hint](value) if hint in _FINISHED else value

    return Kind(fits, read)


def _finite(value: float) -> float:
    try:
        number = float(value)
    except OverflowError:
        number = float("inf")
    if not isfinite(number):
        raise InvalidTable(f"a finite number is needed, not {shown_value(value)}")
    return number


def _encodable(value: str) -> str:
    try:
        value.encode()
    except UnicodeEncodeError as error:
        raise InvalidTable("not text in UTF-8") from error
    return value


_FINISHED: dict[Any, Reader] = {float: _finite, str: _encodable}


def _mapping(hint: Any) -> Kind:
    key, entry = map(kind_of, get_args(hint) or (Any, Any))

    def read(value: Any) -> Any:
        if not isinstance(value, Mapping):
            raise InvalidTable(f"{NEEDED[dict]}, not {shown_value(value)}")
        found = {}
        for name, each in value.items():
            with at(name):
                found[key.read(name)] = entry.read(each)
        return found

    return Kind(lambda value: isinstance(value, Mapping), read)


def _listed(hint: Any) -> Kind:
    made, parts = get_origin(hint) or hint, get_args(hint) or (Any, ...)
    open_ended = made is list or parts[-1] is Ellipsis
    kinds = [kind_of(part) for part in parts if part is not Ellipsis]

    def read(value: Any) -> Any:
        if not isinstance(value, list | tuple):
            raise InvalidTable(f"{NEEDED[list]}, not {shown_value(value)}")
        if open_ended and _are_numbers(value, parts[0]):
            return made(value)
        wanted = kinds * len(value) if open_ended else kinds
        if len(value) != len(wanted):
            reason = "missing key" if len(value) < len(wanted) else f"at most {len(wanted)} items, not {len(value)}"
            raise InvalidTable(reason, *[len(value)][: len(value) < len(wanted)])
        return made(_entries(value, wanted))

    return Kind(lambda value: isinstance(value, list | tuple), read)


def _are_numbers(values: Sequence[Any], hint: Any) -> bool:
    """Whether all entries of a list are finite floats within the bounds of a type; of others each one is read."""
    marks = getattr(hint, "__metadata__", ())
    ranges = [each for mark in marks if (each := _range_of(mark)) is not None]
    asks_more = any(isinstance(mark, Checked | ReadBy) for mark in marks)
    if asks_more or (get_args(hint)[0] if marks else hint) is not float or {*map(type, values)} != {float}:
        return False
    return isfinite(sum(values)) and not any(each.broken(min(values)) or each.broken(max(values)) for each in ranges)


def _entries(values: Sequence[Any], kinds: Sequence[Kind]) -> Iterator[Any]:
    for index, (value, kind) in enumerate(zip(values, kinds, strict=True)):
        try:
            yield kind.read(value)
        except ValueError:
            with at(index):
                raise


KINDS: dict[Any, Callable[[Any], Kind]] = {
    **dict.fromkeys((int, float, str, bool), _single),
    **dict.fromkeys((list, tuple), _listed),
    **dict.fromkeys((dict, Mapping), _mapping),
    **dict.fromkeys((Union, UnionType), _either),
    Annotated: _marked,
    Literal: _choice,
}


# Dataclasses


def keys_of_fields(kind: Any) -> dict[str, Key]:
    """The keys of a dataclass: the arguments with which it is made, in their order."""
    return dict(_keys(kind))


@cache
def _keys(kind: Any) -> Mapping[str, Key]:
    hints = get_type_hints(kind, include_extras=True)
    known = {each.name: each for each in kind.__dataclass_fields__.values()}  # variables of its constructor included
    names = [name for name in inspect.signature(kind).parameters if name in known]
    return {name: Key(_of_variable(hints[name]), known[name].default, known[name].default_factory) for name in names}


def _of_variable(hint: Any) -> Any:
    return hint.type if isinstance(hint, InitVar) else hint


def check_keys(content: Any, known: Mapping[str, Key]) -> None:
    """Check that plain data are a table with known keys.

    Raises:
        InvalidTable: they are none, a key is unknown, or one is missing.
    """
    if not isinstance(content, Mapping):
        raise InvalidTable(f"{NEEDED[dict]}, not {shown_value(content)}")
    unknown = {name: did_you_mean(name, known) for name in content if name not in known}
    missing = [name for name, key in known.items() if key.is_needed and name not in content]
    if missing and not any(unknown.values()):
        raise InvalidTable("missing key", missing[0])
    if unknown:
        name = max(unknown, key=lambda each: bool(unknown[each]))
        raise InvalidTable(f"unknown key{unknown[name]}", str(name))


def read_arguments(kind: Any, content: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments with which an object of a dataclass is made, of plain data whose keys are known to be its own.

    Raises:
        InvalidTable: a value is of another type than its field.
    """
    values = {}
    for name, key in keys_of_fields(kind).items():
        if name in content:
            with at(name):
                values[name] = reader(key.hint)(content[name])
    return values


def _made(kind: Any, content: Any) -> Any:
    if isinstance(content, kind):
        return content
    check_keys(content, keys_of_fields(kind))
    values = read_arguments(kind, content)
    with at():
        return kind(**values)
