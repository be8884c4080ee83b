"""Expressions of the user's as tables."""

from __future__ import annotations

from typing import Annotated, Any, Self, TypeVar

from problems import LIMITS, OBJECTIVES, InvalidProblem
from problems.base import Checked, Count, InvalidTable
from problems.limits import StatedExpression
from problems.motions import InvalidText, SampleFunction, read
from problems.objectives import ExpressionObjective
from tpbso_casadi.scenario.validation import Number, Section, Word

LONGEST_EXPRESSION = 2_000_000  # characters
MOST_VALUES = 1_000  # of one expression
TAKEN = {*LIMITS, *OBJECTIVES}


def _readable(text: str) -> str:
    try:
        read(text)
    except InvalidText as error:
        raise ValueError(f"is no expression: {error}") from error
    return text


def _free(name: str) -> str:
    if not name.strip() or not name.isprintable() or ":" in name:
        raise ValueError("a name in printable characters, without a colon, is needed")
    if name in TAKEN:
        raise ValueError(f"{name!r} is the name of one of ours; say another")
    return name


Expression = Annotated[str, Count(0, LONGEST_EXPRESSION), Checked(_readable)]
OwnName = Annotated[Word, Checked(_free)]
Bound = Annotated[list[Number], Count(1, MOST_VALUES)]


class NamedSection(Section):
    """A table with a name of its own."""

    name: OwnName


class ConstraintSection(NamedSection):
    """A table of [[constraints]] without a ``kind``: bounds, in ``unit``, of an expression in one instant."""

    unit: Word = "1"
    lower: Number | Bound | None = None
    upper: Number | Bound | None = None
    expression: Expression

    def check(self) -> None:
        if len(self.expression.split("\n= ")) > MOST_VALUES:
            raise InvalidTable(f"more than {MOST_VALUES} values", "expression")
        try:
            self.limit_kind()
        except InvalidProblem as error:
            raise InvalidTable(error.reason) from error

    @classmethod
    def of(cls, kind: StatedExpression) -> Self:
        """The table that states a kind of limit."""
        lower, upper = (None if bound is None else list(bound) for bound in (kind.lower, kind.upper))
        return cls(name=kind.name, unit=kind.unit, lower=lower, upper=upper, expression=kind.function.text)

    def limit_kind(self) -> StatedExpression:
        """The kind of limit."""
        lower, upper = _bound(self.lower), _bound(self.upper)
        return StatedExpression(self.name, self.unit, SampleFunction(self.expression), lower, upper)


class ObjectiveSection(NamedSection):
    """A table of [[task.objectives]]: the integral over time of ``expression``, and ``terminal`` of the duration."""

    unit: Word = "1"
    expression: Expression | None = None
    terminal: Expression | None = None

    def check(self) -> None:
        try:
            self.built()
        except InvalidProblem as error:
            raise InvalidTable(error.reason) from error

    def built(self) -> ExpressionObjective:
        """The objective that the table states."""
        rate, terminal = (None if text is None else SampleFunction(text) for text in (self.expression, self.terminal))
        return ExpressionObjective(self.name, self.unit, rate, terminal)


S = TypeVar("S", bound=NamedSection)


def check_names(sections: list[S]) -> list[S]:
    """Refuse tables of which two have the same name."""
    names = [section.name for section in sections]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ValueError(f"{twice!r} is there twice; give each a name of its own")
    return sections


def _bound(stated: Any) -> tuple[float, ...] | None:
    if stated is None:
        return None
    return tuple(map(float, stated)) if isinstance(stated, list) else (float(stated),)
