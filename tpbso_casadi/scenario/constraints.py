"""[[constraints]]: those of a hand by their kinds, and expressions of the user's."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING
from typing import Annotated, Any, ClassVar, Literal

from problems.base import Checked, Count, InvalidProblem, InvalidTable, Key, ReadBy, not_among
from problems.limits import HAND_CONSTRAINTS, HandConstraint, LimitKind
from tpbso_casadi.scenario.expressions import ConstraintSection, NamedSection, OwnName, check_names
from tpbso_casadi.scenario.validation import (
    MOST_EXPRESSIONS,
    in_tuples,
    keys_of,
    read_section,
    section_of_keys,
    stated_values,
)


class HandSection(NamedSection):
    """One of [[constraints]] with a ``kind``, whose keys are the fields of its class."""

    of_kind: ClassVar[type[HandConstraint]]

    def table(self) -> dict[str, Any]:
        return {key: value for key, value in super().table().items() if value is not None}

    def limit_kind(self) -> LimitKind:
        """The kind of limit.

        Raises:
            InvalidProblem: naming the key that does not fit.
        """
        keys = self.schema().keys() - {"kind"}
        return self.of_kind(**{key: in_tuples(getattr(self, key)) for key in keys})


def _section_of(kind: type[HandConstraint]) -> type[HandSection]:
    """The section of a kind of constraint, which is found again by its name where it is unpickled."""
    keys = keys_of(kind) | {"kind": Key(Literal[kind.kind], MISSING, MISSING), "name": Key(OwnName, kind.kind, MISSING)}
    return section_of_keys(f"{kind.__name__}Section", HandSection, keys, __module__=__name__, of_kind=kind)


SECTIONS: dict[str, type[HandSection]] = {name: _section_of(kind) for name, kind in HAND_CONSTRAINTS.items()}
globals().update({section.__name__: section for section in SECTIONS.values()})


def hand_table(constraint: HandConstraint) -> dict[str, Any]:
    """The table that states a constraint of a hand."""
    return {"kind": constraint.kind, **stated_values(constraint)}


def read_hand(table: Any) -> HandSection:
    """The section of one of [[constraints]] that has a ``kind``."""
    if isinstance(table, HandSection):
        return table
    kind = table["kind"]
    if not isinstance(kind, str) or kind not in SECTIONS:
        raise InvalidTable(not_among(kind, SECTIONS).reason, "kind")
    return read_section(SECTIONS[kind], table, "kind", kind)


def read_constraint(table: Any) -> NamedSection:
    """The section of one of [[constraints]]: of a hand where it has a ``kind``, else of an expression."""
    is_of_hand = isinstance(table, HandSection) or (isinstance(table, Mapping) and "kind" in table)
    return read_hand(table) if is_of_hand else ConstraintSection.from_table(table)


AnyConstraint = Annotated[NamedSection, ReadBy(read_constraint)]
OwnConstraints = Annotated[list[AnyConstraint], Count(0, MOST_EXPRESSIONS), Checked(check_names)]


def limit_kinds(sections: list[Any]) -> list[LimitKind]:
    """The kinds of limits that sections state.

    Raises:
        InvalidProblem: naming section and key.
    """
    found: list[LimitKind] = []
    for number, section in enumerate(sections):
        try:
            found.append(section.limit_kind())
        except InvalidProblem as error:
            raise InvalidProblem(f"constraints.{number}.{error.field}", error.reason) from error
    return found
