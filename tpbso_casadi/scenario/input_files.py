"""Files beside a scenario: points, rows of joints, motions of obstacles."""

from __future__ import annotations

import math
import os
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import numpy as np

from problems import InvalidProblem, Tabulated
from problems.base import Checked, Count, FloatArray, number_of, toml_tables
from problems.scene import first_fault
from tpbso_casadi.scenario.validation import LARGEST, MOST_GIVEN_POINTS, Number, ScenarioError


def numbers_of(place: str, line: str, width: int) -> list[float]:
    """The numbers of a line, as many as the header has names.

    Raises:
        ScenarioError: naming the place.
    """
    try:
        numbers = [number_of(cell) for cell in line.split(",")]
    except ValueError as error:
        raise ScenarioError(f"{place}: {width} numbers are needed") from error
    if len(numbers) != width:
        raise ScenarioError(f"{place}: {len(numbers)} numbers where the header has {width} names")
    return numbers


LARGEST_FILE = 10_000_000  # bytes
LARGEST_TABLE = 100_000_000  # bytes of a table of joints: a minute of everything that a controller tells at 500 Hz
LARGEST_MESH = 200_000_000  # bytes
LARGEST_TOML = 1_000_000  # bytes, which take a second to parse


@dataclass(frozen=True)
class InputFolder:
    """The folder of a scenario file, which holds the files that the scenario names.

    Attributes:
        path: of the folder.
        outside_allowed: whether a scenario may also name files that lie elsewhere.
    """

    path: Path
    outside_allowed: bool = False

    def read_text(self, name: str, largest: int = LARGEST_FILE) -> str:
        """The text of a file that a scenario names.

        Args:
            name: of the file.
            largest: size that is read, bytes.

        Raises:
            ScenarioError: it lies outside the folder, links followed, or cannot be read; never with its content.
        """
        return read_text(self.checked(self.path / name), largest)

    def read_bytes(self, name: str) -> bytes:
        """The content of a file that a scenario names, of a body: it may be larger than a text.

        Raises:
            ScenarioError: as of a text.
        """
        return read_bytes(self.checked(self.path / name), LARGEST_MESH)

    def checked(self, path: Path) -> Path:
        """A path that may be read.

        Raises:
            ScenarioError: it lies outside the folder, links followed.
        """
        if self.outside_allowed:
            return path
        try:
            inside = path.resolve().is_relative_to(self.path.resolve())
        except (OSError, RuntimeError, ValueError) as error:
            raise ScenarioError(f"{path}: cannot be read: {reason_of(error)}") from error
        if not inside:
            raise ScenarioError(f"{path}: lies outside the scenario's folder; --allow-outside-files allows that")
        return path


def read_text(path: Path, largest: int = LARGEST_FILE) -> str:
    """The text of a regular file in UTF-8.

    Args:
        path: of the file; pipes, devices and folders are refused before they are opened.
        largest: size that is read, bytes.

    Raises:
        ScenarioError: it cannot be read, is larger, or is not text.
    """
    try:
        return _content(path, largest).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: not a text file: {error.reason} at byte {error.start}") from error
    except (OSError, ValueError) as error:
        raise ScenarioError(f"{path}: cannot be read: {reason_of(error)}") from error


def read_toml(path: Path) -> dict[str, Any]:
    """The content of a TOML file.

    Raises:
        ScenarioError: it cannot be read, or is not TOML.
    """
    text = read_text(path, LARGEST_TOML)
    try:
        return toml_tables(text)
    except ValueError as error:
        raise ScenarioError(f"{path}: {error}") from error


def _content(path: Path, largest: int) -> bytes:
    _check_regular(path.stat())
    without_waiting = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0)  # should it have become a pipe since
    with os.fdopen(os.open(path, without_waiting), "rb") as file:
        _check_regular(os.fstat(file.fileno()))
        content = file.read(largest + 1)
    if len(content) > largest:
        raise ValueError(f"it is larger than {largest / 1e6:g} MB")
    return content


def _check_regular(status: os.stat_result) -> None:
    if stat.S_ISDIR(status.st_mode):
        raise ValueError("it is a folder")
    if not stat.S_ISREG(status.st_mode):
        raise ValueError("it is a pipe, a device or a socket, not a file")


def read_bytes(path: Path, largest: int) -> bytes:
    """The content of a regular file.

    Args:
        path: of the file; pipes, devices and folders are refused before they are opened.
        largest: size that is read, bytes.

    Raises:
        ScenarioError: it cannot be read, or is larger.
    """
    try:
        return _content(path, largest)
    except (OSError, ValueError) as error:
        raise ScenarioError(f"{path}: cannot be read: {reason_of(error)}") from error


def is_file(path: Path) -> bool:
    """Whether there is something of that name; False for what cannot be a name."""
    try:
        return path.exists() and not path.is_dir()
    except (OSError, ValueError):
        return False


def is_folder(name: str | Path) -> bool:
    """Whether there is a folder of that name; False for what cannot be a name."""
    try:
        return Path(name).is_dir()
    except OSError:
        return False


def reason_of(error: Exception) -> str:
    """Why the operating system refuses a path, or why it is not a path at all."""
    return (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__


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


PathPoint: TypeAlias = Annotated[tuple[Number, ...], Checked(_point)]
PathPoints: TypeAlias = Annotated[list[PathPoint], Count(0, MOST_GIVEN_POINTS), Checked(_alike)]


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
        point = tuple(number_of(cell) for cell in line.split(","))
    except ValueError as error:
        needed = f"{COLUMNS[len(before[0])]} are needed" if before else ANY_COLUMNS
        raise ScenarioError(f"{place}: {needed}") from error
    if before and len(point) != len(before[0]):
        raise ScenarioError(f"{place}: {COLUMNS[len(before[0])]} are needed")
    if len(point) not in COLUMNS:
        raise ScenarioError(f"{place}: {ANY_COLUMNS}")
    return point


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
    rows = [_motion_row(f"{place} line {number}", line, len(header)) for number, line in lines[1:]]
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


def _motion_row(place: str, line: str, width: int) -> list[float]:
    numbers = numbers_of(place, line, width)
    if not all(math.isfinite(number) and abs(number) <= LARGEST for number in numbers):
        raise ScenarioError(f"{place}: a number is not finite, or larger than {LARGEST:g}")
    return numbers


def _parts(rows: list[list[float]], dim: int) -> tuple[list[float], FloatArray, FloatArray | None]:
    """The times, positions and turns of rows."""
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
