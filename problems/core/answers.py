"""Answers of Python to questions of the core, through which no exception can pass."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")


class Answers:
    """Answers that may raise, as a user's formula may, or Ctrl-C while it is evaluated: :meth:`check` raises it."""

    def __init__(self) -> None:
        self._raised = list[BaseException]()

    def attempted(self, answer: Callable[[], T], otherwise: T) -> T:
        """The answer; another one where it raises, or one before it has."""
        try:
            return otherwise if self._raised else answer()
        except BaseException as error:
            self._raised.append(error)
            return otherwise

    def check(self) -> None:
        """Raise what an answer has raised since the last time."""
        if self._raised:
            error = self._raised[0]
            self._raised.clear()
            raise error
