"""Points of a path, as a scenario file or a CSV file beside it states them: in the plane, in space, or poses."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, TypeAlias

from pydantic import AfterValidator, Field

from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import LARGEST, MOST_GIVEN_POINTS, Number, ScenarioError

COLUMNS = {  # by how many numbers a point has
    2: "two numbers x,y",
    3: "three numbers x,y,z",
    7: "seven numbers x,y,z,qx,qy,qz,qw",
}
ANY_COLUMNS = "two numbers x,y are needed, three in space, seven of a pose"


def _point(point: tuple[float, ...]) -> tuple[float, ...]:
    if len(point) not in COLUMNS:
        raise ValueError(f"{ANY_COLUMNS}, not {len(point)}")
    return point


def _alike(points: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
    for index, point in enumerate(points):
        if len(point) != len(points[0]):
            raise ValueError(f"points[{index}] has {len(point)} numbers, points[0] has {len(points[0])}")
    return points


PathPoint: TypeAlias = Annotated[tuple[Number, ...], AfterValidator(_point)]
PathPoints: TypeAlias = Annotated[list[PathPoint], Field(max_length=MOST_GIVEN_POINTS), AfterValidator(_alike)]


def read_points(folder: InputFolder, name: str) -> list[tuple[float, ...]]:
    """The points of a CSV file: x,y or x,y,z or x,y,z,qx,qy,qz,qw in m, one a line.

    A first line with these names and empty lines are skipped.

    Raises:
        ScenarioError: naming the file and the line, not what it says: the file may be none of the user's.
    """
    points: list[tuple[float, ...]] = []
    for number, line in enumerate(folder.read_text(name).splitlines(), start=1):
        if not line.strip() or (number == 1 and _is_heading(line)):
            continue
        place = f"{folder.path / name} line {number}"
        point = _numbers(line, place, points)
        if not all(abs(part) <= LARGEST for part in point):
            raise ScenarioError(f"{place}: a number is not finite, or larger than {LARGEST:g}")
        if len(points) == MOST_GIVEN_POINTS:
            raise ScenarioError(f"{place}: more than {MOST_GIVEN_POINTS} points")
        points.append(point)
    return points


def _is_heading(line: str) -> bool:
    return any(columns.endswith(f" {line.replace(' ', '').lower()}") for columns in COLUMNS.values())


def _numbers(line: str, place: str, before: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    """The numbers of a line: as many as of the lines before."""
    try:
        point = tuple(float(cell) for cell in line.split(","))
    except ValueError as error:
        needed = f"{COLUMNS[len(before[0])]} are needed" if before else ANY_COLUMNS
        raise ScenarioError(f"{place}: {needed}") from error
    if before and len(point) != len(before[0]):
        raise ScenarioError(f"{place}: {COLUMNS[len(before[0])]} are needed")
    if len(point) not in COLUMNS:
        raise ScenarioError(f"{place}: {ANY_COLUMNS}")
    return point
