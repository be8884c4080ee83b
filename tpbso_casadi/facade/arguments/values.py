"""Single values among arguments: numbers, times, paths of files; each refused by the name of its argument."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.facade.plain_data import plain
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.scenario.validation import shown


def file_path(name: str, value: Any) -> Path:
    """The path of a file or folder.

    Raises:
        TypeError: it is none.
    """
    if not isinstance(value, str | Path):
        raise TypeError(f"{name}: a path is needed, text or a pathlib.Path, not {shown(value)}")
    return Path(value)


def positive(name: str, value: Any, unit: str) -> float:
    """A finite number above 0.

    Raises:
        ValueError: it is none.
    """
    number = plain(value)
    if isinstance(number, bool) or not isinstance(number, int | float) or not (isfinite(number) and number > 0):
        raise ValueError(f"{name}: a number above 0 is needed, in {unit}, not {shown(number)}")
    return float(number)


def whole_or_not(name: str, value: Any) -> int:
    """True, False, or a whole number, as a whole number.

    Raises:
        ScenarioError: it is none.
    """
    number = plain(value)
    if not isinstance(number, int):
        raise ScenarioError(f"{name}: True, False or a whole number is needed, not {shown(number)}")
    return int(number)


def function(name: str, value: Any) -> None:
    """That it can be called.

    Raises:
        TypeError: it cannot.
    """
    if not callable(value):
        raise TypeError(f"{name}: a function is needed, not {shown(value)}")


def times_array(value: Any) -> FloatArray:
    """Times (n,), s.

    Raises:
        ValueError: there are none, or they are no list of numbers.
    """
    needed = "times: numbers (n,) are needed, in s"
    try:
        times = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{needed}, not {shown(plain(value))}") from error
    if times.ndim != 1 or not times.size:
        raise ValueError(f"{needed}, not an array of shape {times.shape}")
    return times
