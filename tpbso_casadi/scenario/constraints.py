"""[[constraints]]: those of a hand by their kinds, and expressions of the user's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import (
    AfterValidator,
    Discriminator,
    Field,
    PlainValidator,
    SerializeAsAny,
    Tag,
    create_model,
    model_serializer,
)

from problems.base import InvalidProblem
from problems.limits import HAND_CONSTRAINTS, HandConstraint, LimitKind
from tpbso_casadi.scenario.expressions import ConstraintSection, NamedSection, OwnName, check_names
from tpbso_casadi.scenario.validation import (
    MOST_EXPRESSIONS,
    NestedError,
    hint,
    in_tuples,
    in_words,
    keys_of,
    read_section,
    shown,
    stated_values,
)


class HandSection(NamedSection):
    """One of [[constraints]] with a ``kind``, whose keys are the fields of its class."""

    of_kind: ClassVar[type[HandConstraint]]

    @model_serializer(mode="plain")
    def _as_stated(self) -> dict[str, Any]:
        """Nothing of what is left out."""
        values = {key: getattr(self, key) for key in type(self).model_fields}
        return {
            key: list(value) if isinstance(value, tuple) else value
            for key, value in values.items()
            if value is not None
        }

    def limit_kind(self) -> LimitKind:
        """The kind of limit.

        Raises:
            InvalidProblem: naming the key that does not fit.
        """
        keys = [key for key in type(self).model_fields if key != "kind"]
        return self.of_kind(**{key: in_tuples(getattr(self, key)) for key in keys})


def _section_of(kind: type[HandConstraint]) -> type[HandSection]:
    """The section of a kind of constraint, which is found again by its name where it is unpickled."""
    keys: dict[str, Any] = keys_of(kind)
    keys |= {"kind": (Literal[kind.kind], ...), "name": (OwnName, kind.kind)}
    section = create_model(f"{kind.__name__}Section", __base__=HandSection, __module__=__name__, **keys)
    section.of_kind = kind
    return section


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
        options = in_words([repr(name) for name in SECTIONS])
        raise NestedError(f"kind: input should be {options}, not {shown(kind)}{hint(kind, SECTIONS)}")
    return read_section(SECTIONS[kind], table, "kind", kind)


def _form(table: object) -> str:
    return "hand" if isinstance(table, HandSection) or (isinstance(table, Mapping) and "kind" in table) else "own"


OfHand = Annotated[SerializeAsAny[HandSection], PlainValidator(read_hand)]
AnyConstraint = Annotated[
    Annotated[ConstraintSection, Tag("own")] | Annotated[OfHand, Tag("hand")], Discriminator(_form)
]
OwnConstraints = Annotated[list[AnyConstraint], Field(max_length=MOST_EXPRESSIONS), AfterValidator(check_names)]


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
