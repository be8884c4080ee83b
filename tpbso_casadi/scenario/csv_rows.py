"""Rows of numbers in CSV files."""

from __future__ import annotations

from tpbso_casadi.scenario.section import ScenarioError


def numbers_of(place: str, line: str, width: int) -> list[float]:
    """The numbers of a line, as many as the header has names.

    Raises:
        ScenarioError: naming the place.
    """
    try:
        numbers = [float(cell) for cell in line.split(",")]
    except ValueError as error:
        raise ScenarioError(f"{place}: {width} numbers are needed") from error
    if len(numbers) != width:
        raise ScenarioError(f"{place}: {len(numbers)} numbers where the header has {width} names")
    return numbers
