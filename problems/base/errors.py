"""What is refused, and how it is said: an invalid problem names the field and the reason."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Annotated, Any, NamedTuple, TypeAlias, get_args, get_type_hints

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


class Quantity(NamedTuple):
    """What the numbers of a field are, as its type says: ``Annotated[float, Quantity(LENGTHS, "m")]``.

    Attributes:
        bounds: the least and the largest that such a number may be.
        unit: of it.
    """

    bounds: tuple[float, float]
    unit: str

    def __repr__(self) -> str:
        return repr(self.unit)


class Count(NamedTuple):
    """How many entries a field of any length may have, as its type says."""

    least: int
    most: int

    def __repr__(self) -> str:
        return repr(f"{self.least} to {self.most}")


Length: TypeAlias = Annotated[float, Quantity(LENGTHS, "m")]
Coordinate: TypeAlias = Annotated[float, Quantity(COORDINATES, "m")]
Angle: TypeAlias = Annotated[float, Quantity(ANGLES, "rad")]


UNIT_TOLERANCE = 1e-3  # by which the length of a stated quaternion may differ from 1


def is_of_length_one(quaternion: Sequence[float] | FloatArray) -> bool:
    """Whether a quaternion is one of a rotation, up to what digits of a file leave out."""
    return abs(float(np.linalg.norm(quaternion)) - 1.0) <= UNIT_TOLERANCE


def check_within(field: str, values: Iterable[float], bounds: tuple[float, float], unit: str, name: str = "") -> None:
    """Every value is a number between the bounds; ``name`` says more than the field whose they are.

    Raises:
        InvalidProblem: one is not.
    """
    least, most = bounds
    for value in values:
        if not least <= value <= most:
            exactly = repr(value) if shown(value) in (shown(least), shown(most)) else shown(value)
            raise InvalidProblem(field, f"{name}{exactly} is not within {least:g} and {most:g} {unit}")


def check_quantities(statement: Any, *names: str) -> None:
    """The numbers of fields are within the bounds that the types of the fields state.

    Raises:
        InvalidProblem: one is not, the first in the order of the names.
    """
    kind: Any = type(statement)
    quantities = _quantities(kind)
    for name in names:
        if name in quantities:
            check_within(name, _entries(getattr(statement, name)), quantities[name].bounds, quantities[name].unit)


def _entries(value: Any) -> list[float]:
    """A number, or those in tuples of any depth; none where there is no value."""
    if isinstance(value, tuple):
        return [number for entry in value for number in _entries(entry)]
    return [] if value is None else [value]


@cache
def _quantities(kind: type) -> dict[str, Quantity]:
    """What the numbers of each field are."""
    found = {name: quantities_in(hint) for name, hint in get_type_hints(kind, include_extras=True).items()}
    return {name: quantities[0] for name, quantities in found.items() if quantities}


def quantities_in(hint: Any) -> list[Quantity]:
    """All quantities in the type of a field."""
    if isinstance(hint, Quantity):
        return [hint]
    return [quantity for part in get_args(hint) for quantity in quantities_in(part)]


def shown(value: float) -> str:
    """A number for a message; integers too may have more digits than can be printed."""
    try:
        return f"{float(value):g}"
    except OverflowError:
        return "a number of more than 300 digits"


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
    """Which of Python's own limits the content of a file exceeds."""
    return "nested too deeply" if isinstance(error, RecursionError) else "a whole number of thousands of digits"
