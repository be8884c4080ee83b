"""Refusals of values in files: what is wrong, under which key, and what was meant perhaps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from typing import Any

from problems.base.errors import InvalidProblem, written

LONGEST_HINT = 100  # characters of a word for which a similar one is looked up


class InvalidTable(ValueError):
    """A table that is not one; its text is one line: the path of the key, and the reason.

    Attributes:
        reason: what is wrong.
        keys: from the table to the wrong value: names of keys, and indices of lists.
    """

    def __init__(self, reason: str, *keys: str | int) -> None:
        super().__init__(f"{'.'.join(map(str, keys))}: {reason}" if keys else reason)
        self.reason = reason
        self.keys = keys


@contextmanager
def at(*keys: str | int) -> Iterator[None]:
    """Let errors of a value begin with the keys under which it stands.

    Raises:
        InvalidTable: one.
    """
    try:
        yield
    except InvalidTable as error:
        raise InvalidTable(error.reason, *keys, *error.keys) from error
    except InvalidProblem as error:
        raise InvalidTable(error.reason, *keys, *error.field.split(".")) from error
    except ValueError as error:
        raise InvalidTable(str(error), *keys) from error


@contextmanager
def flat(key: str) -> Iterator[None]:
    """Let errors leave out a key: its table stands in a file beside the keys around it.

    Raises:
        InvalidTable: one.
    """
    try:
        yield
    except InvalidTable as error:
        raise InvalidTable(error.reason, *error.keys[error.keys[:1] == (key,) :]) from error


def not_among(value: Any, options: Iterable[Any]) -> InvalidTable:
    """The error of a value that is none of the options, with the nearest of them."""
    names = [*options]
    near = did_you_mean(value, [name for name in names if isinstance(name, str)])
    return InvalidTable(f"input should be {in_words([*map(repr, names)])}, not {shown_value(value)}{near}")


def nearest_word(word: str, known: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The known word that is most like another one; None where none is, by as much as the cutoff, 0 to 1, asks for."""
    found = get_close_matches(word, list(known), n=1, cutoff=cutoff)
    return found[0] if found else None


def did_you_mean(word: object, known: Iterable[str]) -> str:
    """The end of a message that names the nearest known word; empty where none is near."""
    near = nearest_word((word if isinstance(word, str) else shown_value(word))[:LONGEST_HINT], known)
    return f"; did you mean {near}?" if near else ""


def in_words(options: Sequence[str]) -> str:
    """The options in a sentence: ``a, b or c``."""
    return " or ".join(filter(None, [", ".join(options[:-1]), options[-1]]))


def shown_value(value: object) -> str:
    """A wrong value of a file for a message: as Python writes it, shortened; a date as TOML writes it."""
    if hasattr(value, "isoformat"):
        return str(value)
    try:
        return written(value)
    except ValueError:
        return "a number of thousands of digits"
