"""The numbers that a statement may have; beyond, their squares and quotients are not exact enough, or not finite."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray

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


def shown(value: float) -> str:
    """A number for a message; integers too may have more digits than can be printed."""
    try:
        return f"{float(value):g}"
    except OverflowError:
        return "a number of more than 300 digits"
