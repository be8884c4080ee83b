"""Motions of obstacles in CSV files."""

from __future__ import annotations

import math

import numpy as np

from problems import InvalidProblem
from problems.scene.moving.tabulated import Tabulated
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import LARGEST, ScenarioError

MOST_MOTION_ROWS = 200  # every piece between two rows is part of what is evaluated at each sample
HEADERS = {
    ("t", "x", "y"): 2,
    ("t", "x", "y", "angle"): 2,
    ("t", "x", "y", "z"): 3,
    ("t", "x", "y", "z", "qx", "qy", "qz", "qw"): 3,
}  # and their dimensions


def read_motion_rows(folder: InputFolder, name: str) -> list[list[float]]:
    """The rows of a file with one of the ``HEADERS``: s, m, rad, quaternions.

    Raises:
        ScenarioError: naming the file, the line and what is wrong with it.
    """
    lines = [(n, line) for n, line in enumerate(folder.read_text(name).splitlines(), start=1) if line.strip()]
    place = f"{folder.path / name}"
    header = tuple(cell.strip() for cell in lines[0][1].split(",")) if lines else ()
    if header not in HEADERS:
        known = " or ".join(",".join(each) for each in HEADERS)
        raise ScenarioError(f"{place}: the header {known} is needed")
    rows = [_row(f"{place} line {number}", line, len(header)) for number, line in lines[1:]]
    if not 2 <= len(rows) <= MOST_MOTION_ROWS:
        raise ScenarioError(f"{place}: {len(rows)} rows; 2 to {MOST_MOTION_ROWS} are needed")
    return rows


def _row(place: str, line: str, width: int) -> list[float]:
    try:
        numbers = [float(cell) for cell in line.split(",")]
    except ValueError as error:
        raise ScenarioError(f"{place}: {width} numbers are needed") from error
    if len(numbers) != width:
        raise ScenarioError(f"{place}: {len(numbers)} numbers where the header has {width} names")
    if not all(math.isfinite(number) and abs(number) <= LARGEST for number in numbers):
        raise ScenarioError(f"{place}: a number is not finite, or too large")
    return numbers


def motion_through(rows: list[list[float]], dim: int) -> Tabulated:
    """The motion of an obstacle of that dimension through rows t, position[, turn].

    Raises:
        InvalidProblem: they do not fit the obstacle, or each other.
    """
    widths = {len(row) for row in rows}
    if len(widths) != 1 or not widths <= {1 + dim, 1 + dim + (1 if dim == 2 else 4)}:
        expected = "t,x,y or t,x,y,angle" if dim == 2 else "t,x,y,z or t,x,y,z,qx,qy,qz,qw"
        raise InvalidProblem("motion", f"rows of {expected} are needed")
    table = np.array(rows, dtype=np.float64)
    turns = table[:, 1 + dim :] if table.shape[1] > 1 + dim else None
    return Tabulated.through(table[:, 0].tolist(), table[:, 1 : 1 + dim], turns)
