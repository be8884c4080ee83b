"""Motions of obstacles in CSV files."""

from __future__ import annotations

import math

import numpy as np

from problems import InvalidProblem
from problems.base.matrix import FloatArray
from problems.scene.moving.rows import first_fault
from problems.scene.moving.tabulated import Tabulated
from tpbso_casadi.scenario.csv_rows import numbers_of
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import LARGEST, ScenarioError

MOST_MOTION_ROWS = 200  # every piece between two rows is part of what is evaluated at each sample
HEADERS = {  # by dimension
    2: ("t,x,y", "t,x,y,angle"),
    3: ("t,x,y,z", "t,x,y,z,qx,qy,qz,qw"),
}
ANGLE = 3  # the column of the angle, in the plane


def read_motion_rows(folder: InputFolder, name: str, dim: int) -> list[list[float]]:
    """The rows of a file with one of the ``HEADERS`` of a dimension; empty lines are skipped.

    Raises:
        ScenarioError: naming the file, the line and what is wrong with it, not what it says: the file may be none of
            the user's.
    """
    lines = [(n, line) for n, line in enumerate(folder.read_text(name).splitlines(), start=1) if line.strip()]
    place, needed = f"{folder.path / name}", f"the header {' or '.join(HEADERS[dim])} is needed"
    if not lines:
        raise ScenarioError(f"{place}: is empty; {needed}")
    header = [cell.strip() for cell in lines[0][1].split(",")]
    if ",".join(header) not in HEADERS[dim]:
        raise ScenarioError(f"{place} line {lines[0][0]}: {needed} of an obstacle in {dim} dimensions")
    if len(lines) - 1 > MOST_MOTION_ROWS:
        raise ScenarioError(f"{place} line {lines[MOST_MOTION_ROWS + 1][0]}: more than {MOST_MOTION_ROWS} rows")
    rows = [_row(f"{place} line {number}", line, len(header)) for number, line in lines[1:]]
    if len(rows) < 2:
        raise ScenarioError(f"{place}: {len(rows)} rows; a motion needs two at least")
    fault = first_fault(*_parts(rows, dim))
    if fault is not None:
        raise ScenarioError(f"{place} line {lines[1 + fault[0]][0]}: {fault[1]}")
    try:
        motion_through(rows, dim)
    except InvalidProblem as error:
        raise ScenarioError(f"{place}: {error.reason}") from error
    return rows


def _row(place: str, line: str, width: int) -> list[float]:
    numbers = numbers_of(place, line, width)
    if not all(math.isfinite(number) and abs(number) <= LARGEST for number in numbers):
        raise ScenarioError(f"{place}: a number is not finite, or larger than {LARGEST:g}")
    return numbers


def _parts(rows: list[list[float]], dim: int) -> tuple[list[float], FloatArray, FloatArray | None]:
    """Times, positions, turns."""
    table = np.array(rows, dtype=np.float64)
    turns = table[:, 1 + dim :] if table.shape[1] > 1 + dim else None
    return table[:, 0].tolist(), table[:, 1 : 1 + dim], turns


def motion_through(rows: list[list[float]], dim: int) -> Tabulated:
    """The motion of an obstacle of that dimension through rows t, position[, turn].

    Raises:
        InvalidProblem: they do not fit the obstacle, or each other.
    """
    widths = {len(row) for row in rows}
    if not any(widths == {header.count(",") + 1} for header in HEADERS[dim]):
        raise InvalidProblem("motion", f"rows of {' or '.join(HEADERS[dim])} are needed")
    return Tabulated.through(*_parts(rows, dim))


def in_radians(rows: list[list[float]]) -> list[list[float]]:
    """Rows in the plane whose angles, if there are any, are in degrees."""
    return [[*row[:ANGLE], *map(math.radians, row[ANGLE:])] for row in rows]
