"""Files of a user, read as text; a path's points from a CSV file."""

from __future__ import annotations

from math import isfinite
from pathlib import Path

from tpbso_casadi.scenario.section import PlanarPoint, ScenarioError


def read_text(path: Path) -> str:
    """The text of a file in UTF-8.

    Raises:
        ScenarioError: it cannot be read, or is not text.
    """
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ScenarioError(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"{path}: not a text file: {error.reason} at byte {error.start}") from error


def read_points(path: Path) -> list[PlanarPoint]:
    """The points of a CSV file: x,y in m, one a line; a first line ``x,y`` and empty lines are skipped.

    Raises:
        ScenarioError: naming the file and the line.
    """
    points: list[PlanarPoint] = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip() or (number == 1 and line.replace(" ", "").lower() == "x,y"):
            continue
        try:
            x, y = (float(cell) for cell in line.split(","))
        except ValueError as error:
            raise ScenarioError(f"{path} line {number}: {line.strip()!r} is not x,y") from error
        if not (isfinite(x) and isfinite(y)):
            raise ScenarioError(f"{path} line {number}: {line.strip()!r} is not finite")
        points.append((x, y))
    return points
