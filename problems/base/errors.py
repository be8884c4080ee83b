"""The error for a problem that cannot be stated."""

from __future__ import annotations


class InvalidProblem(ValueError):
    """A field of the arm, the task or an obstacle makes the problem impossible.

    Attributes:
        field: the field's name, so that an application can point at the key of its file.
        reason: one line, with numbers and units.
    """

    def __init__(self, field: str, reason: str) -> None:
        super().__init__(f"{field}: {reason}")
        self.field = field
        self.reason = reason
