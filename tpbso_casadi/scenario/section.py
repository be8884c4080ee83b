"""What every table of a scenario file has in common: kinds of values, and how large they may be.

What is within these limits is built in less than a minute and computed without overflow.
"""

from __future__ import annotations

from typing import Annotated, TypeAlias

from pydantic import AfterValidator, Field

from tpbso_casadi.scenario.validation import StrictModel

LARGEST = 1e12  # magnitude of a number, in whatever unit
SMALLEST = 1e-12  # of a positive number
MOST_LINKS = 100
MOST_SAMPLES = 10_000  # of a segment
MOST_PIECES = 100  # of a path from one place to the next
MOST_POINTS = 1_000  # that a path is planned through
MOST_GIVEN_POINTS = 100_000  # that it is resampled from
MOST_OBSTACLES = 100
MOST_JOINT_SAMPLES = 50_000  # joints times samples
MOST_JOINT_POINTS = 5_000  # joints times points of a path, or times redundancy values
MOST_POINT_CHECKS = 20_000  # points of a path times obstacles
MOST_MEMBERS = 10_000  # of a population
MOST_ITERATIONS = 10_000_000
MOST_EVALUATIONS = 1_000_000_000
MOST_POLISH_STARTS = 64
LARGEST_SEED = 2**63 - 1  # what a database can store
LONGEST_WORD = 200  # characters of a name


def _not_tiny(value: float) -> float:
    if value < SMALLEST:
        raise ValueError(f"{value:g} is below the smallest positive number, {SMALLEST:g}")
    return value


Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Positive = Annotated[float, Field(gt=0, le=LARGEST), AfterValidator(_not_tiny)]
PlanarPoint: TypeAlias = tuple[Number, Number]
Interval: TypeAlias = tuple[Number, Number]
Word = Annotated[str, Field(max_length=LONGEST_WORD)]


class ScenarioError(ValueError):
    """A scenario that cannot be planned; the message is one line: file, key, reason."""


class Section(StrictModel):
    """A table of a scenario file."""
