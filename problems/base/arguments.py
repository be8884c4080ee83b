"""Objects whose numbers are arguments of compiled code: collected, replaced by symbols, recognised by structure.

A formula reads its numbers from the statement that it belongs to: lengths from the robot, places from the obstacles.
Given the statement itself it computes with these numbers; given the statement's symbolic copy it builds an expression
in which every number is a symbol. Code compiled from the symbolic copy serves every statement of the same structure.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Any, ClassVar, TypeVar

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray

S = TypeVar("S")


class Parametric:
    """A frozen dataclass of which some fields are numbers that change from plan to plan.

    Attributes:
        numbers: names of these fields: numbers, or tuples of numbers or of such tuples.
        zero_is_structure: those of them that stay numbers where they are zero, because formulas are then shorter.
        inert: names of fields that no formula reads, as names are: they are no part of the structure.
    """

    numbers: ClassVar[tuple[str, ...]] = ()
    zero_is_structure: ClassVar[tuple[str, ...]] = ()
    inert: ClassVar[tuple[str, ...]] = ()


def is_zero(value: Any) -> bool:
    """Whether a number, or every number in a tuple, is zero; a symbol never is."""
    if isinstance(value, tuple):
        return all(is_zero(entry) for entry in value)
    return isinstance(value, (int, float)) and value == 0.0


class Copies(ABC):
    """Copies of statements in which some fields differ; a statement that occurs twice has one copy."""

    def __init__(self) -> None:
        self._copies: dict[int, tuple[object, object]] = {}

    def copied(self, statement: S) -> S:
        """The copy of a statement, or of a tuple of them; anything else is itself."""
        if isinstance(statement, tuple):
            return tuple(self.copied(entry) for entry in statement)  # type: ignore[return-value]
        if not (isinstance(statement, Parametric) and is_dataclass(statement)):
            return statement
        if id(statement) not in self._copies:
            self._copies[id(statement)] = statement, self._made(statement)
        return self._copies[id(statement)][1]

    def _made(self, statement: Parametric) -> Parametric:
        copy = object.__new__(type(statement))
        for field in fields(statement):  # type: ignore[arg-type]
            object.__setattr__(copy, field.name, self._value(statement, field.name))
        return copy

    @abstractmethod
    def _value(self, statement: Parametric, field: str) -> Any:
        """The value of a field in the copy of a statement."""


class Replacement(Copies):
    """Copies of statements in which fields of one of them have other values, which nothing checks.

    Args:
        statement: that has them.
        values: by the names of its fields.
    """

    def __init__(self, statement: Parametric, values: Mapping[str, Any]) -> None:
        super().__init__()
        self._statement, self._values = statement, values

    def _value(self, statement: Parametric, field: str) -> Any:
        if statement is self._statement and field in self._values:
            return self._values[field]
        return self.copied(getattr(statement, field))


class Arguments(Copies):
    """Symbols in the place of numbers, and the numbers themselves in the same order."""

    def __init__(self) -> None:
        super().__init__()
        self._symbols: list[ca.SX] = []
        self._values: list[float] = []

    @property
    def symbols(self) -> ca.SX:
        """All symbols, (q, 1)."""
        return ca.vertcat(*self._symbols) if self._symbols else ca.SX(0, 1)

    @property
    def values(self) -> FloatArray:
        """The numbers that they stand for, (q,)."""
        return np.array(self._values, dtype=np.float64)

    def symbol(self, value: Any) -> Any:
        """A symbol for a number; for a tuple a tuple of symbols; None stays None."""
        if value is None:
            return None
        if isinstance(value, tuple):
            return tuple(self.symbol(entry) for entry in value)
        symbol = ca.SX.sym(f"p{len(self._values)}")
        self._symbols.append(symbol)
        self._values.append(float(value))
        return symbol

    def symbolic_copy(self, statement: S) -> S:
        """The statement with symbols for its numbers and those of every statement in it."""
        return self.copied(statement)

    def _value(self, statement: Parametric, field: str) -> Any:
        value = getattr(statement, field)
        structural = field in statement.zero_is_structure and is_zero(value)
        if field in statement.numbers and not structural:
            return self.symbol(value)
        return value if field in statement.inert else self.copied(value)


class Reading:
    """A reader of the numbers of statements without anything symbolic, in the order of :class:`Arguments`.

    Args:
        statements: one, or a tuple of them.

    Attributes:
        structure_key: what statements of one structure have in common: all that is no number, and how many numbers
            are where. Code compiled from the symbolic copy of one serves all of them. Hashable, where all that is no
            number is.
    """

    def __init__(self, statements: object) -> None:
        self._values: list[float] = []
        self._seen: dict[int, tuple[int, object]] = {}
        self.structure_key = self._read(statements)

    @property
    def values(self) -> FloatArray:
        """All numbers of the statements in their order, (q,)."""
        return np.array(self._values, dtype=np.float64)

    def _read(self, statement: object) -> object:
        if type(statement) in _PLAIN:  # as most fields are
            return statement
        if isinstance(statement, tuple):
            return tuple([self._read(entry) for entry in statement])
        if id(statement) in self._seen:
            return self._seen[id(statement)][0]
        if not isinstance(statement, Parametric):
            return statement
        self._seen[id(statement)] = len(self._seen), statement
        kind: Any = type(statement)
        return kind, *[
            self._number(value) if is_number and not (zero_is_structure and is_zero(value)) else self._read(value)
            for name, is_number, zero_is_structure in _fields_of(kind)
            for value in (getattr(statement, name),)
        ]

    def _number(self, value: Any) -> object:
        if value is None:
            return None
        if isinstance(value, tuple):
            return tuple([self._number(entry) for entry in value])
        self._values.append(float(value))
        return _NUMBER


@cache
def _fields_of(kind: type[Any]) -> tuple[tuple[str, bool, bool], ...]:
    """Name of each field of a kind of statement, whether it is a number, and whether zeros stay as they are."""
    known = fields(kind) if is_dataclass(kind) else ()
    names = [field.name for field in known if field.name not in kind.inert]
    return tuple((name, name in kind.numbers, name in kind.zero_is_structure) for name in names)


_PLAIN = frozenset({float, int, bool, str, type(None)})
_NUMBER = object()  # stands in a structure key for any number
