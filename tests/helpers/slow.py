"""Which parameters of a test are in every run."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Any

import pytest
from _pytest.mark.structures import ParameterSet


def slow_except(values: Iterable[Any], quick: int | Collection[Any]) -> list[ParameterSet]:
    """The values as parameters, of which the first so many or those named are in every run and the others slow."""
    return [
        pytest.param(
            *(value if isinstance(value, tuple) else (value,)),
            marks=[] if (number < quick if isinstance(quick, int) else value in quick) else [pytest.mark.slow],
        )
        for number, value in enumerate(values)
    ]
