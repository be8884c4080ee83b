"""[[constraints]]: those of a hand by their kinds, and expressions of the user's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

from problems import Robot
from problems.base import (
    Checked,
    Count,
    FloatArray,
    InvalidProblem,
    InvalidTable,
    ReadBy,
    check_keys,
    keys_of_fields,
    not_among,
    plain_value,
)
from problems.limits import HAND_CONSTRAINTS, HandConstraint, LimitKind
from tpbso_casadi.scenario.expressions import ConstraintSection, NamedSection, check_names
from tpbso_casadi.scenario.validation import MOST_EXPRESSIONS, Arguments, Word


class HandSection(NamedSection):
    """A table of [[constraints]] with a ``kind``, whose keys are the fields of its class."""

    kind: Word
    arguments: Arguments

    @classmethod
    def of(cls, constraint: HandConstraint) -> Self:
        """The section that states a constraint of a hand."""
        arguments = Arguments.of(constraint, keys_of_fields(type(constraint)))
        return cls(name=constraint.name, kind=constraint.kind, arguments=arguments)

    @classmethod
    def from_table(cls, content: Any) -> Self:
        kind = content["kind"]
        if not isinstance(kind, str) or kind not in HAND_CONSTRAINTS:
            raise InvalidTable(not_among(kind, HAND_CONSTRAINTS).reason, "kind")
        known = keys_of_fields(HAND_CONSTRAINTS[kind])
        keys = {"name": kind, **{key: value for key, value in content.items() if key != "kind"}}
        check_keys(keys, known)
        return cls(name=keys["name"], kind=kind, arguments=Arguments.read(HAND_CONSTRAINTS[kind], known, keys))

    def table(self) -> dict[str, Any]:
        stated = {key: plain_value(value) for key, value in self.arguments.values.items() if value is not None}
        return {"kind": self.kind, **stated}

    def in_radians(self) -> Self:
        return self.replaced(arguments=self.arguments.in_radians(HAND_CONSTRAINTS[self.kind]))

    def limit_kind(self) -> HandConstraint:
        """The kind of limit.

        Raises:
            InvalidProblem: naming the key that does not fit.
        """
        return HAND_CONSTRAINTS[self.kind](**self.arguments.values)

    def from_posture(self, robot: Robot, theta: FloatArray) -> Self:
        """The section of a motion from a posture (dof,) on.

        Raises:
            InvalidProblem: as :meth:`limit_kind`; or the robot has not what it is about.
        """
        return self.of(self.limit_kind().from_posture(robot, theta))


def read_constraint(table: Any) -> NamedSection:
    """The section of one of [[constraints]]: of a hand where it has a ``kind``, else of an expression."""
    if isinstance(table, NamedSection):
        return table
    is_of_hand = isinstance(table, Mapping) and "kind" in table
    return (HandSection if is_of_hand else ConstraintSection).from_table(table)


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
