"""What is refused, and how it is said: an invalid problem names the field and the reason."""

from __future__ import annotations

import re
import reprlib
import tomllib
from collections.abc import Iterable, Sequence
from numbers import Real
from typing import Any

import numpy as np

from problems.base.matrix import FloatArray


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


LENGTHS = (1e-12, 1e8)  # m, of links and obstacles
COORDINATES = (-1e8, 1e8)  # m
ANGLES = (-1e6, 1e6)  # rad
RATES = (1e-9, 1e12)  # rad/s, rad/s^2: limits of joints
TORQUES = (1e-9, 1e12)  # N m or N: limits of motors
FRICTIONS = (0.0, 1e12)  # N m s or N s/m, N m or N
MASSES = (1e-9, 1e9)  # kg
INERTIAS = (0.0, 1e12)  # kg m^2
ACCELERATIONS = (-1e6, 1e6)  # m/s^2, of gravity
TIMES = (1e-9, 1e9)  # s


UNIT_TOLERANCE = 1e-3  # by which the length of a stated quaternion may differ from 1


def is_of_length_one(quaternion: Sequence[float] | FloatArray) -> bool:
    """Whether a quaternion has length 1, up to the digits that a file leaves out."""
    return abs(float(np.linalg.norm(quaternion)) - 1.0) <= UNIT_TOLERANCE


def check_within(field: str, values: Iterable[float], bounds: tuple[float, float], unit: str, name: str = "") -> None:
    """Check that every value is a number between the bounds; ``name`` says more than the field.

    Raises:
        InvalidProblem: one is not.
    """
    least, most = bounds
    for value in values:
        if not isinstance(value, Real):
            raise InvalidProblem(field, f"{name}a number is needed, not {shown(value)}")
        if not least <= value <= most:
            exactly = repr(float(value)) if shown(value) in (shown(least), shown(most)) else shown(value)
            raise InvalidProblem(field, f"{name}{exactly} is not within {least:g} and {most:g} {unit}")


LONGEST_VALUE = 60  # characters of a wrong value that are shown
_WRITTEN = reprlib.Repr()
_WRITTEN.maxstring = _WRITTEN.maxother = _WRITTEN.maxlong = 2 * LONGEST_VALUE


def shown(value: object) -> str:
    """A wrong value for a message: a number in short, anything else as Python writes it, shortened."""
    try:
        if isinstance(value, float | int | np.number) and not isinstance(value, bool):
            return f"{float(value):g}"
        return written(value)
    except (OverflowError, ValueError):
        return "a number of more than 300 digits"


def written(value: object) -> str:
    """A value as Python writes it, shortened.

    Raises:
        ValueError: a whole number of thousands of digits, which Python does not write out.
    """
    text = _WRITTEN.repr(value.tolist() if isinstance(value, np.ndarray | np.generic) else value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 3]}..."


DOTTED_KEY = re.compile(  # of 50 parts or more: nothing needs it, and the parser's time grows with the square of them
    r"""(?<![\w"'-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){50}"""
)


def toml_tables(text: str) -> dict[str, Any]:
    """The content of a TOML text of at most a megabyte, which takes a second to parse.

    Raises:
        ValueError: it is no TOML, or needs more than Python or patience has; the reason in one line.
    """
    if DOTTED_KEY.search(text):
        raise ValueError("a key of more than 50 parts")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"not TOML: {error}") from error
    except (ValueError, RecursionError) as error:
        raise ValueError(too_much(error)) from error


def too_much(error: Exception) -> str:
    """The name of Python's own limit that the content of a file exceeds."""
    return "nested too deeply" if isinstance(error, RecursionError) else "a whole number of thousands of digits"
